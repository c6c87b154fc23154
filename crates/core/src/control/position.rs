//! Common parts of all position controllers, and the choice between them.

use super::{Cascade, CascadeState, LinearController, LinearState, Pid, PidState, Predictive, finite_or, measurable};
use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// Inputs of a position controller: the set-point and the measurements of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ControllerInput<T> {
    /// Set-point of the screw angle.
    #[field(symbol = "r", unit = "rad")]
    pub reference_position: T,
    /// Its first derivative.
    #[field(symbol = "ṙ", unit = "rad/s")]
    pub reference_velocity: T,
    /// Its second derivative.
    #[field(symbol = "r̈", unit = "rad/s^2")]
    pub reference_acceleration: T,
    /// Measured screw angle, unwrapped.
    #[field(symbol = "φ", unit = "rad")]
    pub measured_angle: T,
    /// Measured velocity, of the tacho.
    #[field(symbol = "ω", unit = "rad/s")]
    pub measured_velocity: T,
    /// Torque that friction compensation adds to the controller's: the limit holds for the sum.
    #[field(symbol = "M_c", unit = "N m")]
    pub added_torque: T,
    /// Whether the integral may move.
    #[field(unit = "1", flag, default = 1.0)]
    pub integrates: T,
    /// Share of the integral that is forgotten, where a disturbance observer replaces it.
    #[field(unit = "1", range = 0.0..=1.0)]
    pub forgotten: T,
    /// Torque that friction compensation supplies from the next sample on in place of the integral.
    #[field(unit = "N m")]
    pub taken: T,
}

impl<T: Scalar> ControllerInput<T> {
    /// Whether set-point and measurements are finite and plausible.
    #[inline(always)]
    pub(super) fn valid(&self) -> T::Mask {
        measurable(
            self.reference_position.abs()
                + self.reference_velocity.abs()
                + self.reference_acceleration.abs()
                + self.measured_angle.abs()
                + self.measured_velocity.abs(),
        )
    }

    /// The same with 0 for non-finite numbers, so that all results stay finite.
    #[inline(always)]
    pub(super) fn finite(self) -> Self {
        let zero = T::of(0.0);
        ControllerInput {
            reference_position: finite_or(self.reference_position, zero),
            reference_velocity: finite_or(self.reference_velocity, zero),
            reference_acceleration: finite_or(self.reference_acceleration, zero),
            measured_angle: finite_or(self.measured_angle, zero),
            measured_velocity: finite_or(self.measured_velocity, zero),
            ..self
        }
    }
}

/// Outputs of a position controller.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ControllerOutput<T> {
    /// Torque for the drive motor.
    #[field(symbol = "M_M", unit = "N m")]
    pub torque: T,
}

/// The controller under test.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum PositionController<T> {
    /// P control of the position around PI control of the velocity, as in servo drives.
    Cascade(Cascade<T>),
    /// One PID controller of the position.
    Pid(Pid<T>),
    /// Any other linear controller, as state feedback with an observer.
    Linear(LinearController<T>),
    /// A linear controller with limits over a horizon.
    Predictive(Predictive<T>),
}

/// The states of all controllers; only that of the chosen one moves.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PositionControllerState<T> {
    /// Of the cascade.
    pub cascade: CascadeState<T>,
    /// Of the PID controller.
    pub pid: PidState<T>,
    /// Of the linear controller, with limits or without.
    pub linear: LinearState<T>,
}

impl<T: Scalar> PositionController<T> {
    /// The state from which the next step with this input gives this torque [N m], as far as the limit admits it.
    #[inline(always)]
    pub fn take_over(&self, torque: T, input: ControllerInput<T>) -> PositionControllerState<T> {
        let mut state = PositionControllerState::default();
        match self {
            PositionController::Cascade(cascade) => state.cascade = cascade.take_over(torque, input),
            PositionController::Pid(pid) => state.pid = pid.take_over(torque, input),
            PositionController::Linear(linear) => state.linear = linear.take_over(torque, input),
            PositionController::Predictive(predictive) => state.linear = predictive.take_over(torque, input),
        }
        state
    }
}

impl<T: Scalar> Block<T> for PositionController<T> {
    type State = PositionControllerState<T>;
    type Input = ControllerInput<T>;
    type Output = ControllerOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        match self {
            PositionController::Cascade(cascade) => cascade.run(&mut state.cascade, input, dt),
            PositionController::Pid(pid) => pid.run(&mut state.pid, input, dt),
            PositionController::Linear(linear) => linear.run(&mut state.linear, input, dt),
            PositionController::Predictive(predictive) => predictive.run(&mut state.linear, input, dt),
        }
    }
}

/// Torque and integrator of one step, common to the controllers: limit, conditional integration, and neither torque nor
/// change after a non-finite input. The added torque takes its part of the limit.
#[inline(always)]
pub(super) fn limit_and_integrate<T: Scalar>(
    input: &ControllerInput<T>,
    demand: T,
    torque_limit: T,
    integral: T,
    increment: T,
) -> (T, T) {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let valid = input.valid();
    let torque = valid.select(within_limit(demand, torque_limit, input.added_torque), zero);
    let moves = valid & input.integrates.gt(T::of(0.5));
    let moves = moves & super::may_integrate(demand + input.added_torque, increment, torque_limit);
    let kept = valid.select(one - input.forgotten, one);
    (torque, kept * integral + moves.select(increment, zero) - input.taken)
}

/// `torque` as far as it and what is `added` to it stay within ±`limit` together.
#[inline(always)]
pub(super) fn within_limit<T: Scalar>(torque: T, limit: T, added: T) -> T {
    torque.clamp(-limit - added, limit - added)
}
