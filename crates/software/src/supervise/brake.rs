//! The brake that stops the screw without controller, observer or law.
//!
//! It uses one velocity and one torque: no position, no observer, no controller under test.
//!
//!   M = −sat(K_b·(Ω − e), M_b) − K_b·(e + 20 1/s·∫e dt),   e = Ω − sat(Ω, Ω_r)
//!
//! Ω_r falls with a_stop from the speed at the start of the stop.
//!
//! The first term decelerates with a_stop and decreases linearly to 0 at rest, without chatter; friction adds to it.
//! The second term acts only if the screw stops more slowly than that: against a pushing load, which it then holds.

use stickslip_core::Fields;

/// Factor of the brake's torque, which compensates the distance lost by lag and by the linear end.
const AUTHORITY: f64 = 1.25;

/// Rate of the integral against a push [1/s], as in the speed controller of a friction measurement.
const INTEGRAL_RATE: f64 = 20.0;

/// Time constant with which the torque against a push is released at standstill [s]. Under a lasting push the screw
/// creeps, and the brake takes the push up again.
const RELEASE_TIME: f64 = 0.5;
/// Share of the drive's largest torque above which the load counts as pushing.
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
    /// This deceleration [rad/s²], limited to what the torque of the drive permits.
    pub fn deceleration(&self, wanted: f64) -> f64 {
        wanted.min(self.torque_limit / (AUTHORITY * self.inertia))
    }

    /// Releases the torque against a push while the screw is at rest; returns whether the load still pushes.
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
