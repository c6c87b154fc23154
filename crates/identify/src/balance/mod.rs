//! The balance of forces with the delay between command and position.
//!
//! ```text
//! F(t) = M·q̈(t + τ) + F_v·q̇(t + τ) ± F_c + μ·|F(t)|·sign q̇ + Σ waves over position
//! ```
//!
//! The delay τ enters by the derivative of the right side (Gauss-Newton), so that its uncertainty is part of the
//! covariance of all others. Only rows on which the axis moves count. Where the set-point was recorded, its motion
//! provides instruments (Janot, Vandanjon, Gautier 2014): noise of the position, and disturbances that the controller
//! feeds back, then do not bias the result. Without a set-point the motion shortly before does, which is free of the
//! present noise.

mod delay;
mod moving;
mod track;

use std::ops::Range;

pub use delay::Delay;
pub(crate) use track::{Instant, Track};

use super::motion::{Motion, norm};
use crate::machine::{Machine, Recipe, Signals};
use stickslip_base::Error;
use stickslip_base::filter::LowPass;
use stickslip_fit::{LinearFit, fit_instrumented};

/// Delay of a command that is held over its sampling period, in samples: half of it.
pub(crate) const HELD: f64 = 0.5;
/// Error of the delay beside its random one [samples], with instruments from the set-point and from the past: of the
/// interpolation between samples, and of noise. Chosen by simulation, see `docs/studies/intervals.md`.
const DELAY_FLOOR: [f64; 2] = [0.01, 0.05];
/// Factor of all intervals: residuals are not stationary, and instruments are not perfect. Chosen by simulation, see
/// `docs/studies/intervals.md`.
const ENLARGED: f64 = 1.15;
/// Step of the numerical derivative by the delay [samples].
const STEP: f64 = 0.25;

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
    is_past: bool,
    moving: Vec<bool>,
    /// Samples from one row to the next: two rows for a period of the low-pass's cut-off.
    stride: usize,
    pub(crate) recipe: Recipe,
}

/// Frictions of the directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Directions {
    /// One for both, and an offset.
    Both,
    /// One for each.
    Each,
    /// Motion in one direction only: +1 or −1.
    Only(i8),
}

/// Right side of the balance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Terms {
    pub(crate) directions: Directions,
    /// Friction in proportion to the drive force.
    pub(crate) load: bool,
    /// Periodic forces over position.
    pub(crate) waves: Vec<Wave>,
    /// Delay in samples: estimated from a start, or held.
    pub(crate) delay: f64,
    pub(crate) estimates_delay: bool,
}

/// A sine and a cosine over position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wave {
    /// Angular spatial frequency [rad/m, or 1].
    pub(crate) number: f64,
    /// Cut-off of the low-pass [rad/s]; at speed the wave is a fast oscillation in time.
    pub(crate) cutoff: f64,
    /// Order of the low-pass.
    pub(crate) order: i32,
}

impl Wave {
    /// Sine and cosine as they pass the low-pass, which runs both ways.
    pub(crate) fn columns(&self, at: Instant) -> [f64; 2] {
        let share = (self.number * at.velocity / self.cutoff).powi(2).powi(self.order);
        let angle = self.number * at.position;
        [libm::sin(angle), libm::cos(angle)].map(|value| value / (1.0 + share))
    }
}

/// A solved balance.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Solved {
    pub(crate) terms: Terms,
    /// The coefficients; the delay, where estimated, is the last, in samples.
    pub(crate) fit: LinearFit,
    /// Delay in samples.
    pub(crate) delay: f64,
    /// Samples of the rows.
    pub(crate) rows: Vec<usize>,
}

impl Terms {
    pub(crate) fn of(directions: Directions, delay: f64, estimates_delay: bool) -> Self {
        Terms { directions, load: false, waves: Vec::new(), delay, estimates_delay }
    }

    /// Number of coefficients of mass, friction and offset.
    pub(crate) fn body(&self) -> usize {
        match self.directions {
            Directions::Both => 4,
            Directions::Each => 5,
            Directions::Only(_) => 3,
        }
    }

    fn count(&self) -> usize {
        self.body() + usize::from(self.load) + 2 * self.waves.len()
    }

