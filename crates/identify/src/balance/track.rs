//! A motion at any instant between its samples, and the motion that the set-point causes.

use nalgebra::{DMatrix, DVector};
use stickslip_base::Error;
use stickslip_base::filter::{LowPass, central_difference};

/// Position, velocity and acceleration over the samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Track {
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
}

/// Values of a track at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Instant {
    pub(crate) position: f64,
    pub(crate) velocity: f64,
    pub(crate) acceleration: f64,
}

impl Track {
    /// From a smooth position, and the velocity where it was measured.
    pub(crate) fn of(position: Vec<f64>, measured: Option<Vec<f64>>, period: f64) -> Self {
        let velocity = measured.unwrap_or_else(|| slopes(&position, period));
        let acceleration = slopes(&velocity, period);
        Track { position, velocity, acceleration }
    }

    /// The track at an instant, counted in samples: cubic through the four nearest samples.
    pub(crate) fn at(&self, sample: f64) -> Instant {
        let (first, weights) = cubic(sample, self.position.len());
        let value = |values: &[f64]| weights.iter().zip(&values[first..]).map(|(w, v)| w * v).sum();
        Instant {
            position: value(&self.position),
            velocity: value(&self.velocity),
            acceleration: value(&self.acceleration),
        }
    }

    /// The motion that known signals cause, the set-point and the injected force: the best sum of the delayed signals, for
    /// instruments. Noise of the sensor and disturbances of the force are not in it. None where the signals explain less
    /// than nine tenths of the motion.
    ///
    /// # Errors
    /// As [`LowPass::both_ways`].
    pub(crate) fn caused(&self, known: &[&[f64]], low_pass: &LowPass, period: f64) -> Result<Option<Self>, Error> {
        /// Delays of each signal in the sum.
        const TAPS: usize = 26;
        /// Time between two of them [s].
        const SPACING: f64 = 4e-3;
        if known.is_empty() {
            return Ok(None);
        }
        let samples = self.position.len();
        let spacing = ((SPACING / period).round() as usize).max(1);
        let smooth: Vec<Vec<f64>> = known.iter().map(|signal| low_pass.both_ways(signal)).collect::<Result<_, _>>()?;
        let rates: Vec<Vec<f64>> = smooth.iter().map(|signal| central_difference(signal, period)).collect();
        let (smooth, rates) = (scaled(smooth, &rates), scaled(rates.clone(), &rates));
        // Tap t of signal k is column k·TAPS + t.
        let delayed = |signals: &[Vec<f64>], i: usize, column: usize| {
            signals[column / TAPS][(i + spacing).saturating_sub(column % TAPS * spacing).min(samples - 1)]
        };
        let rows: Vec<usize> = (0..samples).step_by((samples / 5000).max(1)).collect();
        let columns = DMatrix::from_fn(rows.len(), TAPS * rates.len(), |i, column| delayed(&rates, rows[i], column));
        let moved = DVector::from_iterator(rows.len(), rows.iter().map(|i| self.velocity[*i]));
        let normal = columns.tr_mul(&columns);
        let decomposed = normal.svd(true, true);
        let threshold = 1e-8 * decomposed.singular_values.max();
        let Ok(weights) = decomposed.solve(&columns.tr_mul(&moved), threshold) else { return Ok(None) };
        let missed = &moved - &columns * &weights;
        if missed.norm_squared().is_nan() || missed.norm_squared() > 0.1 * moved.norm_squared() {
            return Ok(None);
        }
        let sum = |i: usize| (0..weights.len()).map(|k| weights[k] * delayed(&smooth, i, k)).sum::<f64>();
        let mut position: Vec<f64> = (0..samples).map(sum).collect();
        let level = self.position.iter().zip(&position).map(|(q, p)| q - p).sum::<f64>() / samples as f64;
        position.iter_mut().for_each(|p| *p += level);
        Ok(Some(Track::of(position, None, period)))
    }
}

