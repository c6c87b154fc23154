//! P-PI cascade: the structure of servo drives.

use super::position::{limit_and_integrate, within_limit};
use super::{ControllerInput, ControllerOutput};
use crate::Fields;
use crate::block::Block;
use crate::scalar::Scalar;

/// P control of the position around PI control of the velocity, with feedforward of velocity and inertia:
///
///   ω_ref = K_pos·(r − φ) + ṙ
///   M = K_v·(ω_ref − ω) + I + J·r̈,   İ = K_i·(ω_ref − ω)
///
/// The torque is limited; at the limit the integrator moves only back. It holds the friction at standstill, and hunts
/// where static friction is above kinetic. A non-finite input gives no torque.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Cascade<T> {
    /// Velocity per deviation of the position.
    #[field(symbol = "K_pos", unit = "1/s", range = 0.0..=1e4, default = 15.0)]
    pub position_gain: T,
    /// Torque per deviation of the velocity.
    #[field(symbol = "K_v", unit = "N m s/rad", range = 0.0..=1e3, default = 0.15)]
    pub velocity_gain: T,
    /// Torque per deviation of the velocity and time.
    #[field(symbol = "K_i", unit = "N m/rad", range = 0.0..=1e6, default = 3.0)]
    pub integral_gain: T,
    /// Inertia whose torque is fed forward: motor and load side together; 0: no feedforward.
    #[field(symbol = "J", unit = "kg m^2", range = 0.0..=10.0, default = 1.01e-3)]
    pub inertia: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the cascade.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CascadeState<T> {
    /// Integral part of the torque.
    #[field(symbol = "I", unit = "N m")]
    pub integral: T,
}

impl<T: Scalar> Cascade<T> {
    /// Deviation of the velocity [rad/s], and the torque without its integral part [N m].
    #[inline(always)]
    fn direct(&self, input: ControllerInput<T>) -> (T, T) {
        let reference_velocity =
            self.position_gain * (input.reference_position - input.measured_angle) + input.reference_velocity;
        let deviation = reference_velocity - input.measured_velocity;
        (deviation, self.velocity_gain * deviation + self.inertia * input.reference_acceleration)
    }

    /// The state from which the next step with this input gives this torque [N m], as far as the limit admits it.
    #[inline(always)]
    pub fn take_over(&self, torque: T, input: ControllerInput<T>) -> CascadeState<T> {
        let (_, direct) = self.direct(input.finite());
        let torque = within_limit(super::finite_or(torque, T::of(0.0)), self.torque_limit, input.added_torque);
        CascadeState { integral: torque - direct }
    }
}

impl<T: Scalar> Block<T> for Cascade<T> {
    type State = CascadeState<T>;
    type Input = ControllerInput<T>;
    type Output = ControllerOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        // Inputs are used unchecked here: where one is not finite, `valid` discards the result.
        let (deviation, direct) = self.direct(input);
        let increment = self.integral_gain * deviation * dt;
        let demand = direct + state.integral;
        let (torque, integral) = limit_and_integrate(&input, demand, self.torque_limit, state.integral, increment);
        state.integral = integral;
        ControllerOutput { torque }
    }
}
