//! The brake that stops the screw without controller, observer or law.
//!
//! No position, no observer, no controller under test: one velocity and one torque.
//!
//!   M = −sat(K_b·(Ω − e), M_b) − K_b·(e + 20 1/s·∫e dt),   e = Ω − Ω kept within ±Ω_r
//!
//! with Ω_r, which falls from the first speed with a_stop.
//!
//! The first part is a deceleration of a_stop that ends linearly, without chatter, at rest; friction adds to it. The
//! second one acts only where the screw is slower to stop than that: against a load that pushes, and holds it then.

use crate::Fields;

/// Additional share of the brake's torque: it compensates the distance lost by lag and linear end.
const AUTHORITY: f64 = 1.25;

/// How fast a push is made up for [1/s], as by the controller that holds a speed in a friction measurement.
const INTEGRAL_RATE: f64 = 20.0;

/// Time in which it is let go of at standstill [s]: a push that lasts makes the screw creep, and is taken up again.
const RELEASE_TIME: f64 = 0.5;
/// Share of the drive's torque above which a push counts as a failure.
const RELEASED: f64 = 0.05;

/// Parameters of the brake.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Brake<T> {
    /// Total inertia.
    #[field(symbol = "J", unit = "kg m^2", range = 1e-9..=1e3, default = 1.01e-3)]
    pub inertia: T,
    /// Torque per velocity of the tacho.
    #[field(symbol = "K_b", unit = "N m s/rad", range = 0.0..=1e3, default = 0.1)]
    pub tacho_gain: T,
    /// Torque per velocity of the encoder, which sits behind the coupling.
    #[field(symbol = "K_b,e", unit = "N m s/rad", range = 0.0..=1e3, default = 0.05)]
    pub encoder_gain: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

impl Brake<f64> {
    /// Available part of this deceleration [rad/s²].
    pub fn deceleration(&self, wanted: f64) -> f64 {
        wanted.min(self.torque_limit / (AUTHORITY * self.inertia))
    }

    /// Lets go of a push where the screw stands; whether it is still there.
    pub(super) fn release(&self, held: &mut f64, dt: f64) -> bool {
        *held -= *held * dt / (RELEASE_TIME + dt);
        held.abs() > RELEASED * self.torque_limit
    }

    /// Torque [N m] at a velocity [rad/s] with this gain [N m s/rad], where the speed should have come down to `ramp`
    /// [rad/s] with this deceleration [rad/s²]; `held` is the torque against a push [N m].
    pub(super) fn torque(
        &self,
        held: &mut f64,
        (velocity, gain): (f64, f64),
        (ramp, deceleration): (f64, f64),
        dt: f64,
    ) -> f64 {
        let (most, limit) = (AUTHORITY * self.inertia * deceleration, self.torque_limit);
        let within = velocity.clamp(-ramp, ramp);
        let excess = velocity - within;
        *held = (*held - gain * INTEGRAL_RATE * excess * dt).clamp(-limit, limit);
        (*held - (gain * within).clamp(-most, most) - gain * excess).clamp(-limit, limit)
    }
}