    /// Regressors at an instant under a drive force.
    fn columns(&self, at: Instant, force: f64, columns: &mut Vec<f64>) {
        let Instant { velocity, acceleration, .. } = at;
        let sign = if velocity < 0.0 { -1.0 } else { 1.0 };
        columns.push(acceleration);
        match self.directions {
            Directions::Both => columns.extend([velocity, sign, 1.0]),
            Directions::Each => {
                let forward = f64::from(velocity > 0.0);
                columns.extend([forward * velocity, forward, (1.0 - forward) * velocity, forward - 1.0]);
            }
            Directions::Only(_) => columns.extend([velocity, sign]),
        }
        if self.load {
            columns.push(force.abs() * sign);
        }
        for wave in &self.waves {
            columns.extend(wave.columns(at));
        }
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
        let caused = match &signals.reference {
            Some(reference) => track.caused(reference, &low_pass, motion.period)?,
            None => None,
        };
        let is_past = caused.is_none();
        let caused = caused.or_else(|| track.past(recipe.low_pass, motion.period));
        let moving = moving::moving(&track, &signals.position, recipe.low_pass, motion.period);
        let stride = ((0.5 / (recipe.low_pass * motion.period)) as usize).clamp(1, recipe.decimation.max(1));
        Ok(Balance { motion, track, force, caused, is_past, moving, stride, recipe })
    }

