//! The observer of Friedland and Park for Coulomb friction.

use super::{CompensationInput, CompensationOutput, bounded};
use crate::Fields;
use crate::block::Block;
use crate::control::{finite_or, measurable};
use crate::scalar::{Mask, Scalar};

/// Estimates the level of Coulomb friction, reduced order, from the tacho and the motor's torque:
///
///   F̂ = ζ − λ·J·|ω|,   ζ̇ = λ·(M_M·sgn ω − F̂),   M_c = F̂·sgn ω
///
/// The error decays with λ for any motion. The sign is that of a noisy velocity: it hunts at rest and at creeping
/// speed. B. Friedland, Y.-J. Park, IEEE TAC 37 (1992) 1609, with the exponent 1.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FriedlandPark<T> {
    /// Inertia of motor and load side together.
    #[field(symbol = "J", unit = "kg m^2", range = 1e-9..=10.0, default = 1.01e-3)]
    pub inertia: T,
    /// Rate of the estimate; above 100 1/s noise dominates.
    #[field(symbol = "λ", unit = "1/s", range = 0.1..=1000.0, default = 100.0)]
    pub rate: T,
    /// Largest torque of the compensation.
    #[field(symbol = "M_c,max", unit = "N m", range = 0.0..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the observer.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FriedlandParkState<T> {
    /// The estimate plus the share of the velocity.
    #[field(symbol = "ζ", unit = "N m")]
    pub level: T,
}

impl<T: Scalar> FriedlandPark<T> {
    /// From a steady motion: all applied torque is friction.
    #[inline(always)]
    pub(super) fn begin(&self, state: &mut FriedlandParkState<T>, input: CompensationInput<T>) -> T {
        let zero = T::of(0.0);
        let velocity = finite_or(input.measured_velocity, zero);
        let level = (finite_or(input.applied_torque, zero) * velocity.sign()).clamp(zero, self.torque_limit);
        state.level = level + self.rate * self.inertia * velocity.abs();
        level * velocity.sign()
    }
}

impl<T: Scalar> Block<T> for FriedlandPark<T> {
    type State = FriedlandParkState<T>;
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let side = input.measured_velocity.sign();
        let taken = self.rate * self.inertia * input.measured_velocity.abs();
        let estimate = state.level - taken;
        let share = (self.rate * dt).min(T::of(1.0));
        let level = state.level + share * (input.applied_torque * side - estimate);
        // Friction brakes: between 0 and the limit.
        let bounded_level = level.clamp(taken, taken + self.torque_limit);
        state.level = measurable(bounded_level).select(bounded_level, state.level);
        bounded(estimate.clamp(T::of(0.0), self.torque_limit) * side, self.torque_limit)
    }
}
