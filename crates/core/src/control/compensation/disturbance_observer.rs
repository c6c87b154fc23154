//! Disturbance observer: torque that the drive's inertia does not explain.

use super::{CompensationInput, CompensationOutput, bounded};
use crate::Fields;
use crate::block::Block;
use crate::control::{finite_or, measurable};
use crate::scalar::{Mask, Scalar};

/// Observer of the torque that brakes a rigid drive, from the tacho and the motor's torque:
///
///   ω̄ = ω̂ + T/J·(M_M − M̂),   e = ω − ω̄,   ω̂⁺ = ω̄ + l_ω·e,   M̂⁺ = M̂ − l_M·e
///
/// A double pole at e^(−p·T) has l_ω = 1 − e^(−2·p·T) and l_M = (1 − e^(−p·T))²·J/T. The compensation is M̂. It is an
/// integral action, so the controller's integral fades while it is active. K. Ohnishi, M. Shibata, T. Murakami,
/// IEEE/ASME Trans. Mechatronics 1 (1996) 56.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DisturbanceObserver<T> {
    /// Inertia of motor and load side together.
    #[field(symbol = "J", unit = "kg m^2", range = 1e-9..=10.0, default = 1.01e-3)]
    pub inertia: T,
    /// Correction of the velocity.
    #[field(symbol = "l_ω", unit = "1", range = 0.0..=1.0, default = 0.181)]
    pub velocity_gain: T,
    /// Correction of the torque.
    #[field(symbol = "l_M", unit = "N m s/rad", range = 0.0..=1e4, default = 9.1e-3)]
    pub torque_gain: T,
    /// Largest torque of the compensation.
    #[field(symbol = "M_c,max", unit = "N m", range = 0.0..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the disturbance observer.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DisturbanceObserverState<T> {
    /// Velocity at the next sample.
    #[field(symbol = "ω̂", unit = "rad/s")]
    pub velocity: T,
    /// Torque that brakes the drive.
    #[field(symbol = "M̂", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> DisturbanceObserver<T> {
    /// From a steady motion: all applied torque balances the disturbance.
    #[inline(always)]
    pub(super) fn begin(&self, state: &mut DisturbanceObserverState<T>, input: CompensationInput<T>) -> T {
        state.velocity = finite_or(input.measured_velocity, T::of(0.0));
        state.torque = bounded(input.applied_torque, self.torque_limit).torque;
        state.torque
    }
}

impl<T: Scalar> Block<T> for DisturbanceObserver<T> {
    type State = DisturbanceObserverState<T>;
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        // The model up to this sample, then its error.
        let expected = state.velocity + dt / self.inertia * (input.applied_torque - state.torque);
        let error = input.measured_velocity - expected;
        let velocity = expected + self.velocity_gain * error;
        // Beyond the limit it would wind up.
        let torque = (state.torque - self.torque_gain * error).clamp(-self.torque_limit, self.torque_limit);
        let valid = measurable(velocity.abs() + torque.abs());
        state.velocity = valid.select(velocity, state.velocity);
        state.torque = valid.select(torque, state.torque);
        bounded(valid.select(torque, T::of(0.0)), self.torque_limit)
    }
}
