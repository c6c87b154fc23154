//! A lag of the drive: force that follows the command with first order.
//!
//! ```text
//! T·dF/dt + F = F_command        F(t) = M·q̈(t + d) + …
//! ```
//!
//! Estimated are τ = d + T, by which a slow movement is late, and κ = T²/2, what sets a lag apart from a delay: at a
//! fixed τ the derivative of the balance by κ is −s²/(1 + T·s)·F, which remains finite for T → 0.

use super::terms::Estimates;
use super::{Balance, HELD, Solved, Timing};
use stickslip_base::filter::central_difference;

/// A signal behind a lag of first order, straight between its samples; time constant in samples.
pub(super) fn lagging(values: &[f64], lag: f64) -> Vec<f64> {
    // Below a hundredth of a sample the lag is none.
    if lag < 1e-2 {
        return values.to_vec();
    }
    let memory = libm::exp(-1.0 / lag);
    // Exact for a ramp between two samples.
    let (old, new) = (lag * (1.0 - memory) - memory, 1.0 - lag * (1.0 - memory));
    let (mut state, mut before) =
        (values.first().copied().unwrap_or_default(), values.first().copied().unwrap_or_default());
    let step = |value: &f64| {
        state = memory * state + old * before + new * value;
        before = *value;
        state
    };
    values.iter().map(step).collect()
}

/// Derivative of the balance by κ, from the force behind the lag.
pub(super) fn slope(force: &[f64], lag: f64) -> Vec<f64> {
    let rate = central_difference(force, 1.0);
    if lag < 1e-2 {
        return central_difference(&rate, 1.0).iter().map(|value| -value).collect();
    }
    let late = lagging(&rate, lag);
    rate.iter().zip(late).map(|(rate, late)| (late - rate) / lag).collect()
}

impl Balance<'_> {
    /// A solved balance with delay and lag, where the motion determines both and the delay is at least a fifth of a
    /// sample; else as it was.
    pub(crate) fn lagging(&self, solved: Solved) -> Solved {
        let total = solved.terms.timing.total();
        let beside = total - HELD;
        if beside < 0.2 {
            return solved;
        }
        let start = Timing { delay: total - 0.5 * beside, lag: 0.5 * beside, estimates: Estimates::DelayAndLag };
        let Ok(found) = self.solve(&solved.terms.with(start), &self.whole()) else { return solved };
        if found.terms.timing.lag > 0.0 { found } else { solved }
    }

    /// The lag of a solved balance and its 95 % interval [s], if it predicts unseen parts of the recording better than a
    /// delay alone.
    pub(super) fn lag(&self, solved: &Solved) -> Option<(f64, [f64; 2])> {
        let [low, high] = *solved.fit.ci95.get(solved.terms.count() + 1)?;
        let timing = solved.terms.timing.fixed();
        // A less certain one could be another effect of second order.
        let is_clear = low > 0.25 * timing.lag.powi(2);
        let alone = solved.terms.with(Timing::held(timing.total()));
        if !is_clear || self.gains(&[alone, solved.terms.with(timing)]) != Some(1) {
            return None;
        }
        let seconds = |half_square: f64| (2.0 * half_square).sqrt() * self.motion.period;
        Some((timing.lag * self.motion.period, [low, high].map(seconds)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_late_by_the_time_constant_and_the_slope_is_the_difference_of_two_lags() {
        let ramp: Vec<f64> = (0..200).map(f64::from).collect();
        for lag in [0.0, 0.3, 2.0, 12.0] {
            assert!((lagging(&ramp, lag)[199] - (199.0 - lag)).abs() < 1e-6 + 2e-5 * lag, "{lag}");
        }
        // A sine: change of κ at a fixed sum of lag and delay.
        let wave = |i: usize, late: f64| libm::sin(0.05 * (i as f64 - late));
        let (total, lag, small) = (8.0, 5.0f64, 1e-3);
        // The force at the axis: the command behind delay and lag.
        let required = |half_square: f64| {
            let lag = (2.0 * half_square).sqrt();
            let late: Vec<f64> = (0..1000).map(|i| wave(i, total - lag)).collect();
            lagging(&late, lag)
        };
        let (at, there) = (0.5 * lag * lag, 600);
        let expected = (required(at + small)[there] - required(at - small)[there]) / (2.0 * small);
        let found = -slope(&required(at), lag)[there];
        assert!((found - expected).abs() < 2e-3 * expected.abs() + 1e-7, "{found} instead of {expected}");
    }
}
