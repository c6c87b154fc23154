//! Low-pass filters without phase: Butterworth and Chebyshev, run forward and backward, and decimation.
//!
//! Same results as SciPy's `butter`, `cheby1`, `sosfiltfilt` and `decimate` (verified to 1e-9). Only for recordings: a
//! filter that uses later samples cannot run in a loop.

use std::f64::consts::PI;

use crate::Error;

/// A low-pass as a chain of second-order sections, all zeros at half the sampling rate.
#[derive(Clone, Debug, PartialEq)]
pub struct LowPass {
    sections: Vec<Section>,
    order: usize,
}

/// (b₀ + b₁·z⁻¹ + b₂·z⁻²) / (1 + a₁·z⁻¹ + a₂·z⁻²)
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl LowPass {
    /// Maximally flat: −3 dB at `cutoff` [Hz] in one direction, −6 dB both ways. `rate` is the sampling rate [Hz].
    ///
    /// # Errors
    /// A cut-off that is not between 0 and half the rate.
    pub fn butterworth(order: usize, cutoff: f64, rate: f64) -> Result<Self, Error> {
        Self::design(order, cutoff, rate, 1.0, 1.0, 1.0)
    }

    /// Chebyshev type I: `ripple` [dB] down to `cutoff` [Hz] and steeper beyond.
    ///
    /// # Errors
    /// A cut-off that is not between 0 and half the rate.
    pub fn chebyshev(order: usize, ripple: f64, cutoff: f64, rate: f64) -> Result<Self, Error> {
        let epsilon = (libm::pow(10.0, 0.1 * ripple) - 1.0).sqrt();
        let mu = (1.0 / epsilon).asinh() / order as f64;
        // With an even order the gain at rest is the bottom of the ripple.
        let gain = if order.is_multiple_of(2) { libm::pow(10.0, -ripple / 20.0) } else { 1.0 };
        Self::design(order, cutoff, rate, libm::sinh(mu), libm::cosh(mu), gain)
    }

    /// Poles on an ellipse with the given half-axes, mapped by the bilinear transform with the cut-off prewarped.
    fn design(order: usize, cutoff: f64, rate: f64, real: f64, imaginary: f64, gain: f64) -> Result<Self, Error> {
        if !(cutoff > 0.0 && cutoff < 0.5 * rate) {
            return Err(Error::Cutoff { cutoff, rate });
        }
        let warped = libm::tan(PI * cutoff / rate);
        let mut sections = Vec::new();
        for k in 0..order.div_ceil(2) {
            let angle = PI * (order - 1 - 2 * k) as f64 / (2 * order) as f64;
            // The analogue pole pair, scaled so that the bilinear transform is s = (1 − z⁻¹)/(1 + z⁻¹).
            let (re, im) = (-warped * real * libm::cos(angle), warped * imaginary * libm::sin(angle));
            let single = 2 * k + 1 == order;
            let mut section = if single {
                let pole = (1.0 + re) / (1.0 - re);
                Section { b: [1.0, 1.0, 0.0], a: [-pole, 0.0] }
            } else {
                let denominator = (1.0 - re) * (1.0 - re) + im * im;
                let (sum, product) = (2.0 * (1.0 - re * re - im * im), (1.0 + re) * (1.0 + re) + im * im);
                Section { b: [1.0, 2.0, 1.0], a: [-sum / denominator, product / denominator] }
            };
            let at_rest = section.gain();
            let target = if k == 0 { gain } else { 1.0 };
            section.b = section.b.map(|b| b * target / at_rest);
            sections.push(section);
        }
        Ok(LowPass { sections, order })
    }

    /// Forward and backward: no phase, the gain squared. Both ends are continued by point reflection, and each pass
    /// starts in the steady state of the first value.
    ///
    /// # Errors
    /// A signal not longer than the continuation, 3·(order + 1) samples.
    pub fn both_ways(&self, signal: &[f64]) -> Result<Vec<f64>, Error> {
        let edge = 3 * (self.order + 1);
        if signal.len() <= edge {
            let remedy = "Record longer, or filter with a lower order.";
            return Err(Error::TooFew { what: "samples to filter", found: signal.len(), needed: edge + 1, remedy });
        }
        let (first, last) = (signal[0], signal[signal.len() - 1]);
        let before = signal[1..=edge].iter().rev().map(|x| 2.0 * first - x);
        let after = signal[signal.len() - 1 - edge..signal.len() - 1].iter().rev().map(|x| 2.0 * last - x);
        let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            self.run(&mut extended);
            extended.reverse();
        }
        Ok(extended[edge..edge + signal.len()].to_vec())
    }

    /// One pass, transposed direct form II.
    fn run(&self, signal: &mut [f64]) {
        for section in &self.sections {
            let Section { b, a } = *section;
            let (level, gain) = (signal[0], section.gain());
            let rest = [b[1] - a[0] * gain + b[2] - a[1] * gain, b[2] - a[1] * gain];
            let mut state = rest.map(|z| z * level);
            for x in signal.iter_mut() {
                let y = b[0] * *x + state[0];
                state = [b[1] * *x - a[0] * y + state[1], b[2] * *x - a[1] * y];
                *x = y;
            }
        }
    }
}

