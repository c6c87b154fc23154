//! Iterative correction: render, measure, correct the torque over the speed by the missing torque; repeated while the
//! error decreases.
//!
//! The correction is a table over the speed, without a model of the cause. It cannot correct a friction that depends on
//! the direction, nor a law whose sign is wrong by noise.

use std::fmt;

use nalgebra::{DMatrix, DVector};
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{CORRECTION_POINTS, Correction, CorrectionTable};

use super::render::{Rendering, faded_below, render};
use crate::{FrictionCurve, FrictionPlan};
use stickslip_base::{Error, Watch};
use stickslip_bench::Bench;

/// Share of the missing torque that a correction adds; below 1 the iteration is damped.
const GAIN: f64 = 0.8;

/// Torque missing at a speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Missing {
    /// Speed [rad/s].
    pub speed: f64,
    /// Desired minus measured, positive for too little friction [N m].
    pub torque: f64,
    /// Standard error [N m].
    pub standard_error: f64,
}

/// Reason for which the iteration ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// The missing torque is within its measurement error.
    WithinError,
    /// The last correction decreased the error by less than the measurement error.
    NoBetter,
    /// The requested number of corrections was made.
    Enough,
    /// The load slid on fewer than two plateaus, too few for a table.
    TooFew,
    /// The user cancelled.
    Cancelled,
    /// A fault under the last correction, with its reason.
    Fault(String),
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stopped::WithinError => f.write_str("the missing torque is within its measurement error"),
            Stopped::NoBetter => f.write_str("the last correction was no improvement; the one before is active"),
            Stopped::Enough => f.write_str("the requested number of corrections was made"),
            Stopped::TooFew => f.write_str("the load slid on fewer than two plateaus, too few for a table"),
            Stopped::Cancelled => f.write_str("cancelled"),
            Stopped::Fault(reason) => {
                write!(f, "the last correction caused a fault ({reason}); the one before is active")
            }
        }
    }
}

/// One measurement, with its correction.
#[derive(Clone, Debug, PartialEq)]
pub struct Iteration<R> {
    /// Correction added to the law.
    pub correction: Correction<f64>,
    /// RMS of the missing torque [N m].
    pub error: f64,
    /// Standard error of that RMS [N m].
    pub uncertainty: f64,
    /// The measurement.
    pub measured: R,
}

/// A series of measurements and corrections.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrected<R> {
    /// All measurements in their order; the first is without correction.
    pub iterations: Vec<Iteration<R>>,
    /// Index of the best measurement, never worse than the first.
    pub best_index: usize,
    /// Reason of the end.
    pub stopped: Stopped,
}

impl<R> Corrected<R> {
    /// The measurement under the best correction.
    pub fn best(&self) -> &Iteration<R> {
        &self.iterations[self.best_index]
    }
}

/// Measures, corrects by the missing torque, and measures again, at most `corrections` times. The speeds of `table` are
/// those that it may correct.
///
/// # Errors
/// Those of the measurement, except a cancellation or a fault after the first one.
pub fn correct<R>(
    table: CorrectionTable<f64>,
    corrections: usize,
    missing: impl Fn(&R) -> Vec<Missing>,
    mut measure: impl FnMut(Correction<f64>) -> Result<R, Error>,
) -> Result<Corrected<R>, Error> {
    let (mut table, mut correction) =
        (CorrectionTable { torque: [0.0; CORRECTION_POINTS], ..table }, Correction::Nothing);
    let (mut iterations, mut best_index): (Vec<Iteration<R>>, usize) = (Vec::new(), 0);
    let stopped = loop {
        let measured = match measure(correction) {
            Err(Error::Cancelled) if !iterations.is_empty() => break Stopped::Cancelled,
            Err(Error::BenchFault { reason, .. }) if !iterations.is_empty() => break Stopped::Fault(reason),
            ended => ended?,
        };
        let lacking = missing(&measured);
        let [error, uncertainty] = rms(&lacking);
        let last = iterations.len();
        iterations.push(Iteration { correction, error, uncertainty, measured });
        let before = &iterations[best_index];
        // Not `error ≥ …`: NaN must not count as better.
        let better = error < before.error - (uncertainty + before.uncertainty);
        if last > 0 && !better {
            break Stopped::NoBetter;
        }
        best_index = last;
        if lacking.len() < 2 {
            break Stopped::TooFew;
        }
        if within_error(&lacking) {
            break Stopped::WithinError;
        }
        if last == corrections {
            break Stopped::Enough;
        }
        let more = smooth(&table, &lacking);
        for (torque, more) in table.torque.iter_mut().zip(more) {
            *torque += GAIN * more;
        }
        correction = Correction::Table(table);
    };
    Ok(Corrected { iterations, best_index, stopped })
}