impl Track {
    /// The motion a while before, for instruments where no set-point was recorded: noise of the sensor through the
    /// low-pass is forgotten after one and a half periods of its cut-off frequency, and the motion of an axis is not.
    /// None where the acceleration changes as fast as that.
    pub(crate) fn past(&self, cutoff: f64, period: f64) -> Option<Self> {
        let lag = (1.5 / (cutoff * period)).ceil();
        let past = |values: &[f64]| delayed(values, lag);
        let before = past(&self.acceleration);
        let product: f64 = before.iter().zip(&self.acceleration).map(|(a, b)| a * b).sum();
        let square: f64 = self.acceleration.iter().map(|a| a * a).sum();
        let is_similar = product > 0.5 * square;
        is_similar.then(|| Track {
            position: past(&self.position),
            velocity: past(&self.velocity),
            acceleration: before,
        })
    }
}

/// Signals divided by the RMS of their rates, so that a set-point in m and a force in N weigh alike.
fn scaled(mut signals: Vec<Vec<f64>>, rates: &[Vec<f64>]) -> Vec<Vec<f64>> {
    for (signal, rate) in signals.iter_mut().zip(rates) {
        let size = (rate.iter().map(|value| value * value).sum::<f64>() / rate.len() as f64).sqrt();
        signal.iter_mut().for_each(|value| *value /= if size > 0.0 { size } else { 1.0 });
    }
    signals
}

/// Slopes from the four nearest samples. A difference of two is too small by (ω·T)²/6, for a movement of 5 Hz sampled at
/// 100 Hz by 1.6 %, and twice that for the acceleration; this one by (ω·T)⁴/30.
fn slopes(values: &[f64], period: f64) -> Vec<f64> {
    let mut slopes = central_difference(values, period);
    for i in 2..values.len().saturating_sub(2) {
        let (near, far) = (values[i + 1] - values[i - 1], values[i + 2] - values[i - 2]);
        slopes[i] = (8.0 * near - far) / (12.0 * period);
    }
    slopes
}

/// Force whose samples are held over a period, as the sampled motion shows it: 1 − (ω·T)²/24 of its samples.
pub(super) fn held(force: &[f64]) -> Vec<f64> {
    let mut held = force.to_vec();
    for i in 1..force.len().saturating_sub(1) {
        held[i] = (force[i - 1] + 22.0 * force[i] + force[i + 1]) / 24.0;
    }
    held
}

/// First of the four nearest samples to an instant, and their weights.
fn cubic(sample: f64, samples: usize) -> (usize, [f64; 4]) {
    let first = (sample.floor().max(1.0) as usize).min(samples.saturating_sub(3)).max(1);
    let x = sample - first as f64;
    let weights = [
        -x * (x - 1.0) * (x - 2.0) / 6.0,
        (x * x - 1.0) * (x - 2.0) / 2.0,
        -x * (x + 1.0) * (x - 2.0) / 2.0,
        x * (x * x - 1.0) / 6.0,
    ];
    (first - 1, weights)
}

/// A signal that is late by a number of samples; constant beyond its ends.
pub(super) fn delayed(values: &[f64], late: f64) -> Vec<f64> {
    if late == 0.0 {
        return values.to_vec();
    }
    let last = values.len() as f64 - 1.0;
    let at = |i: usize| {
        let (first, weights) = cubic((i as f64 - late).clamp(0.0, last), values.len());
        weights.iter().zip(&values[first..]).map(|(w, v)| w * v).sum()
    };
    (0..values.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_passes_exactly_between_samples_and_late_is_later() {
        let cube = |t: f64| t * t * t - 3.0 * t;
        let values: Vec<f64> = (0..20).map(|i| cube(f64::from(i))).collect();
        let late = delayed(&values, 2.25);
        for i in 3..20 {
            assert!((late[i] - cube(i as f64 - 2.25)).abs() < 1e-9, "{i}");
        }
        assert_eq!((late[0], delayed(&values, 0.0)), (values[0], values.clone()));
    }
}