impl Section {
    /// Output over input at rest.
    fn gain(&self) -> f64 {
        self.b.iter().sum::<f64>() / (1.0 + self.a.iter().sum::<f64>())
    }
}

/// Every `factor`-th sample after a zero-phase low-pass (Chebyshev, order 8, 0.05 dB, at 0.8 of the new half rate).
///
/// # Errors
/// Fewer than 28 samples.
pub fn decimate(signal: &[f64], factor: usize) -> Result<Vec<f64>, Error> {
    if factor <= 1 {
        return Ok(signal.to_vec());
    }
    let filter = LowPass::chebyshev(8, 0.05, 0.4 / factor as f64, 1.0)?;
    Ok(filter.both_ways(signal)?.into_iter().step_by(factor).collect())
}

/// Central difference per `step`, one-sided at the two ends, as NumPy's `gradient`.
pub fn central_difference(signal: &[f64], step: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    let slope = |i: usize| {
        let (low, high) = (i.saturating_sub(1), (i + 1).min(last));
        (signal[high] - signal[low]) / ((high - low) as f64 * step)
    };
    if signal.len() < 2 { vec![0.0; signal.len()] } else { (0..signal.len()).map(slope).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NUMBERS: &str = include_str!("../../../tests/reference/filter/numbers.csv");

    fn reference(name: &str) -> Vec<f64> {
        let line = NUMBERS.lines().find(|line| line.split(',').next() == Some(name)).expect(name);
        line.split(',').skip(1).map(|x| x.parse().unwrap()).collect()
    }

    fn assert_close(ours: &[f64], theirs: &[f64]) {
        assert_eq!(ours.len(), theirs.len());
        let scale = theirs.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
            assert!((a - b).abs() <= 1e-9 * scale, "{i}: {a} {b}");
        }
    }

    #[test]
    fn filters_are_those_of_scipy() {
        let signal = reference("signal");
        for (name, filter) in [
            ("butterworth4", LowPass::butterworth(4, 100.0, 1000.0)),
            ("butterworth3", LowPass::butterworth(3, 20.0, 1000.0)),
            ("chebyshev8", LowPass::chebyshev(8, 0.05, 40.0, 1000.0)),
            ("chebyshev5", LowPass::chebyshev(5, 1.0, 150.0, 1000.0)),
        ] {
            assert_close(&filter.unwrap().both_ways(&signal).unwrap(), &reference(name));
        }
        assert_close(&decimate(&signal, 10).unwrap(), &reference("decimate10"));
        assert_close(&decimate(&signal, 3).unwrap(), &reference("decimate3"));
        assert_close(&central_difference(&signal, 1e-3), &reference("gradient"));
    }

    #[test]
    fn a_straight_line_passes_unchanged_away_from_the_ends() {
        let line: Vec<f64> = (0..200).map(|i| 3.0 - 0.5 * i as f64).collect();
        let filtered = LowPass::butterworth(4, 100.0, 1000.0).unwrap().both_ways(&line).unwrap();
        // The slowest pole pair of 100 Hz decays by nine decades in about 50 samples.
        assert_close(&filtered[60..140], &line[60..140]);
    }

    #[test]
    fn a_filter_above_half_the_rate_and_a_signal_too_short_are_refused() {
        let error = LowPass::butterworth(4, 600.0, 1000.0).unwrap_err();
        assert!(error.to_string().contains("600") && error.to_string().contains("1000"), "{error}");
        let filter = LowPass::butterworth(4, 100.0, 1000.0).unwrap();
        assert!(matches!(filter.both_ways(&[0.0; 15]), Err(Error::TooFew { found: 15, needed: 16, .. })));
        assert!(filter.both_ways(&[0.0; 16]).is_ok());
    }
}