/// RMS of the missing torque, and its standard error [N m].
pub(super) fn rms(missing: &[Missing]) -> [f64; 2] {
    let n = missing.len() as f64;
    let mean = |of: fn(&Missing) -> f64| missing.iter().map(of).sum::<f64>() / n;
    let square = mean(|point| point.torque * point.torque);
    let noise = mean(|point| point.standard_error * point.standard_error);
    [square.sqrt(), (noise / n).sqrt()]
}

/// Whether noise alone explains the missing torque: χ² below its mean plus two standard deviations.
fn within_error(missing: &[Missing]) -> bool {
    let n = missing.len() as f64;
    let squares: f64 = missing.iter().map(|point| (point.torque / point.standard_error).powi(2)).sum();
    squares <= n + 2.0 * (2.0 * n).sqrt()
}

/// Missing torque at the points of a table, by least squares: each measured point is weighted by its error, and
/// neighbours differ by about the RMS of all. Unmeasured points have the next value.
fn smooth(table: &CorrectionTable<f64>, missing: &[Missing]) -> [f64; CORRECTION_POINTS] {
    let [scale, _] = rms(missing);
    let n = missing.len();
    let (low, high) = (libm::log(table.slowest), libm::log(table.fastest));
    let mut rows = DMatrix::zeros(n + CORRECTION_POINTS - 1, CORRECTION_POINTS);
    let mut target = DVector::zeros(rows.nrows());
    for (row, point) in missing.iter().enumerate() {
        let last = (CORRECTION_POINTS - 1) as f64;
        let place = ((libm::log(point.speed) - low) / (high - low) * last).clamp(0.0, last);
        let k = (place as usize).min(CORRECTION_POINTS - 2);
        // An error of 0 would give an infinite weight.
        let weight = 1.0 / point.standard_error.max(1e-3 * scale);
        rows[(row, k)] = weight * (1.0 - (place - k as f64));
        rows[(row, k + 1)] = weight * (place - k as f64);
        target[row] = weight * point.torque;
    }
    for k in 0..CORRECTION_POINTS - 1 {
        (rows[(n + k, k)], rows[(n + k, k + 1)]) = (-1.0 / scale, 1.0 / scale);
    }
    let qr = rows.qr();
    let points = qr.r().solve_upper_triangular(&(qr.q().transpose() * target));
    // Singular without a point: no torque is missing then.
    points.map_or([0.0; CORRECTION_POINTS], |points| std::array::from_fn(|k| points[k]))
}

/// Speeds of a correction by this plan, for a law that renders no torque up to a speed [rad/s].
pub fn table(plan: &FrictionPlan<f64>, start: f64) -> CorrectionTable<f64> {
    let slowest = plan.speeds().find(|speed| *speed > start).unwrap_or(plan.fastest);
    CorrectionTable { begin: start, slowest, fastest: plan.fastest, ..CorrectionTable::default() }
}

/// Missing torque of a measured curve on each valid plateau above a speed [rad/s].
pub fn missing(curve: &FrictionCurve, desired: &Stribeck<f64>, start: f64) -> Vec<Missing> {
    let plateaus = curve.valid().filter(|plateau| plateau.set_velocity.abs() > start);
    let missing = plateaus.map(|plateau| Missing {
        speed: plateau.velocity.abs(),
        torque: plateau.set_velocity.signum() * (desired.torque(plateau.velocity) - plateau.torque),
        standard_error: plateau.standard_error,
    });
    missing.collect()
}

/// Renders the desired friction and corrects it by measuring again, at most `corrections` times; the best correction is
/// then active on the bench.
///
/// # Errors
/// As [`render`].
pub fn render_corrected(
    plan: &FrictionPlan<f64>,
    desired: &Stribeck<f64>,
    corrections: usize,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Corrected<Rendering>, Error> {
    let table = table(plan, faded_below(bench.settings()));
    let corrected = correct(table, corrections, Rendering::missing, |correction| {
        bench.set_correction(correction)?;
        render(plan, desired, bench, watch)
    })?;
    bench.set_correction(corrected.best().correction)?;
    Ok(corrected)
}

#[cfg(test)]
mod tests;
