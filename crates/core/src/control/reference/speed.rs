//! Constant speeds and sweeps over speeds, for friction measurements.

use super::{Setpoint, resting};
use crate::Fields;

/// Accelerates, holds a speed, stops. The acceleration jumps; the velocity does not.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Ramp<T> {
    /// The speed; negative runs backwards.
    #[field(symbol = "Ω", unit = "rad/s", range = -1e3..=1e3, default = 10.0)]
    pub velocity: T,
    /// Acceleration to the speed and back to rest.
    #[field(symbol = "α", unit = "rad/s^2", range = 1e-3..=1e5, default = 200.0)]
    pub acceleration: T,
    /// Time at constant speed.
    #[field(symbol = "T", unit = "s", range = 0.0..=1e5, default = 2.0)]
    pub hold_time: T,
}

/// Sweeps from rest to a speed and back to rest, then the same backwards: a triangle of speed, or a trapezoid with a
/// hold time. Ends at its start position. The acceleration jumps; the velocity does not.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct SpeedSweep<T> {
    /// The highest speed.
    #[field(symbol = "Ω", unit = "rad/s", range = 1e-3..=1e3, default = 20.0)]
    pub peak_velocity: T,
    /// Acceleration of the sweep.
    #[field(symbol = "α", unit = "rad/s^2", range = 1e-3..=1e5, default = 10.0)]
    pub acceleration: T,
    /// Time at the highest speed; 0 sweeps a triangle.
    #[field(symbol = "T", unit = "s", range = 0.0..=1e5)]
    pub hold_time: T,
    /// Number of sweeps, both directions together.
    #[field(symbol = "n", unit = "1", whole, range = 1.0..=1e6, default = 1.0)]
    pub sweeps: T,
}

impl Ramp<f64> {
    /// Time until standstill [s].
    pub fn duration(&self) -> f64 {
        2.0 * (self.velocity / self.acceleration).abs() + self.hold_time
    }

    /// The set-point at a time [s].
    pub(super) fn at(&self, time: f64) -> Setpoint<f64> {
        lobe(self.velocity, self.acceleration, self.hold_time, time)
    }
}

impl SpeedSweep<f64> {
    fn lobe_time(&self) -> f64 {
        2.0 * self.peak_velocity / self.acceleration + self.hold_time
    }

    /// Time until standstill [s].
    pub fn duration(&self) -> f64 {
        2.0 * self.lobe_time() * self.sweeps
    }

    /// The set-point at a time [s].
    pub(super) fn at(&self, time: f64) -> Setpoint<f64> {
        let length = self.lobe_time();
        let number = libm::floor(time / length);
        if number >= 2.0 * self.sweeps {
            return resting(0.0);
        }
        let within = time - number * length;
        let forth = lobe(self.peak_velocity, self.acceleration, self.hold_time, within);
        if number % 2.0 == 0.0 {
            return forth;
        }
        let far = lobe(self.peak_velocity, self.acceleration, self.hold_time, length).position;
        Setpoint { position: far - forth.position, velocity: -forth.velocity, acceleration: -forth.acceleration }
    }
}

/// One trapezoid of speed: `time` [s] after its start from rest.
fn lobe(velocity: f64, acceleration: f64, hold_time: f64, time: f64) -> Setpoint<f64> {
    let rise = (velocity / acceleration).abs();
    let total = 2.0 * rise + hold_time;
    let acceleration = if velocity < 0.0 { -acceleration } else { acceleration };
    if time >= total {
        resting(velocity * (rise + hold_time))
    } else if time < rise {
        Setpoint { position: 0.5 * acceleration * time * time, velocity: acceleration * time, acceleration }
    } else if time < rise + hold_time {
        Setpoint { position: velocity * (time - 0.5 * rise), velocity, acceleration: 0.0 }
    } else {
        let left = total - time;
        let position = velocity * (rise + hold_time) - 0.5 * acceleration * left * left;
        Setpoint { position, velocity: acceleration * left, acceleration: -acceleration }
    }
}
