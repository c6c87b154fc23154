//! A set-point with a sequence of speeds.

use stickslip_core::control::reference::Setpoint;

/// A set-point whose speed changes at a limited rate.
#[derive(Clone, Copy, Debug)]
pub struct SpeedRamp {
    /// Present set-point.
    pub setpoint: Setpoint<f64>,
    /// Magnitude of the acceleration [rad/s²].
    acceleration: f64,
    /// Time of a tick [s].
    dt: f64,
}

impl SpeedRamp {
    /// At rest at a position [rad].
    pub fn new(position: f64, acceleration: f64, dt: f64) -> Self {
        SpeedRamp { setpoint: Setpoint { position, ..Setpoint::default() }, acceleration, dt }
    }

    /// Advances by one tick towards a velocity [rad/s].
    pub fn toward(&mut self, velocity: f64) -> Setpoint<f64> {
        let most = self.acceleration * self.dt;
        let change = (velocity - self.setpoint.velocity).clamp(-most, most);
        self.setpoint.position += (self.setpoint.velocity + 0.5 * change) * self.dt;
        self.setpoint.velocity += change;
        self.setpoint.acceleration = change / self.dt;
        self.setpoint
    }

    /// Distance [rad] required to change to another velocity [rad/s].
    pub fn way_to(&self, velocity: f64) -> f64 {
        let now = self.setpoint.velocity;
        0.5 * (now + velocity) * (velocity - now).abs() / self.acceleration
    }
}
