//! Noise of the channels, estimated from the residuals of the fit.

use super::parameters::{PARAMETERS, values};
use super::response::CHANNELS;
use super::segment::{LEAD_IN, Segment, Setting, residuals};

/// Order of the autoregression that whitens the residuals.
pub(super) const MEMORY: usize = 4;

/// Model of a channel's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Noise {
    /// Coefficients of the autoregression.
    pub(super) memory: [f64; MEMORY],
    /// Standard deviation of the innovation of each tick; infinite for an ignored channel.
    pub(super) deviation: f64,
}

/// Of each channel: sliding, stuck.
pub(super) type Noises = [[Noise; CHANNELS]; 2];

/// Autoregression and innovation of each channel from the residuals of the fit (Yule and Walker).
pub(super) fn learn_noise(
    noises: &mut Noises,
    coordinates: &[f64; PARAMETERS],
    segments: &[Segment],
    setting: &Setting,
    order: usize,
) {
    let values = values(coordinates);
    let mut products = [[[0.0; MEMORY + 1]; CHANNELS]; 2];
    let mut counts = [0.0; 2];
    for segment in segments {
        let residual = residuals(&values, segment, setting);
        counts[usize::from(segment.is_stuck())] += (residual.len() - LEAD_IN) as f64;
        for k in LEAD_IN..residual.len() {
            for c in 0..CHANNELS {
                for lag in 0..=MEMORY {
                    products[usize::from(segment.is_stuck())][c][lag] += residual[k][c] * residual[k - lag][c];
                }
            }
        }
    }
    for regime in 0..2 {
        for c in 0..CHANNELS {
            if counts[regime] == 0.0 || !noises[regime][c].deviation.is_finite() {
                continue;
            }
            let (memory, share) = levinson(&products[regime][c], order);
            let deviation = libm::sqrt(share * products[regime][c][0] / counts[regime]).max(1e-9);
            noises[regime][c] = Noise { memory, deviation };
        }
    }
}

/// Autoregression of an order from autocovariances, and the innovation's share of the variance (Levinson and Durbin).
fn levinson(r: &[f64; MEMORY + 1], order: usize) -> ([f64; MEMORY], f64) {
    let mut a = [0.0; MEMORY];
    let mut share = 1.0;
    if r[0] <= 0.0 {
        return (a, share);
    }
    for n in 0..order {
        let predicted: f64 = (0..n).map(|i| a[i] * r[n - i]).sum();
        let k = (r[n + 1] - predicted) / (share * r[0]);
        let before = a;
        a[n] = k;
        (0..n).for_each(|i| a[i] = before[i] - k * before[n - 1 - i]);
        share *= 1.0 - k * k;
    }
    (a, share)
}
