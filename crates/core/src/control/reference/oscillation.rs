//! Sines, for frequency responses: one, one after the other, many at once.
//!
//! All fade in (and the chirp out) along 10·τ³ − 15·τ⁴ + 6·τ⁵: position, velocity and acceleration start from 0.

use core::f64::consts::TAU;

use super::{Setpoint, resting};
use crate::Fields;
use crate::fields::{Relation, at_least, at_most};
use crate::scalar::Scalar;

/// Most components of a [`Multisine`].
pub const MAX_COMPONENTS: usize = 64;

/// One frequency: r = r₀·sin(2π·f·t). Nothing jumps, unless the fade time is 0: then the velocity does.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Sine<T> {
    /// Largest position.
    #[field(symbol = "r₀", unit = "rad", range = 0.0..=1e4, default = 2.0)]
    pub amplitude: T,
    /// Frequency.
    #[field(symbol = "f", unit = "Hz", range = 1e-4..=1e4, default = 0.5)]
    pub frequency: T,
    /// Time in which the amplitude grows from 0.
    #[field(symbol = "T_f", unit = "s", range = 0.0..=1e3, default = 1.0)]
    pub fade_time: T,
}

/// Linear chirp: the frequency runs evenly from its start to its end. Nothing jumps, unless the fade time is 0.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = Chirp::law)]
pub struct Chirp<T> {
    /// Largest position; the velocity grows with the frequency, the acceleration with its square.
    #[field(symbol = "r₀", unit = "rad", range = 0.0..=1e4, default = 0.05)]
    pub amplitude: T,
    /// Frequency at the start.
    #[field(symbol = "f₁", unit = "Hz", range = 0.0..=1e4, default = 0.5)]
    pub start_frequency: T,
    /// Frequency at the end; lower than at the start runs downwards.
    #[field(symbol = "f₂", unit = "Hz", range = 0.0..=1e4, default = 50.0)]
    pub end_frequency: T,
    /// Duration.
    #[field(symbol = "T", unit = "s", range = 1e-3..=1e5, default = 10.0)]
    pub duration: T,
    /// Time in which the amplitude grows from 0 at the start and falls to 0 at the end.
    #[field(symbol = "T_f", unit = "s", range = 0.0..=1e3, default = 0.5)]
    pub fade_time: T,
}

/// Neighbouring harmonics of one fundamental at equal amplitude, with Schroeder's phases −π·n·(n − 1)/N for a low crest
/// factor (Schroeder 1970): 1.7 to 2 from eight components on, where equal phases have √(2·N). Repeats after one period
/// of the fundamental. Nothing jumps, unless the fade time is 0.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = Multisine::law)]
pub struct Multisine<T> {
    /// Root mean square of the position.
    #[field(symbol = "r_rms", unit = "rad", range = 0.0..=1e4, default = 0.02)]
    pub rms: T,
    /// Distance between frequencies, and the inverse of the period.
    #[field(symbol = "f₀", unit = "Hz", range = 1e-4..=1e3, default = 0.5)]
    pub fundamental: T,
    /// First harmonic.
    #[field(symbol = "k₁", unit = "1", whole, range = 1.0..=1e5, default = 1.0)]
    pub lowest_harmonic: T,
    /// Last harmonic, at most 63 above the first.
    #[field(symbol = "k₂", unit = "1", whole, range = 1.0..=1e5, default = 40.0)]
    pub highest_harmonic: T,
    /// Time in which the amplitude grows from 0.
    #[field(symbol = "T_f", unit = "s", range = 0.0..=1e3, default = 1.0)]
    pub fade_time: T,
}

impl Sine<f64> {
    /// The set-point at a time [s].
    pub(super) fn at(&self, time: f64) -> Setpoint<f64> {
        faded(component(self.amplitude, self.frequency * time, TAU * self.frequency, 0.0), fade(time, self.fade_time))
    }
}

