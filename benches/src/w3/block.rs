//! The tick of the paper's load-motor control as one block.

use stickslip_core::Fields;
use stickslip_core::block::Block;
use stickslip_core::control::{
    Cascade, CascadeState, ControllerInput, CurrentControl, CurrentControlInput, CurrentControlState, VelocityObserver,
    VelocityObserverInput, VelocityObserverState,
};
use stickslip_core::render::{DifferenceTorque, LawInput};
use stickslip_core::scalar::Scalar;

/// Three-state observer, difference of two Stribeck curves, PI current control and P-PI cascade: figures 7 and 8.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(super) struct PaperTick<T> {
    /// Observer.
    pub(super) observer: VelocityObserver<T>,
    /// Rendering law.
    pub(super) law: DifferenceTorque<T>,
    /// Current control.
    pub(super) current: CurrentControl<T>,
    /// Position controller.
    pub(super) cascade: Cascade<T>,
}

/// State of the tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(super) struct PaperTickState<T> {
    /// Observer.
    pub(super) observer: VelocityObserverState<T>,
    /// Current control.
    pub(super) current: CurrentControlState<T>,
    /// Position controller.
    pub(super) cascade: CascadeState<T>,
}

/// Input of the tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(super) struct PaperTickInput<T> {
    /// Set-point and measurements of the position controller.
    pub(super) position: ControllerInput<T>,
    /// Acceleration of the carriage.
    #[field(unit = "m/s^2")]
    pub(super) acceleration: T,
    /// Current of the load motor.
    #[field(unit = "A")]
    pub(super) current: T,
}

/// Output of the tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub(super) struct PaperTickOutput<T> {
    /// Command of the load amplifier.
    #[field(unit = "V")]
    pub(super) amplifier_voltage: T,
    /// Command of the drive motor.
    #[field(unit = "N m")]
    pub(super) torque: T,
}

impl<T: Scalar> Block<T> for PaperTick<T> {
    type State = PaperTickState<T>;
    type Input = PaperTickInput<T>;
    type Output = PaperTickOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let measurement =
            VelocityObserverInput { angle: input.position.measured_angle, acceleration: input.acceleration };
        let estimated_velocity = self.observer.run(&mut state.observer, measurement, dt).velocity;
        let difference = self.law.run(&mut (), LawInput { estimated_velocity, ..LawInput::default() }, dt).torque;
        let demand = CurrentControlInput {
            reference_current: difference / self.current.torque_constant,
            measured_current: input.current,
            estimated_velocity,
        };
        let load = self.current.run(&mut state.current, demand, dt);
        let drive = self.cascade.run(&mut state.cascade, input.position, dt);
        PaperTickOutput { amplifier_voltage: load.amplifier_input, torque: drive.torque }
    }
}
