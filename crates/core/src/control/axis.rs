//! The whole of position control: controller, compensation of friction, and hold against stiction.

use super::compensation::{Compensation, CompensationInput, CompensationState, Hold, HoldInput, HoldOutput, HoldState};
use super::reference::Setpoint;
use super::{
    ControllerInput, ControllerOutput, FilterInput, FilterState, PositionController, PositionControllerState,
    TorqueFilter, finite_or,
};
use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// Time constant with which the difference of two feedforwards fades [s].
const FADING: f64 = 0.01;

/// A position controller with compensation and hold. The controller's torque is reduced where the sum of torques
/// reaches the limit, so that nothing winds up.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AxisControl<T> {
    /// The position controller under test.
    pub controller: PositionController<T>,
    /// Filter of its torque.
    pub filter: TorqueFilter<T>,
    /// Compensation of friction.
    pub compensation: Compensation<T>,
    /// Hold against stiction.
    pub hold: Hold<T>,
}

/// State of position control.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AxisControlState<T> {
    /// Controller.
    pub controller: PositionControllerState<T>,
    /// Filter of its torque.
    pub filter: FilterState<T>,
    /// Compensation.
    pub compensation: CompensationState<T>,
    /// Holding.
    pub hold: HoldState<T>,
    /// Torque of compensation and hold in the sample before.
    #[field(symbol = "M_c", unit = "N m")]
    pub added_torque: T,
    /// Difference of the previous feedforward to the present one, which fades out.
    #[field(symbol = "M_f", unit = "N m")]
    pub fading_torque: T,
    /// Torque of the sample before, active in this one.
    #[field(symbol = "M_M", unit = "N m")]
    pub torque: T,
    /// Torque active in the sample before.
    #[field(symbol = "M_M", unit = "N m")]
    pub applied_torque: T,
}

/// Inputs of position control: set-point and measurements.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AxisControlInput<T> {
    /// Set-point.
    pub reference: Setpoint<T>,
    /// Measured screw angle, unwrapped.
    #[field(symbol = "φ", unit = "rad")]
    pub measured_angle: T,
    /// Measured velocity, of the tacho.
    #[field(symbol = "ω", unit = "rad/s")]
    pub measured_velocity: T,
}

impl<T: Scalar> AxisControlInput<T> {
    /// Inputs of the controller without any other action.
    #[inline(always)]
    pub fn controller(&self) -> ControllerInput<T> {
        ControllerInput {
            reference_position: self.reference.position,
            reference_velocity: self.reference.velocity,
            reference_acceleration: self.reference.acceleration,
            measured_angle: self.measured_angle,
            measured_velocity: self.measured_velocity,
            ..ControllerInput::default()
        }
    }
}

impl<T: Scalar> From<PositionController<T>> for AxisControl<T> {
    /// The controller alone.
    fn from(controller: PositionController<T>) -> Self {
        AxisControl {
            controller,
            filter: TorqueFilter::Nothing,
            compensation: Compensation::Nothing,
            hold: Hold::Nothing,
        }
    }
}

impl<T: Scalar> AxisControl<T> {
    /// The state from which the next step with this input gives this torque [N m], as far as the limit admits it.
    ///
    /// `last` is the state before, of another control or of an inactive one. The same compensation continues from its
    /// state. From one feedforward to another the controller keeps its share of the torque, and the difference of both
    /// fades. From or to any other kind the integral takes the difference: it held the friction, or must hold it from
    /// now on.
    #[inline(always)]
    pub fn take_over(
        &self,
        torque: T,
        input: AxisControlInput<T>,
        last: &AxisControlState<T>,
        from: Option<&AxisControl<T>>,
    ) -> AxisControlState<T> {
        let torque = finite_or(torque, T::of(0.0));
        // Inactive parts keep their state.
        let mut state = AxisControlState { torque, applied_torque: torque, ..*last };
        let stays = from.is_some_and(|from| from.compensation == self.compensation);
        if !stays {
            let added = last.added_torque + last.fading_torque;
            state.added_torque = self.compensation.begin(&mut state.compensation, input.compensation(torque, torque));
            let fades = from.is_some_and(|from| from.compensation.feeds_forward() && self.compensation.feeds_forward());
            state.fading_torque = if fades { added - state.added_torque } else { T::of(0.0) };
        }
        if let (Hold::Stiction(_), None) = (self.hold, from) {
            state.hold = HoldState::default();
        }
        let added_torque = state.added_torque + state.fading_torque;
        let controlled = ControllerInput { added_torque, ..input.controller() };
        state.controller = self.controller.take_over(torque - added_torque, controlled);
        state.filter = self.filter.settled(torque - added_torque);
        state
    }
}

impl<T: Scalar> AxisControlInput<T> {
    /// Inputs of compensation after a sample with the one torque, at the start of a sample with the other [N m].
    #[inline(always)]
    fn compensation(&self, applied_torque: T, pending_torque: T) -> CompensationInput<T> {
        let AxisControlInput { reference, measured_velocity, measured_angle } = *self;
        CompensationInput { reference, measured_velocity, measured_angle, applied_torque, pending_torque }
    }
}

impl<T: Scalar> Block<T> for AxisControl<T> {
    type State = AxisControlState<T>;
    type Input = AxisControlInput<T>;
    type Output = ControllerOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let felt = input.compensation(state.applied_torque, state.torque);
        let compensation = self.compensation.run(&mut state.compensation, felt, dt);
        let hold = match self.hold {
            Hold::Nothing => HoldOutput { torque: T::of(0.0), integrates: T::of(1.0) },
            Hold::Stiction(stiction) => {
                let held = HoldInput { reference: input.reference, measured_angle: input.measured_angle };
                stiction.run(&mut state.hold, held, dt)
            }
        };
        let added_torque = compensation.torque + hold.torque + state.fading_torque;
        let controlled = ControllerInput {
            added_torque,
            integrates: hold.integrates,
            forgotten: self.compensation.takes_the_integral(),
            taken: compensation.taken,
            ..input.controller()
        };
        let own = self.controller.run(&mut state.controller, controlled, dt);
        let own = match self.filter {
            TorqueFilter::Nothing => own,
            TorqueFilter::Notch(notch) => {
                notch.run(&mut state.filter, FilterInput { torque: own.torque, added_torque }, dt)
            }
        };
        // Without a finite input the torque is 0, as with the controller alone.
        let torque = controlled.valid().select(own.torque + added_torque, T::of(0.0));
        state.added_torque = compensation.torque + hold.torque;
        state.fading_torque = state.fading_torque - dt / (T::of(FADING) + dt) * state.fading_torque;
        state.applied_torque = state.torque;
        state.torque = torque;
        ControllerOutput { torque }
    }
}
