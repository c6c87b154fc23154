//! Output-error fit of the linear response over segments, each with its own initial state.
//!
//! The converter voltages are known exactly, and nothing else drives the machine: the prediction is a simulation, and
//! its errors are those of the instruments. Segments keep model errors from accumulating: each has its own initial
//! state and its own friction level, which are eliminated from the normal equations (Golub & Pereyra 1973). The
//! residuals of each channel are whitened by an autoregression of the channel.

use stickslip_core::drive::LONGEST_DELAY;
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
/// Longest step, in logarithms: beyond it the linear model is invalid.
const LONGEST: f64 = 0.7;
/// Sum of squares of a disturbed segment over the first quartile of all.
const DISTURBED: f64 = 25.0;

/// Result of the fit.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// Parameters, in the search's coordinates.
    pub(super) coordinates: [f64; PARAMETERS],
    /// Their uncertainty.
    pub(super) uncertainty: Uncertainty,
    /// The segments, each with its own numbers.
    pub(super) segments: Vec<Segment>,
    /// Number of segments that were left out.
    pub(super) disturbed: usize,
    /// Settings, with the identified ripple.
    pub(super) setting: Setting,
}

impl Solution {
    /// Uncertainty of a number with these slopes over the coordinates.
    pub(super) fn known(&self, number: &Dual<PARAMETERS>) -> Known {
        self.uncertainty.of_number(&Vector::from(number.gradient))
    }
}

/// Searches the parameters from a start.
pub(super) fn fit(
    start: [f64; PARAMETERS],
    mut segments: Vec<Segment>,
    mut setting: Setting,
    rough: [f64; CHANNELS],
    watch: &Watch,
) -> Result<Solution, Error> {
    let mut coordinates = start;
    // At first every channel gets a large noise, so that none dominates before the model is near; a third of the data
    // suffices.
    let rough = rough.map(|deviation| Noise { memory: [0.0; MEMORY], deviation });
    let mut noises: Noises = [rough, rough];
    noises[1][0].deviation = f64::INFINITY;
    let mut first: Vec<Segment> = segments.iter().step_by(3).cloned().collect();
    // Five descents, most of which end early.
    let stage = |descent: usize| {
        move |step: usize| watch.stage("fit of the drive", (descent as f64 + step as f64 / STEPS as f64) / 5.0)
    };
    if setting.amplifiers.are_late {
        search_delays(&mut coordinates, &first, &setting, &noises, watch)?;
    }
    descend(&mut coordinates, &mut first, &setting, &noises, STEPS, &stage(0))?;
    if setting.has_instruments {
        setting.ripple_order = ripple_order(&coordinates, &first, &setting);
    }
    learn_noise(&mut noises, &coordinates, &first, &setting, 0);
    descend(&mut coordinates, &mut first, &setting, &noises, STEPS, &stage(1))?;
    // Then all data, twice, under the noise of the residuals.
    learn_noise(&mut noises, &coordinates, &first, &setting, 0);
    descend(&mut coordinates, &mut segments, &setting, &noises, STEPS, &stage(2))?;
    let recorded = segments.len();
    let reached = blocks(&coordinates, &segments, &setting, &noises);
    drop_disturbed(&mut segments, &reached);
    for round in [3, 4] {
        learn_noise(&mut noises, &coordinates, &segments, &setting, MEMORY);
        descend(&mut coordinates, &mut segments, &setting, &noises, STEPS, &stage(round))?;
    }
    let uncertainty = Uncertainty::of(&blocks(&coordinates, &segments, &setting, &noises));
    let disturbed = recorded - segments.len();
    Ok(Solution { coordinates, uncertainty, segments, disturbed, setting })
}

/// Leaves out the segments that deviate far more than the best quarter of their kind: ticks that came late, or a
/// disturbance.
fn drop_disturbed(segments: &mut Vec<Segment>, blocks: &[Block]) {
    let costs: Vec<f64> = blocks.iter().map(Block::cost).collect();
    let quartile = |is_stuck: bool| {
        let alike = segments.iter().zip(&costs).filter(|(segment, _)| segment.is_stuck() == is_stuck);
        let mut costs: Vec<f64> = alike.map(|(_, cost)| *cost).collect();
        costs.sort_by(f64::total_cmp);
        costs.get(costs.len() / 4).copied().unwrap_or(f64::INFINITY)
    };
    let limits = [false, true].map(|is_stuck| DISTURBED * quartile(is_stuck));
    let mut costs = costs.into_iter();
    segments.retain(|segment| costs.next().is_some_and(|cost| cost <= limits[usize::from(segment.is_stuck())]));
}

/// Moves both delays to the whole ticks with the least cost, that of the load amplifier first: its current shows it without
/// the drive. A descent from a start that is two periods of the excitation off ends in another minimum.
fn search_delays(
    coordinates: &mut [f64; PARAMETERS],
    segments: &[Segment],
    setting: &Setting,
    noises: &Noises,
    watch: &Watch,
) -> Result<(), Error> {
    for index in [Index::LoadDelay, Index::ServoDelay].map(|index| index as usize) {
        let mut best = (f64::INFINITY, coordinates[index]);
        for ticks in 0..=LONGEST_DELAY {
            watch.stage("search for the delays of the drives", ticks as f64 / LONGEST_DELAY as f64)?;
            coordinates[index] = ticks as f64 * setting.dt / SOUGHT[index].scale;
            let cost: f64 = blocks(coordinates, segments, setting, noises).iter().map(Block::cost).sum();
            if cost < best.0 {
                best = (cost, coordinates[index]);
            }
        }
        coordinates[index] = best.1;
    }
    Ok(())
}

/// Moves the segments' own numbers to their optimum.
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
    progress: &dyn Fn(usize) -> Result<(), Error>,
) -> Result<(), Error> {
    // The segments' own numbers first, at the start parameters.
    settle(segments, &blocks(coordinates, segments, setting, noises));
    let mut now = blocks(coordinates, segments, setting, noises);
    let mut damping = 1e-3;
    for step in 0..steps {
        progress(step)?;
        let cost: f64 = now.iter().map(Block::cost).sum();
        let full_step = solve(&joined(&now), damping);
        // The step is shortened as a whole: tied parameters keep their ratios.
        let tied = (0..PARAMETERS).filter(|i| SOUGHT[*i].scale == 0.0 && !Index::is_loose(*i));
        let longest = tied.map(|i| full_step[i].abs()).fold(0.0, f64::max);
        let mut limited = full_step * (LONGEST / longest.max(LONGEST));
        (0..PARAMETERS).filter(|i| Index::is_loose(*i)).for_each(|i| limited[i] = limited[i].clamp(-LONGEST, LONGEST));
        let next: [f64; PARAMETERS] = std::array::from_fn(|i| coordinates[i] + limited[i]);
        let mut trial = segments.to_vec();
        for (segment, block) in trial.iter_mut().zip(&now) {
            block.move_own(&limited, &mut segment.own);
        }
        let candidate = blocks(&next, &trial, setting, noises);
        let reached: f64 = candidate.iter().map(Block::cost).sum();
        if reached <= cost * (1.0 + 1e-10) {
            *coordinates = next;
            segments.clone_from_slice(&trial);
            settle(segments, &candidate);
            now = blocks(coordinates, segments, setting, noises);
            damping *= 0.1;
            // A decrease below 1e-3 (in variances) changes no parameter noticeably.
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
