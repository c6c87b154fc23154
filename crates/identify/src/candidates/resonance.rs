//! A mode of vibration in the residuals: an elastic belt, coupling or frame between motor and load.
//!
//! A rigid body leaves residuals whose spectrum is smooth in time. A mode rings at one frequency whatever the speed,
//! unlike a force over position.

use std::f64::consts::TAU;

use crate::balance::{Balance, Solved};
use stickslip_base::quantity::{Estimate, tied};

/// Power of a mode over the level on both of its sides, in the rate of the force: disturbances fall with frequency.
const CLEAR: f64 = 3.0;
/// Number of frequencies.
const COUNT: usize = 200;

/// A mode of vibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resonance {
    /// Frequency [Hz].
    pub frequency: f64,
    /// Half of the width of its peak [Hz].
    pub half_width: f64,
}

impl Resonance {
    pub(super) fn sentence(&self) -> String {
        format!(
            "The residuals vibrate at {}: the axis is not rigid at this frequency (a belt, coupling or \
             frame is elastic). Mass and friction are those of motor and load together, which hold well below it.",
            tied(&Estimate::new(self.frequency, "Hz").with_half_width(self.half_width))
        )
    }
}

/// The clear peak of the residuals' spectrum, if both halves of the recording have it.
pub(super) fn found(balance: &Balance<'_>, solved: &Solved) -> Option<Resonance> {
    let (period, samples) = (balance.motion.period, balance.motion.samples());
    // Half a second per segment resolves 4 Hz with Hann's window.
    let length = ((0.5 / period) as usize).min(samples / 8);
    let [low, high] = [4.0 / (length as f64 * period), 0.9 * balance.recipe.low_pass];
    if length < 32 || 2.0 * low > high {
        return None;
    }
    let forces = balance.forces(solved.terms.timing);
    let missed = |i: usize| forces[i] - balance.predicted(solved, i);
    let residual: Vec<f64> = (0..samples).map(|i| if balance.is_moving(i, solved) { missed(i) } else { 0.0 }).collect();
    let frequencies: Vec<f64> = (0..COUNT).map(|k| low + (high - low) * k as f64 / COUNT as f64).collect();
    let middle = samples / 2;
    let halves = [&residual[..middle], &residual[middle..]].map(|half| spectrum(half, length, period, &frequencies));
    let [Some(first), Some(second)] = halves.map(|power| peak(&frequencies, &power)) else { return None };
    // What is left of a force over position has its frequency at some speed.
    let fastest = balance.motion.velocity.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    let of_position = solved.terms.waves.iter().fold(0.0f64, |most, wave| most.max(1.05 * wave.number * fastest / TAU));
    if first.frequency < of_position {
        return None;
    }
    let distance = (first.frequency - second.frequency).abs();
    (distance < first.half_width + second.half_width).then_some(Resonance {
        frequency: 0.5 * (first.frequency + second.frequency),
        half_width: 0.5 * (first.half_width + second.half_width),
    })
}

/// Power of the rate of segments of `length` samples that overlap by half, through Hann's window.
fn spectrum(values: &[f64], length: usize, period: f64, frequencies: &[f64]) -> Vec<f64> {
    let window: Vec<f64> = (0..length).map(|i| 0.5 - 0.5 * libm::cos(TAU * i as f64 / length as f64)).collect();
    let power = |frequency: &f64| {
        let (turn_cosine, turn_sine) = (libm::cos(TAU * frequency * period), libm::sin(TAU * frequency * period));
        let segment = |start: usize| {
            let (mut a, mut b, mut cosine, mut sine) = (0.0, 0.0, 1.0, 0.0);
            for (value, weight) in values[start..start + length].iter().zip(&window) {
                a += value * weight * cosine;
                b += value * weight * sine;
                (cosine, sine) = (cosine * turn_cosine - sine * turn_sine, cosine * turn_sine + sine * turn_cosine);
            }
            a * a + b * b
        };
        let total: f64 = (0..=values.len() - length).step_by(length / 2).map(segment).sum();
        total * frequency * frequency
    };
    frequencies.iter().map(power).collect()
}

/// The highest peak, if it is clearly above the level on both of its sides.
fn peak(frequencies: &[f64], power: &[f64]) -> Option<Resonance> {
    let top = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let width = |side: &mut dyn Iterator<Item = usize>| side.take_while(|k| power[*k] > 0.5 * power[top]).count();
    let below = width(&mut (0..top).rev());
    let above = width(&mut (top + 1..power.len()));
    let level = |range: std::ops::Range<usize>| power[range].iter().copied().fold(f64::INFINITY, f64::min);
    // A peak at the edge of the spectrum is the slope of something outside.
    let (first, last) = (top.checked_sub(3 * below + 6)?, top + 3 * above + 6);
    if last >= power.len() || below + above > power.len() / 5 {
        return None;
    }
    let is_clear = power[top] > CLEAR * level(first..top).max(level(top + 1..last + 1));
    let spacing = frequencies[1] - frequencies[0];
    let half_width = 0.5 * (below + above + 1) as f64 * spacing;
    is_clear.then_some(Resonance { frequency: frequencies[top], half_width })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_in_noise_is_found_and_noise_alone_is_not() {
        // SplitMix64: a plain congruence has lines of its own.
        let noise = |i: usize| {
            let mut z = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z ^ (z >> 31)) as f64 / 2f64.powi(64) - 0.5
        };
        let frequencies: Vec<f64> = (0..COUNT).map(|k| 8.0 + 0.4 * k as f64).collect();
        let at = |amplitude: f64| {
            let values: Vec<f64> =
                (0..8000).map(|i| noise(i) + amplitude * libm::sin(TAU * 38.0 * i as f64 * 1e-3)).collect();
            peak(&frequencies, &spectrum(&values, 500, 1e-3, &frequencies))
        };
        assert!((at(0.5).unwrap().frequency - 38.0).abs() < 0.5);
        assert_eq!(at(0.0), None);
    }
}
