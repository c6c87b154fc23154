//! Set-points of the position controller.
//!
//! A [`Reference`] is a set of numbers, a [`Generator`] computes one [`Setpoint`] for each cycle from it. Time is the
//! integer cycle: after hours the set-point is as exact as in the first second, and the same in every run. Each kind
//! starts at the generator's origin at rest, and documents whether its velocity or acceleration jumps.

mod binary;
mod generator;
mod oscillation;
mod shaped;
mod speed;
mod stroke;

pub use binary::Prbs;
pub use generator::Generator;
pub use oscillation::{Chirp, MAX_COMPONENTS, Multisine, Sine};
pub use shaped::{Shaped, Shaper};
pub use speed::{Ramp, SpeedSweep};
pub use stroke::{MotionLimits, PointToPoint, RandomStrokes, Stroke};

#[cfg(test)]
mod tests;

use crate::Fields;

/// Position of the screw, and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Setpoint<T> {
    /// Screw angle.
    #[field(symbol = "r", unit = "rad")]
    pub position: T,
    /// Its first derivative; 0 where the position jumps.
    #[field(symbol = "ṙ", unit = "rad/s")]
    pub velocity: T,
    /// Its second derivative; 0 where the velocity jumps.
    #[field(symbol = "r̈", unit = "rad/s^2")]
    pub acceleration: T,
}

/// A constant position.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Constant<T> {
    /// The position, from the origin; other than 0 it is a jump at the start.
    #[field(symbol = "r₀", unit = "rad", range = -1e5..=1e5)]
    pub position: T,
}

/// Steps to a height and back, endless. The position jumps.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Steps<T> {
    /// Height of the steps.
    #[field(symbol = "r₀", unit = "rad", range = -1e5..=1e5, default = 0.1)]
    pub height: T,
    /// Time at each end; the first step comes after it.
    #[field(symbol = "T", unit = "s", range = 1e-3..=1e5, default = 0.5)]
    pub hold_time: T,
}

/// Kind of reference.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "reference")]
pub enum Reference<T> {
    /// A constant position.
    Constant(Constant<T>),
    /// Steps to a height and back.
    Steps(Steps<T>),
    /// One stretch of constant speed.
    Ramp(Ramp<T>),
    /// Triangular or trapezoidal sweeps over the speeds of both directions.
    SpeedSweep(SpeedSweep<T>),
    /// One frequency.
    Sine(Sine<T>),
    /// One frequency after the other.
    Chirp(Chirp<T>),
    /// Many frequencies at once.
    Multisine(Multisine<T>),
    /// A speed whose sign changes pseudo-randomly.
    Prbs(Prbs<T>),
    /// Jerk-limited moves forward and back.
    PointToPoint(PointToPoint<T>),
    /// Jerk-limited moves to random targets.
    RandomStrokes(RandomStrokes<T>),
}

impl Reference<f64> {
    /// Duration [s]; infinite for endless ones.
    pub fn duration(&self) -> f64 {
        match self {
            Reference::Ramp(ramp) => ramp.duration(),
            Reference::SpeedSweep(sweep) => sweep.duration(),
            Reference::Chirp(chirp) => chirp.duration,
            Reference::PointToPoint(moves) => moves.duration(),
            Reference::Constant(_)
            | Reference::Steps(_)
            | Reference::Sine(_)
            | Reference::Multisine(_)
            | Reference::Prbs(_)
            | Reference::RandomStrokes(_) => f64::INFINITY,
        }
    }
}

/// At rest at this position [rad].
const fn resting(position: f64) -> Setpoint<f64> {
    Setpoint { position, velocity: 0.0, acceleration: 0.0 }
}
