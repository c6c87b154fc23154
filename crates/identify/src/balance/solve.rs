//! Gauss-Newton iteration of the balance of forces, by instrumental variables.

use std::ops::Range;

use super::intervals::{add, enlarge, widen};
use super::terms::{Estimates, Terms, Timing};
use super::track::Track;
use super::{Balance, Solved, lag};
use crate::motion::norm;
use stickslip_base::Error;
use stickslip_fit::{Instrumented, LinearFit};

/// Error of the delay beside its random one [samples], with instruments from known signals and from the past: of the
/// interpolation between samples, and of noise. Chosen by simulation, see `docs/studies/intervals.md`.
const DELAY_FLOOR: [f64; 2] = [0.01, 0.5];
/// Error of the delay [samples] by disturbances that the controller feeds back, without instruments from known signals.
/// Chosen by simulation as well.
const FED_BACK: f64 = 1.5;
/// Factor of all intervals, with instruments from known signals and from the past: residuals are not stationary, and
/// instruments are not perfect. Chosen by simulation, see `docs/studies/intervals.md`.
const ENLARGED: [f64; 2] = [1.15, 2.3];
/// Further factor with friction by load: the drive force is both a column and the measured value. Chosen by simulation as
/// well.
const LOAD: f64 = 1.25;
/// Error of the delay by the approximation of the waves, in units of its random one. Chosen by simulation, see
/// `docs/studies/intervals.md`.
const WAVES: f64 = 1.7;
/// Step of the numerical derivative by the delay [samples].
const STEP: f64 = 0.25;

/// A step of Gauss-Newton.
struct Step {
    solved: Instrumented,
    /// A known inertia, and the share of the force that the other terms explain.
    known: Option<(f64, f64)>,
}

impl Step {
    fn coefficients(&self) -> Vec<f64> {
        let inertia = self.known.iter().map(|(inertia, _)| *inertia);
        inertia.chain(self.solved.coefficients().iter().copied()).collect()
    }

    fn relative_error(&self) -> f64 {
        self.solved.relative_error() * self.known.map_or(1.0, |(_, share)| share)
    }

    fn fit(&self) -> LinearFit {
        let mut fit = self.solved.fit();
        if let Some((inertia, share)) = self.known {
            fit.with_known_first(inertia);
            fit.relative_error *= share;
        }
        fit
    }
}

