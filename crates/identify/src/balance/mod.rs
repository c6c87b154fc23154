//! The balance of forces with the delay between command and position.
//!
//! ```text
//! F(t) = M·q̈(t + τ) + F_v·q̇(t + τ) ± F_c + μ·|F(t)|·sign q̇ + Σ waves over position
//! ```
//!
//! The delay τ enters by the derivative of the right side (Gauss-Newton), so that its uncertainty is part of the
//! covariance of all others. Only rows on which the axis moves count. Where the set-point or an injected force was
//! recorded, the motion that they cause provides instruments (Janot, Vandanjon, Gautier 2014): noise of the position, and
//! disturbances that the controller feeds back, then do not bias the result. Otherwise the motion shortly before does,
//! which is free of the present noise.

mod delay;
mod intervals;
mod lag;
mod moving;
mod solve;
mod terms;
mod track;

use std::borrow::Cow;
use std::ops::Range;

pub use delay::Delay;
pub(crate) use intervals::add;
pub(crate) use terms::{Directions, TURN, Terms, Timing, Wave};
pub(crate) use track::Track;

use super::motion::Motion;
use crate::machine::{Axis, Machine, Recipe, Signals};
use stickslip_base::Error;
use stickslip_base::filter::LowPass;
use stickslip_fit::LinearFit;
use terms::Estimates;

/// Delay of a command that is held over its sampling period, in samples: half of it.
pub(crate) const HELD: f64 = 0.5;
/// A recording prepared for the balance of forces.
#[derive(Clone, Debug)]
pub(crate) struct Balance<'a> {
    pub(crate) motion: &'a Motion,
    pub(crate) track: Track,
    /// The smooth force as the axis feels it, held over each period.
    pub(crate) force: Vec<f64>,
    /// The motion of the instruments.
    caused: Option<Track>,
    /// Whether it is the motion shortly before.
    pub(crate) is_past: bool,
    moving: Vec<bool>,
    /// Samples from one row to the next: two rows for a period of the low-pass's cut-off.
    stride: usize,
    pub(crate) recipe: Recipe,
    pub(crate) axis: Axis,
}

/// A solved balance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Solved {
    pub(crate) terms: Terms,
    /// The coefficients; where estimated, delay and lag together [samples] and half of the square of the lag [samples²]
    /// are the last.
    pub(crate) fit: LinearFit,
    /// Samples of the rows.
    pub(crate) rows: Vec<usize>,
}

impl Solved {
    /// Amplitude of a wave, with its 95 % interval.
    pub(crate) fn amplitude(&self, place: usize) -> Option<(f64, [f64; 2])> {
        let (fit, index) = (&self.fit, self.terms.wave(place));
        let (sine, cosine) = (*fit.coefficients.get(index)?, *fit.coefficients.get(index + 1)?);
        let amplitude = sine.hypot(cosine);
        let critical = 0.5 * (fit.ci95[index][1] - fit.ci95[index][0]) / fit.standard_errors[index];
        let mut weights = vec![0.0; fit.coefficients.len()];
        (weights[index], weights[index + 1]) = (sine / amplitude, cosine / amplitude);
        let half_width = critical * fit.variance(&weights).sqrt();
        Some((amplitude, [amplitude - half_width, amplitude + half_width]))
    }
}

impl<'a> Balance<'a> {
    /// # Errors
    /// A recording too short for the low-pass.
    pub(crate) fn of(motion: &'a Motion, signals: &Signals, machine: &Machine) -> Result<Self, Error> {
        let recipe = machine.recipe;
        let low_pass = LowPass::butterworth(recipe.order, recipe.low_pass, 1.0 / motion.period)?;
        let track = Track::of(
            motion.position.clone(),
            signals.velocity.as_ref().map(|_| motion.velocity.clone()),
            motion.period,
        );
        let force = track::held(&motion.smooth_force);
        let known: Vec<&[f64]> =
            [&signals.reference, &signals.injected].into_iter().flatten().map(Vec::as_slice).collect();
        let caused = track.caused(&known, &low_pass, motion.period)?;
        let is_past = caused.is_none();
        let caused = caused.or_else(|| track.past(recipe.low_pass, motion.period));
        let moving = moving::moving(&track, &signals.position, recipe.low_pass, motion.period);
        let stride = ((0.5 / (recipe.low_pass * motion.period)) as usize).clamp(1, recipe.decimation.max(1));
        Ok(Balance { motion, track, force, caused, is_past, moving, stride, recipe, axis: machine.axis })
    }