    /// Samples of a range whose row counts with this delay, and, for one direction only, whose motion has its sign.
    fn rows(&self, range: &Range<usize>, terms: &Terms) -> Vec<usize> {
        let late = terms.delay.round() as isize;
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

    /// Directions in which the axis moves for at least a twentieth of the rows.
    pub(crate) fn directions(&self, delay: f64) -> Directions {
        let rows = |only| self.rows(&self.whole(), &Terms::of(Directions::Only(only), delay, false)).len();
        let (forward, backward) = (rows(1), rows(-1));
        match (forward * 20 < backward, backward * 20 < forward) {
            (true, _) => Directions::Only(-1),
            (_, true) => Directions::Only(1),
            _ => Directions::Each,
        }
    }

    /// Solves the balance over a range of samples.
    ///
    /// # Errors
    /// Too few rows, or a motion that does not determine the coefficients.
    pub(crate) fn solve(&self, terms: &Terms, range: &Range<usize>) -> Result<Solved, Error> {
        let solved = self.iterate(terms, range, false);
        // The slope by the delay is a change of acceleration: where the past does not show it, the present one is taken,
        // at the price of a small bias by noise.
        if solved.is_err() && self.is_past && terms.estimates_delay { self.iterate(terms, range, true) } else { solved }
    }

    /// The iteration of [`solve`](Self::solve); `present`: the delay has the present motion for its instrument.
    fn iterate(&self, terms: &Terms, range: &Range<usize>, present: bool) -> Result<Solved, Error> {
        const ITERATIONS: usize = 12;
        let mut terms = terms.clone();
        let mut coefficients: Option<Vec<f64>> = None;
        let mut solved = None;
        // Other rows for each small change of the delay would keep the iteration from settling.
        let (mut chosen_at, mut rows) = (terms.delay, self.rows(range, &terms));
        for _ in 0..ITERATIONS {
            if (terms.delay - chosen_at).abs() > 2.0 {
                (chosen_at, rows) = (terms.delay, self.rows(range, &terms));
            }
            let fit = self.step(&terms, &rows, coefficients.as_deref(), present)?;
            let count = terms.count();
            let known = coefficients.replace(fit.coefficients[..count].to_vec());
            let change = if terms.estimates_delay && known.is_some() { fit.coefficients[count] } else { 0.0 };
            // Far from the solution the derivative is good for some samples only.
            terms.delay += change.clamp(-5.0, 5.0);
            let settled = known.is_some() && change.abs() < 1e-4;
            solved = Some(fit);
            if settled {
                break;
            }
        }
        let mut fit = solved.expect("there is an iteration");
        enlarge(&mut fit);
        if terms.estimates_delay {
            let change = fit.coefficients[terms.count()];
            if change.is_nan() || change.abs() > 1.0 {
                return Err(stickslip_fit::FitError::Dependent { smallest: 0.0 }.into());
            }
            // The last column is the change of the delay.
            let last = terms.count();
            let floor = if self.is_past { DELAY_FLOOR[1] } else { DELAY_FLOOR[0] };
            widen(&mut fit, last, floor);
            let to_delay = terms.delay - fit.coefficients[last];
            fit.coefficients[last] += to_delay;
            fit.ci95[last].iter_mut().for_each(|bound| *bound += to_delay);
        }
        Ok(Solved { delay: terms.delay, fit, rows, terms })
    }

    /// One step of Gauss-Newton; without coefficients of the step before, the delay is held.
    fn step(&self, terms: &Terms, rows: &[usize], before: Option<&[f64]>, present: bool) -> Result<LinearFit, Error> {
        let count = terms.count();
        let total = count + usize::from(terms.estimates_delay && before.is_some());
        let (mut columns, mut instruments) = (vec![Vec::with_capacity(rows.len()); total], vec![Vec::new(); total]);
        let mut measured = Vec::with_capacity(rows.len());
        let (mut now, mut ahead, mut behind) = (Vec::new(), Vec::new(), Vec::new());
        for &row in rows {
            let force = self.force[row];
            let at = row as f64 + terms.delay;
            let mut fill = |track: &Track, force: f64, into: &mut [Vec<f64>]| {
                [&mut now, &mut ahead, &mut behind].into_iter().for_each(Vec::clear);
                let force = force + self.motion.offset;
                terms.columns(track.at(at), force, &mut now);
                into.iter_mut().zip(&now).for_each(|(column, value)| column.push(*value));
                if let Some(before) = before.filter(|_| total > count) {
                    terms.columns(track.at(at + STEP), force, &mut ahead);
                    terms.columns(track.at(at - STEP), force, &mut behind);
                    let slope = (0..count).map(|k| before[k] * (ahead[k] - behind[k])).sum::<f64>() / (2.0 * STEP);
                    into[count].push(slope);
                }
            };
            fill(&self.track, force, &mut columns);
            if let Some(caused) = &self.caused {
                // The force that the caused motion requires: the recorded one contains the disturbances.
                let required = before.map_or(force, |before| {
                    let mut body = Vec::new();
                    terms.columns(caused.at(at), force, &mut body);
                    before[..terms.body()].iter().zip(&body).map(|(b, c)| b * c).sum()
                });
                fill(caused, required, &mut instruments);
                if present && total > count {
                    instruments[count].pop();
                    instruments[count].extend(columns[count].last());
                }
            }
            measured.push(force);
        }
        let instruments = if self.caused.is_some() { &instruments } else { &columns };
        let Some(inertia) = self.motion.inertia else { return fit_instrumented(&columns, instruments, &measured) };
        let rest: Vec<f64> = measured.iter().zip(&columns[0]).map(|(f, a)| f - inertia * a).collect();
        let mut fit = fit_instrumented(&columns[1..], &instruments[1..], &rest)?;
        fit.with_known_first(inertia);
        fit.relative_error *= norm(&rest) / norm(&measured);
        Ok(fit)
    }

    /// Errors of a solved balance in the rows of a range.
    pub(crate) fn misses(&self, solved: &Solved, range: &Range<usize>) -> (Vec<usize>, Vec<f64>) {
        let rows = self.rows(range, &solved.terms);
        let missed = rows.iter().map(|&row| self.force[row] - self.predicted(solved, row)).collect();
        (rows, missed)
    }

    /// Force of a solved balance at a sample.
    pub(crate) fn predicted(&self, solved: &Solved, row: usize) -> f64 {
        let mut columns = Vec::new();
        let at = self.track.at(row as f64 + solved.delay);
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
        let late = if solved.terms.estimates_delay { solved.delay } else { 0.0 };
        motion.force = track::delayed(&self.motion.force, late);
        motion.smooth_force = track::delayed(&self.motion.smooth_force, late);
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

/// Enlarges all intervals by the factor that simulated axes require.
fn enlarge(fit: &mut LinearFit) {
    fit.covariance.iter_mut().flatten().for_each(|value| *value *= ENLARGED * ENLARGED);
    fit.standard_errors.iter_mut().for_each(|error| *error *= ENLARGED);
    for (ci95, value) in fit.ci95.iter_mut().zip(&fit.coefficients) {
        *ci95 = ci95.map(|bound| value + ENLARGED * (bound - value));
    }
}

/// Adds an error of one coefficient, given as half of a 95 % interval, to all: the others follow it as their covariance
/// states.
fn widen(fit: &mut LinearFit, index: usize, half_width: f64) {
    let count = fit.coefficients.len();
    let critical = |fit: &LinearFit, i: usize| 0.5 * (fit.ci95[i][1] - fit.ci95[i][0]) / fit.standard_errors[i];
    let (factors, variance): (Vec<f64>, f64) =
        ((0..count).map(|i| critical(fit, i)).collect(), fit.covariance[index][index]);
    let error = half_width / factors[index];
    let follows: Vec<f64> = (0..count).map(|i| fit.covariance[i][index] / variance * error).collect();
    if follows.iter().chain(&factors).any(|value| !value.is_finite()) {
        return;
    }
    for i in 0..count {
        for j in 0..count {
            fit.covariance[i][j] += follows[i] * follows[j];
        }
        fit.standard_errors[i] = fit.covariance[i][i].sqrt();
        let wide = factors[i] * fit.standard_errors[i];
        fit.ci95[i] = [fit.coefficients[i] - wide, fit.coefficients[i] + wide];
    }
}