impl Balance<'_> {
    /// Solves the balance over a range of samples.
    ///
    /// # Errors
    /// Too few rows, or a motion that does not determine the coefficients.
    pub(crate) fn solve(&self, terms: &Terms, range: &Range<usize>) -> Result<Solved, Error> {
        // The slope by the delay is a change of acceleration, which the past hardly shows: the present one is taken, at the
        // price of a small bias by noise.
        if self.is_past && terms.timing.count() > 0 {
            let present = self.iterate(terms, range, true).ok().filter(|solved| self.determines(solved));
            if let Some(present) = present {
                return Ok(present);
            }
        }
        self.iterate(terms, range, false)
    }

    /// A solved balance; where the motion does not determine the delay, with intervals that include one sampling period
    /// more or less.
    pub(crate) fn for_any_sample(&self, solved: &Solved) -> Solved {
        let mut wide = solved.clone();
        let Timing { delay, estimates: Estimates::Nothing, .. } = solved.terms.timing else { return wide };
        for other in [delay - 1.0, delay + 1.0] {
            let Ok(shifted) = self.solve(&solved.terms.with(Timing::held(other)), &self.whole()) else { continue };
            for (k, value) in shifted.fit.coefficients.iter().enumerate() {
                // By half of the change on both sides of the interval for each of the two.
                let change = 0.5 * (value - solved.fit.coefficients[k]).abs();
                add(&mut wide.fit, k, change);
            }
        }
        wide
    }

    /// ‖residuals‖ / ‖measured‖ of the balance over a range of samples, with held timing.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub(crate) fn relative_error(&self, terms: &Terms, range: &Range<usize>) -> Result<f64, Error> {
        Ok(self.settle(terms.with(terms.timing.fixed()), range, false)?.0.relative_error())
    }

    /// The iteration to its end, with the errors of its last step; see [`settle`](Self::settle).
    fn iterate(&self, terms: &Terms, range: &Range<usize>, present: bool) -> Result<Solved, Error> {
        let count = terms.count();
        let (step, terms, rows) = self.settle(terms.clone(), range, present)?;
        let mut fit = step.fit();
        enlarge(&mut fit, ENLARGED[usize::from(self.is_past)] * if terms.load { LOAD } else { 1.0 });
        let values = [terms.timing.total(), 0.5 * terms.timing.lag.powi(2)];
        for (k, value) in values.into_iter().enumerate().take(terms.timing.count()) {
            let change = fit.coefficients[count + k];
            if change.is_nan() || change.abs() > 1.0 {
                return Err(stickslip_fit::FitError::Dependent { smallest: 0.0 }.into());
            }
            // The last columns are changes.
            let to_value = value - fit.coefficients[count + k];
            fit.coefficients[count + k] += to_value;
            fit.ci95[count + k].iter_mut().for_each(|bound| *bound += to_value);
        }
        if terms.timing.count() > 0 {
            // A wave passes the low-pass as stated at a constant speed only.
            let own = 0.5 * (fit.ci95[count][1] - fit.ci95[count][0]);
            let floor = DELAY_FLOOR[usize::from(self.is_past)];
            widen(&mut fit, count, if terms.waves.is_empty() { floor } else { floor.hypot(WAVES * own) });
            if self.is_past {
                add(&mut fit, count, FED_BACK);
            }
        }
        Ok(Solved { fit, rows, terms })
    }

    /// The last step of the iteration, its terms and its rows. `present`: the delay has the present motion for its
    /// instrument.
    fn settle(
        &self,
        mut terms: Terms,
        range: &Range<usize>,
        present: bool,
    ) -> Result<(Step, Terms, Vec<usize>), Error> {
        const ITERATIONS: usize = 25;
        let count = terms.count();
        // Without timing and load nothing depends on the coefficients.
        let is_linear = terms.timing.count() == 0 && !terms.load;
        let mut coefficients: Option<Vec<f64>> = None;
        let mut solved = None;
        let (mut damping, mut swing) = (1.0, 0.0);
        // Other rows for each small change of the delay would keep the iteration from settling.
        let (mut chosen_at, mut rows) = (terms.timing.delay, self.rows(range, &terms));
        for _ in 0..ITERATIONS {
            if (terms.timing.delay - chosen_at).abs() > 2.0 {
                (chosen_at, rows) = (terms.timing.delay, self.rows(range, &terms));
            }
            let step = self.step(&terms, &rows, coefficients.as_deref(), present)?;
            let values = step.coefficients();
            let is_first = coefficients.replace(values[..count].to_vec()).is_none();
            let change = |k: usize| if is_first { 0.0 } else { values.get(count + k).copied().unwrap_or(0.0) };
            let settled =
                !is_first && change(0).abs() < 1e-4 && change(1).abs() < 1e-4 * (1.0 + terms.timing.lag.powi(2));
            // Far from the solution the derivative is good for some samples only, and steps that swing are too long.
            if change(0) * swing < -0.25 * swing * swing {
                damping *= 0.5;
            }
            swing = change(0);
            let advance = |k: usize| damping * change(k).clamp(-5.0, 5.0);
            terms.timing.advance(advance(0), advance(1));
            solved = Some(step);
            if settled || is_linear {
                break;
            }
        }
        Ok((solved.expect("there is an iteration"), terms, rows))
    }

    /// One step of Gauss-Newton; without coefficients of the step before, delay and lag are held.
    fn step(&self, terms: &Terms, rows: &[usize], before: Option<&[f64]>, present: bool) -> Result<Step, Error> {
        let count = terms.count();
        let extra = if before.is_some() { terms.timing.count() } else { 0 };
        let (mut columns, mut instruments) =
            (vec![Vec::with_capacity(rows.len()); count + extra], vec![Vec::new(); count + extra]);
        let mut measured = Vec::with_capacity(rows.len());
        let forces = self.forces(terms.timing);
        let lags = before.filter(|_| extra > 1).map(|before| self.lag_slopes(terms, &forces, before));
        let (mut now, mut ahead, mut behind) = (Vec::new(), Vec::new(), Vec::new());
        for &row in rows {
            let force = forces[row];
            let at = row as f64 + terms.timing.delay;
            let mut fill = |track: &Track, force: f64, into: &mut [Vec<f64>]| {
                [&mut now, &mut ahead, &mut behind].into_iter().for_each(Vec::clear);
                let force = force + self.motion.offset;
                terms.columns(track.at(at), force, &mut now);
                into.iter_mut().zip(&now).for_each(|(column, value)| column.push(*value));
                if let Some(before) = before.filter(|_| extra > 0) {
                    terms.columns(track.at(at + STEP), force, &mut ahead);
                    terms.columns(track.at(at - STEP), force, &mut behind);
                    let slope = (0..count).map(|k| before[k] * (ahead[k] - behind[k])).sum::<f64>() / (2.0 * STEP);
                    into[count].push(slope);
                }
            };
            fill(&self.track, force, &mut columns);
            if let Some(caused) = &self.caused {
                let required = before.filter(|_| terms.load).map(|before| self.required(terms, before, row));
                fill(caused, required.unwrap_or(force), &mut instruments);
                if present && extra > 0 {
                    instruments[count].pop();
                    instruments[count].extend(columns[count].last());
                }
            }
            if let Some([slopes, caused]) = &lags {
                columns[count + 1].push(slopes[row]);
                instruments[count + 1].push(if present { slopes[row] } else { caused[row] });
            }
            measured.push(force);
        }
        let instruments = if self.caused.is_some() { &instruments } else { &columns };
        let Some(inertia) = self.motion.inertia else {
            return Ok(Step { solved: Instrumented::solve(&columns, instruments, &measured)?, known: None });
        };
        let rest: Vec<f64> = measured.iter().zip(&columns[0]).map(|(f, a)| f - inertia * a).collect();
        let solved = Instrumented::solve(&columns[1..], &instruments[1..], &rest)?;
        Ok(Step { solved, known: Some((inertia, norm(&rest) / norm(&measured))) })
    }

    /// The force that the caused motion requires at a sample: the recorded one contains the disturbances.
    fn required(&self, terms: &Terms, coefficients: &[f64], sample: usize) -> f64 {
        let Some(caused) = &self.caused else { return self.force[sample] };
        let mut body = Vec::new();
        terms.columns(caused.at(sample as f64 + terms.timing.delay), 0.0, &mut body);
        coefficients[..terms.body()].iter().zip(&body).map(|(b, c)| b * c).sum()
    }

    /// Derivatives of the balance by half of the square of the lag: of the recorded motion, and of the caused one.
    fn lag_slopes(&self, terms: &Terms, forces: &[f64], before: &[f64]) -> [Vec<f64>; 2] {
        let caused: Vec<f64> = (0..forces.len()).map(|i| self.required(terms, before, i)).collect();
        [lag::slope(forces, terms.timing.lag), lag::slope(&caused, terms.timing.lag)]
    }
}