impl<T: Scalar> Chirp<T> {
    /// The fades may not overlap.
    fn law(&self) -> [Relation<T>; 1] {
        let remedy = "Fade-in and fade-out together must not exceed the duration.";
        [at_most("fade_time", self.fade_time, T::of(0.5) * self.duration, remedy)]
    }
}

impl Chirp<f64> {
    /// The set-point at a time [s].
    pub(super) fn at(&self, time: f64) -> Setpoint<f64> {
        if time > self.duration {
            return resting(self.at(self.duration).position);
        }
        let slope = (self.end_frequency - self.start_frequency) / self.duration;
        let turns = (self.start_frequency + 0.5 * slope * time) * time;
        let frequency = self.start_frequency + slope * time;
        let sine = component(self.amplitude, turns, TAU * frequency, TAU * slope);
        let rising = faded(sine, fade(time, self.fade_time));
        let [value, rate, curvature] = fade(self.duration - time, self.fade_time);
        // Backwards in time the first derivative changes its sign.
        faded(rising, [value, -rate, curvature])
    }
}

impl<T: Scalar> Multisine<T> {
    /// One place for each component.
    fn law(&self) -> [Relation<T>; 2] {
        let remedy = "Set the highest harmonic at or above the lowest, or increase the fundamental for a wider band.";
        let last = self.lowest_harmonic + T::of((MAX_COMPONENTS - 1) as f64);
        [
            at_least("highest_harmonic", self.highest_harmonic, self.lowest_harmonic, remedy),
            at_most("highest_harmonic", self.highest_harmonic, last, remedy),
        ]
    }
}

impl Multisine<f64> {
    /// The set-point at a time [s].
    pub(super) fn at(&self, time: f64) -> Setpoint<f64> {
        let count = self.highest_harmonic - self.lowest_harmonic + 1.0;
        let amplitude = self.rms * libm::sqrt(2.0 / count);
        let mut sum = Setpoint::default();
        for n in 0..MAX_COMPONENTS {
            let n = n as f64;
            if n >= count {
                break;
            }
            let frequency = (self.lowest_harmonic + n) * self.fundamental;
            // A quarter of a turn: cosines have the lower crest factor.
            let turns = frequency * time - 0.5 * n * (n + 1.0) / count + 0.25;
            let more = component(amplitude, turns, TAU * frequency, 0.0);
            sum.position += more.position;
            sum.velocity += more.velocity;
            sum.acceleration += more.acceleration;
        }
        faded(sum, fade(time, self.fade_time))
    }
}

/// A sine after this number of turns, at `rate` [rad/s], which changes by `sweep` [rad/s²].
fn component(amplitude: f64, turns: f64, rate: f64, sweep: f64) -> Setpoint<f64> {
    // Whole turns are dropped while they are exact: the sine keeps its digits for days.
    let phase = TAU * (turns - libm::floor(turns));
    let (sine, cosine) = (Scalar::sin(phase), Scalar::cos(phase));
    Setpoint {
        position: amplitude * sine,
        velocity: amplitude * rate * cosine,
        acceleration: amplitude * (sweep * cosine - rate * rate * sine),
    }
}

/// Fade factor at a time [s], with two derivatives.
fn fade(time: f64, fade_time: f64) -> [f64; 3] {
    if time >= fade_time {
        return [1.0, 0.0, 0.0];
    }
    let s = time.max(0.0) / fade_time;
    let value = s * s * s * (10.0 + s * (6.0 * s - 15.0));
    let rate = 30.0 * s * s * (1.0 - s) * (1.0 - s) / fade_time;
    let curvature = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (fade_time * fade_time);
    [value, rate, curvature]
}

/// A set-point times a factor with two derivatives.
fn faded(setpoint: Setpoint<f64>, [value, rate, curvature]: [f64; 3]) -> Setpoint<f64> {
    Setpoint {
        position: value * setpoint.position,
        velocity: value * setpoint.velocity + rate * setpoint.position,
        acceleration: value * setpoint.acceleration + 2.0 * rate * setpoint.velocity + curvature * setpoint.position,
    }
}