    /// Samples of a range whose row counts with this delay, and, for one direction only, whose motion has its sign.
    fn rows(&self, range: &Range<usize>, terms: &Terms) -> Vec<usize> {
        let late = terms.timing.delay.round() as isize;
        let samples = self.motion.samples();
        let counts = |i: &usize| {
            let Some(there) = i.checked_add_signed(late).filter(|there| *there >= 3 && *there + 3 < samples) else {
                return false;
            };
            let sign = |sign: i8| f64::from(sign) * self.track.velocity[there] > 0.0;
            self.moving[there] && !matches!(terms.directions, Directions::Only(only) if !sign(only))
        };
        range.clone().step_by(self.stride).filter(counts).collect()
    }

    /// Whether a sample is away from standstill and reversals.
    pub(crate) fn is_moving(&self, sample: usize, solved: &Solved) -> bool {
        !self.rows(&(sample..sample + 1), &solved.terms).is_empty()
    }

    /// The recording without its first samples.
    pub(crate) fn whole(&self) -> Range<usize> {
        self.recipe.skip..self.motion.samples()
    }

    /// Its halves.
    pub(crate) fn halves(&self) -> [Range<usize>; 2] {
        let (whole, middle) = (self.whole(), self.motion.samples() / 2);
        [whole.start..middle, middle..whole.end]
    }

    /// Directions in which the axis moves for at least a twentieth of the rows.
    pub(crate) fn directions(&self, delay: f64) -> Directions {
        let rows = |only| self.rows(&self.whole(), &Terms::of(Directions::Only(only), Timing::held(delay))).len();
        let (forward, backward) = (rows(1), rows(-1));
        match (forward * 20 < backward, backward * 20 < forward) {
            (true, _) => Directions::Only(-1),
            (_, true) => Directions::Only(1),
            _ => Directions::Each,
        }
    }

    /// A wave over position as it passes the low-pass.
    pub(crate) fn wave(&self, number: f64) -> Wave {
        let cutoff = std::f64::consts::TAU * self.recipe.low_pass;
        Wave { number, cutoff, order: self.recipe.order as i32 }
    }

    /// Mass and friction alone, without a delay.
    pub(crate) fn plain(&self) -> Terms {
        Terms::of(self.directions(0.0), Timing::held(HELD))
    }

    /// The force behind the lag of some terms.
    pub(crate) fn forces(&self, timing: Timing) -> Cow<'_, [f64]> {
        if timing.lag > 0.0 { lag::lagging(&self.force, timing.lag).into() } else { (&self.force).into() }
    }

    /// Errors of a solved balance in the rows of a range.
    pub(crate) fn misses(&self, solved: &Solved, range: &Range<usize>) -> (Vec<usize>, Vec<f64>) {
        let rows = self.rows(range, &solved.terms);
        let forces = self.forces(solved.terms.timing);
        let missed = rows.iter().map(|&row| forces[row] - self.predicted(solved, row)).collect();
        (rows, missed)
    }

    /// Force of a solved balance at a sample.
    pub(crate) fn predicted(&self, solved: &Solved, row: usize) -> f64 {
        let mut columns = Vec::new();
        let at = self.track.at(row as f64 + solved.terms.timing.delay);
        solved.terms.columns(at, 0.0, &mut columns);
        let rest: f64 = columns.iter().zip(&solved.fit.coefficients).map(|(c, b)| c * b).sum();
        if !solved.terms.load {
            return rest;
        }
        // F = rest + μ·|F|·sign q̇, solved for F, the whole force.
        let (share, offset) = (solved.fit.coefficients[solved.terms.body()], self.motion.offset);
        let total = rest + offset;
        total / (1.0 - share * (total * at.velocity).signum()) - offset
    }

    /// The motion with its force delayed as the position is.
    pub(crate) fn aligned(&self, solved: &Solved) -> Motion {
        let mut motion = self.motion.clone();
        let Timing { delay, lag, estimates } = solved.terms.timing;
        let late = if estimates == Estimates::Nothing { 0.0 } else { delay };
        let aligned = |force: &[f64]| track::delayed(&lag::lagging(force, lag), late);
        motion.force = aligned(&self.motion.force);
        motion.smooth_force = aligned(&self.motion.smooth_force);
        motion
    }

    /// An aligned motion without the extra forces of a solved balance: what remains is inertia and sliding friction.
    pub(crate) fn sliding(&self, solved: &Solved, aligned: &Motion) -> Motion {
        let mut motion = aligned.clone();
        let mut columns = Vec::new();
        for (i, force) in motion.smooth_force.iter_mut().enumerate() {
            columns.clear();
            solved.terms.columns(self.track.at(i as f64), *force + motion.offset, &mut columns);
            let extra = columns.iter().zip(&solved.fit.coefficients).skip(solved.terms.body());
            *force -= extra.map(|(c, b)| c * b).sum::<f64>();
        }
        motion
    }
}
