//! A set-point that goes at one speed after another.

use stickslip_core::control::reference::Setpoint;

/// A set-point whose speed changes at a limited rate.
#[derive(Clone, Copy, Debug)]
pub struct SpeedRamp {
    /// Where it is.
    pub setpoint: Setpoint<f64>,
    /// How fast its velocity changes [rad/s²].
    acceleration: f64,
    /// Time of a tick [s].
    dt: f64,
}

impl SpeedRamp {
    /// At rest at a position [rad].
    pub fn new(position: f64, acceleration: f64, dt: f64) -> Self {
        SpeedRamp { setpoint: Setpoint { position, ..Setpoint::default() }, acceleration, dt }
    }

    /// One tick on, towards a velocity [rad/s].
    pub fn toward(&mut self, velocity: f64) -> Setpoint<f64> {
        let most = self.acceleration * self.dt;
        let change = (velocity - self.setpoint.velocity).clamp(-most, most);
        self.setpoint.position += (self.setpoint.velocity + 0.5 * change) * self.dt;
        self.setpoint.velocity += change;
        self.setpoint.acceleration = change / self.dt;
        self.setpoint
    }

    /// Way [rad] that it takes to change to another velocity [rad/s].
    pub fn way_to(&self, velocity: f64) -> f64 {
        let now = self.setpoint.velocity;
        0.5 * (now + velocity) * (velocity - now).abs() / self.acceleration
    }
}
