//! Excitation, duration and ways of a frequency response.

use std::f64::consts::TAU;

use stickslip_core::Fields;
use stickslip_core::fields::{Relation, at_least};
use stickslip_core::scalar::Scalar;

use stickslip_base::Error;
use stickslip_design::linear::Operating;

/// Acceleration before and after the excitation [rad/s²].
pub(super) const ACCELERATION: f64 = 200.0;
/// Time at speed, or at rest without torque, before the excitation starts [s].
pub(super) const SETTLING: f64 = 0.3;
/// Time for which each period's wave runs before the evaluated period [s].
pub(super) const RUN_IN: f64 = 0.25;
/// Time at rest before each pass [s].
const REST: f64 = 0.1;

/// Plan of a frequency response.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = ResponsePlan::law)]
pub struct ResponsePlan<T> {
    /// Velocity of the sliding load; 0: load at rest.
    #[field(symbol = "Ω", unit = "rad/s", range = -200.0..=200.0, default = 20.0)]
    pub velocity: T,
    /// RMS torque of the excitation over the limit of the drive motor; for a load at rest over the model's breakaway
    /// torque.
    #[field(symbol = "M_rms/M", unit = "1", range = 1e-4..=0.3, default = 0.15)]
    pub share: T,
    /// Lowest frequency.
    #[field(symbol = "f_1", unit = "Hz", range = 0.1..=1000.0, default = 4.0)]
    pub lowest_frequency: T,
    /// Highest frequency.
    #[field(symbol = "f_2", unit = "Hz", range = 1.0..=4000.0, default = 400.0)]
    pub highest_frequency: T,
    /// Whether the excitation is a chirp, at all frequencies with whole periods, instead of a multisine.
    #[field(unit = "1", flag)]
    pub chirp: T,
    /// Number of frequencies of the multisine, about evenly spaced on a logarithmic scale.
    #[field(symbol = "n_f", unit = "1", range = 2.0..=500.0, default = 60.0, whole)]
    pub lines: T,
    /// Period of the excitation: its frequencies are multiples of 1/T.
    #[field(symbol = "T", unit = "s", range = 0.05..=60.0, default = 1.0)]
    pub period: T,
    /// Number of periods, each with other phases.
    #[field(symbol = "n_T", unit = "1", range = 3.0..=1000.0, default = 16.0, whole)]
    pub periods: T,
}

impl<T: Scalar> ResponsePlan<T> {
    fn law(&self) -> [Relation<T>; 2] {
        let lines = "The highest frequency is below the lowest: swap them.";
        let period = "A period must contain at least one oscillation of the lowest frequency.";
        [
            at_least("highest_frequency", self.highest_frequency, self.lowest_frequency, lines),
            at_least("lowest_frequency", self.lowest_frequency, T::of(1.0) / self.period, period),
        ]
    }
}

impl ResponsePlan<f64> {
    /// Regime of the load.
    pub fn operating(&self) -> Operating {
        if self.velocity == 0.0 { Operating::Stuck } else { Operating::Sliding(self.velocity) }
    }

    /// The way of each pass on a stroke with these ends [rad].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the stroke is too short for one period.
    pub(super) fn pass(&self, ends: [f64; 2]) -> Result<Pass, Error> {
        let speed = self.velocity.abs();
        if speed == 0.0 {
            return Ok(Pass { start: 0.0, end: 0.0, periods: self.periods as usize });
        }
        let each = speed * (RUN_IN + self.period);
        // A tenth of the stroke remains to brake on.
        let rest = speed * SETTLING + speed * speed / ACCELERATION;
        let room = 0.9 * (ends[1] - ends[0]) - rest;
        if room < each {
            return Err(Error::OutOfRange {
                name: "the way of one period at this velocity",
                value: each,
                unit: "rad",
                minimum: 0.0,
                maximum: room.max(0.0),
                remedy: "The stroke is too short: reduce plan.velocity or plan.period.",
            });
        }
        let periods = (room / each).floor().min(self.periods);
        let half = 0.5 * (rest + periods * each) * self.velocity.signum();
        let middle = 0.5 * (ends[0] + ends[1]);
        Ok(Pass { start: middle - half, end: middle + half, periods: periods as usize })
    }

    /// Bench time on a stroke with these ends [rad], from its zero [s].
    pub fn duration(&self, ends: [f64; 2]) -> f64 {
        let waves = self.periods * (RUN_IN + self.period);
        let Ok(Pass { start, end, periods }) = self.pass(ends) else { return waves };
        let speed = self.velocity.abs();
        let way = |from: f64, to: f64| if from == to { 0.0 } else { (to - from).abs() / speed + speed / ACCELERATION };
        let passes = (self.periods / periods as f64).ceil();
        let each = SETTLING + REST + 2.0 * speed / ACCELERATION;
        waves + passes * each + way(0.0, start) + (passes - 1.0) * way(end, start)
    }

    /// Frequencies as multiples of 1/T.
    pub(super) fn multiples(&self) -> Vec<usize> {
        let whole = |frequency: f64| (frequency * self.period).round().max(1.0) as usize;
        let [first, last] = [self.lowest_frequency, self.highest_frequency].map(whole);
        if self.chirp > 0.5 {
            return (first..=last).collect();
        }
        let steps = self.lines - 1.0;
        let ratio = libm::log(self.highest_frequency / self.lowest_frequency);
        let mut multiples: Vec<usize> = (0..self.lines as usize)
            .map(|k| whole(self.lowest_frequency * libm::exp(ratio * k as f64 / steps)))
            .collect();
        multiples.dedup();
        multiples
    }

    /// The excitation of a period, with RMS 1.
    pub(super) fn excitation(&self, number: usize, multiples: &[usize], samples: usize) -> Vec<f64> {
        // Multiples of the golden section spread phases evenly.
        let phase = |n: usize| TAU * (((n * (number + 1)) as f64 * 0.618_033_988_749_895) % 1.0);
        let wave: Vec<f64> = if self.chirp > 0.5 {
            let [first, last] = [self.lowest_frequency, self.highest_frequency].map(|f| f * self.period);
            let at = |part: f64| libm::sin(phase(1) + TAU * part * (first + 0.5 * (last - first) * part));
            (0..samples).map(|k| at(k as f64 / samples as f64)).collect()
        } else {
            // √f: slow lines move the load most, quick ones have the most noise.
            let turn = TAU / samples as f64;
            let line = |k: usize, n: usize, multiple: usize| {
                libm::sqrt(multiple as f64) * libm::sin(turn * ((multiple * k) % samples) as f64 + phase(n * n + 1))
            };
            (0..samples).map(|k| multiples.iter().enumerate().map(|(n, m)| line(k, n, *m)).sum()).collect()
        };
        let rms = libm::sqrt(wave.iter().map(|value| value * value).sum::<f64>() / samples as f64);
        wave.into_iter().map(|value| value / rms).collect()
    }
}

/// Start and end [rad], and periods between.
pub(super) struct Pass {
    pub(super) start: f64,
    pub(super) end: f64,
    pub(super) periods: usize,
}
