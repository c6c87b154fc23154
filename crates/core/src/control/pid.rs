//! PID control of the position: the baseline of every comparison.

use super::position::{limit_and_integrate, within_limit};
use super::{ControllerInput, ControllerOutput, finite_or};
use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// PID controller with filtered derivative and set-point weights:
///
///   M = K_p·(b·r − φ) + I + K_d·(c·ṙ − ω),   İ = K_i·(r − φ)
///
/// ω is the tacho's velocity or the encoder's derivative, filtered by 1/(1 + T_f·s). The torque is limited; at the limit
/// the integrator moves only back. With K_p = K_v·K_pos + K_i, K_i' = K_i·K_pos and K_d = K_v it is the
/// [`Cascade`](super::Cascade) without its inertia feedforward, as with the defaults; a non-finite input gives no
/// torque.
///
/// Åström and Hägglund, *Advanced PID Control* (2006), chapter 3.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Pid<T> {
    /// Torque per deviation of the position.
    #[field(symbol = "K_p", unit = "N m/rad", range = 0.0..=1e6, default = 5.25)]
    pub proportional_gain: T,
    /// Torque per deviation of the position and time.
    #[field(symbol = "K_i", unit = "N m/(rad s)", range = 0.0..=1e8, default = 45.0)]
    pub integral_gain: T,
    /// Torque per deviation of the velocity.
    #[field(symbol = "K_d", unit = "N m s/rad", range = 0.0..=1e3, default = 0.15)]
    pub derivative_gain: T,
    /// Time constant of the filter of the encoder's derivative.
    #[field(symbol = "T_f", unit = "s", range = 0.0..=1.0, default = 0.002)]
    pub filter_time: T,
    /// Whether the velocity is the tacho's instead of the encoder's derivative.
    #[field(unit = "1", flag, default = 1.0)]
    pub use_tacho: T,
    /// Weight of the set-point in the proportional part; a smaller one overshoots less.
    #[field(symbol = "b", unit = "1", range = 0.0..=1.0, default = 1.0)]
    pub position_weight: T,
    /// Weight of the set-point's velocity in the derivative part.
    #[field(symbol = "c", unit = "1", range = 0.0..=1.0, default = 1.0)]
    pub velocity_weight: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the PID controller.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PidState<T> {
    /// Integral part of the torque.
    #[field(symbol = "I", unit = "N m")]
    pub integral: T,
    /// Measured angle of the sample before.
    #[field(symbol = "φ", unit = "rad")]
    pub previous_angle: T,
    /// Filtered derivative of the measured angle.
    #[field(symbol = "ω_f", unit = "rad/s")]
    pub filtered_velocity: T,
    /// Whether there was a sample before.
    #[field(unit = "1", flag)]
    pub started: T,
}

impl<T: Scalar> Pid<T> {
    /// The torque without its integral part [N m] at this velocity [rad/s].
    #[inline(always)]
    fn direct(&self, input: ControllerInput<T>, velocity: T) -> T {
        self.proportional_gain * (self.position_weight * input.reference_position - input.measured_angle)
            + self.derivative_gain * (self.velocity_weight * input.reference_velocity - velocity)
    }

    /// The state from which the next step with this input gives this torque [N m], as far as the limit admits it. The
    /// derivative filter starts from the measured velocity.
    #[inline(always)]
    pub fn take_over(&self, torque: T, input: ControllerInput<T>) -> PidState<T> {
        let input = input.finite();
        let torque = within_limit(finite_or(torque, T::of(0.0)), self.torque_limit, input.added_torque);
        let filtered_velocity = input.measured_velocity;
        PidState {
            integral: torque - self.direct(input, filtered_velocity),
            previous_angle: input.measured_angle,
            filtered_velocity,
            // The filter holds until its first difference.
            started: T::of(0.0),
        }
    }
}

impl<T: Scalar> Block<T> for Pid<T> {
    type State = PidState<T>;
    type Input = ControllerInput<T>;
    type Output = ControllerOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        // Where an input is not finite, `valid` discards the result.
        let valid = input.valid();
        let one = T::of(1.0);

        let difference = (input.measured_angle - state.previous_angle) / dt;
        let filtered = state.filtered_velocity + dt / (self.filter_time + dt) * (difference - state.filtered_velocity);
        let filtered = state.started.gt(T::of(0.5)).select(filtered, state.filtered_velocity);
        let velocity = self.use_tacho.gt(T::of(0.5)).select(input.measured_velocity, filtered);

        let increment = self.integral_gain * (input.reference_position - input.measured_angle) * dt;
        let demand = self.direct(input, velocity) + state.integral;
        let (torque, integral) = limit_and_integrate(&input, demand, self.torque_limit, state.integral, increment);

        state.integral = integral;
        state.previous_angle = valid.select(input.measured_angle, state.previous_angle);
        state.filtered_velocity = valid.select(filtered, state.filtered_velocity);
        // A derivative over a gap would be a peak: the filter restarts from its value.
        state.started = valid.select(one, T::of(0.0));
        ControllerOutput { torque }
    }
}
