//! Output-error fit of the linear response over segments, each with a start of its own.
//!
//! What went to the converters is known exactly, and nothing else drives the machine: the prediction is a simulation, and
//! its errors are those of the instruments. Segments keep what the model lacks from adding up: each has its own state at
//! the begin and its own friction level, which are eliminated from the normal equations (Golub & Pereyra 1973). Each
//! channel's residuals are whitened by an autoregression of their own.

use stickslip_core::scalar::Dual;

use super::least_squares::{Block, Vector, blocks, joined, solve};
use super::noise::{MEMORY, Noise, Noises, learn_noise};
use super::parameters::{Index, PARAMETERS, SOUGHT};
use super::response::CHANNELS;
use super::segment::{Segment, Setting};
use super::tacho_ripple::ripple_order;
use super::uncertainty::{Known, Uncertainty};
use stickslip_base::{Error, Watch};

/// Most steps of a descent.
const STEPS: usize = 25;
/// Longest step, in logarithms: beyond, the linear model says nothing.
const LONGEST: f64 = 0.7;

/// What the fit found.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// In the search's coordinates.
    pub(super) coordinates: [f64; PARAMETERS],
    /// How sure they are.
    pub(super) uncertainty: Uncertainty,
    /// The segments, each with its own numbers.
    pub(super) segments: Vec<Segment>,
    /// With the ripple that was found.
    pub(super) setting: Setting,
}

impl Solution {
    /// How well a number is known that depends on the coordinates so.
    pub(super) fn known(&self, number: &Dual<PARAMETERS>) -> Known {
        self.uncertainty.of_number(&Vector::from(number.gradient))
    }
}

/// Seeks the parameters from a start.
pub(super) fn fit(
    start: [f64; PARAMETERS],
    mut segments: Vec<Segment>,
    mut setting: Setting,
    rough: [f64; CHANNELS],
    watch: &Watch,
) -> Result<Solution, Error> {
    let mut coordinates = start;
    // At first every channel is taken for bad, so that none rules before the model is near, and a third of the data do.
    let rough = rough.map(|deviation| Noise { memory: [0.0; MEMORY], deviation });
    let mut noises: Noises = [rough, rough];
    noises[1][0].deviation = f64::INFINITY;
    let mut first: Vec<Segment> = segments.iter().step_by(3).cloned().collect();
    // Five descents, of which most end early.
    let stage = |descent: usize| {
        move |step: usize| watch.stage("fit of the drive", (descent as f64 + step as f64 / STEPS as f64) / 5.0)
    };
    descend(&mut coordinates, &mut first, &setting, &noises, STEPS, &stage(0))?;
    setting.ripple_order = ripple_order(&coordinates, &first, &setting);
    learn_noise(&mut noises, &coordinates, &first, &setting, 0);
    descend(&mut coordinates, &mut first, &setting, &noises, STEPS, &stage(1))?;
    // Then all of them, twice under the noise that is left.
    learn_noise(&mut noises, &coordinates, &first, &setting, 0);
    descend(&mut coordinates, &mut segments, &setting, &noises, STEPS, &stage(2))?;
    for round in [3, 4] {
        learn_noise(&mut noises, &coordinates, &segments, &setting, MEMORY);
        descend(&mut coordinates, &mut segments, &setting, &noises, STEPS, &stage(round))?;
    }
    let uncertainty = Uncertainty::of(&blocks(&coordinates, &segments, &setting, &noises));
    Ok(Solution { coordinates, uncertainty, segments, setting })
}

/// Moves the segments' own numbers to where they are best.
fn settle(segments: &mut [Segment], blocks: &[Block]) {
    for (segment, block) in segments.iter_mut().zip(blocks) {
        block.move_own(&Vector::zeros(), &mut segment.own);
    }
}

/// Levenberg and Marquardt, in the parameters; the segments' own numbers, which are linear, follow exactly.
fn descend(
    coordinates: &mut [f64; PARAMETERS],
    segments: &mut [Segment],
    setting: &Setting,
    noises: &Noises,
    steps: usize,
    tell: &dyn Fn(usize) -> Result<(), Error>,
) -> Result<(), Error> {
    // The own numbers first, at the parameters of the start.
    settle(segments, &blocks(coordinates, segments, setting, noises));
    let mut now = blocks(coordinates, segments, setting, noises);
    let mut damping = 1e-3;
    for step in 0..steps {
        tell(step)?;
        let cost: f64 = now.iter().map(Block::cost).sum();
        let wanted = solve(&joined(&now), damping);
        // All of it or a part of all: parameters that hold each other must not part.
        let tied = (0..PARAMETERS).filter(|i| SOUGHT[*i].scale == 0.0 && !Index::is_loose(*i));
        let longest = tied.map(|i| wanted[i].abs()).fold(0.0, f64::max);
        let mut taken = wanted * (LONGEST / longest.max(LONGEST));
        (0..PARAMETERS).filter(|i| Index::is_loose(*i)).for_each(|i| taken[i] = taken[i].clamp(-LONGEST, LONGEST));
        let next: [f64; PARAMETERS] = std::array::from_fn(|i| coordinates[i] + taken[i]);
        let mut trial = segments.to_vec();
        for (segment, block) in trial.iter_mut().zip(&now) {
            block.move_own(&taken, &mut segment.own);
        }
        let candidate = blocks(&next, &trial, setting, noises);
        let reached: f64 = candidate.iter().map(Block::cost).sum();
        if reached <= cost * (1.0 + 1e-10) {
            *coordinates = next;
            segments.clone_from_slice(&trial);
            settle(segments, &candidate);
            now = blocks(coordinates, segments, setting, noises);
            damping *= 0.1;
            // A fall of less than 1e-3 of a standard deviation's worth moves nothing that matters.
            if cost - reached < 1e-3 {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    Ok(())
}
