//! Feedforward of friction along the set-point.

use super::{CompensationInput, CompensationOutput, bounded};
use crate::Fields;
use crate::block::Block;
use crate::control::measurable;
use crate::friction::{Contact, Friction, Memory, Stribeck};
use crate::render::smooth_sign;
use crate::scalar::{Mask, Scalar};

/// The modelled curve at the velocity of the set-point when the torque acts:
///
///   M_c = s/√(1 + s²)·M_R(|ṙ⁺|),   s = ṙ⁺/Ω_s,   ṙ⁺ = ṙ + T_p·r̈
///
/// Zero at rest: the controller must hold the friction there.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CurveFeedforward<T> {
    /// The friction model.
    pub friction: Stribeck<T>,
    /// Velocity at which 71 % of it is fed forward.
    #[field(symbol = "Ω_s", unit = "rad/s", range = 1e-4..=10.0, default = 0.05)]
    pub smoothing_velocity: T,
    /// Preview from the sample to the action of its torque: 1.5 sampling times and the lag of the servo amplifier.
    #[field(symbol = "T_p", unit = "s", range = 0.0..=1.0, default = 1.8e-3)]
    pub preview: T,
    /// Largest torque of the compensation.
    #[field(symbol = "M_c,max", unit = "N m", range = 0.0..=1e4, default = 1.4)]
    pub torque_limit: T,
}

impl<T: Scalar> Block<T> for CurveFeedforward<T> {
    type State = ();
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    #[inline(always)]
    fn step(&self, _state: &mut (), input: Self::Input, _dt: T) -> Self::Output {
        let (velocity, _) = input.preview(self.preview);
        let magnitude = self.friction.magnitude(velocity.abs());
        bounded(magnitude * smooth_sign(velocity, self.smoothing_velocity), self.torque_limit)
    }
}

/// The modelled friction along the set-point when the torque acts, with the bristles deflected by the set-point:
///
///   M_c = M_R(z, ṙ⁺),   ż = ṙ⁺ − α·σ₀·|ṙ⁺|·z/g(|ṙ⁺|),   ṙ⁺ = ṙ + T_p·r̈
///
/// It keeps the bristle torque when the set-point comes to rest: it neither causes nor prevents hunting.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionFeedforward<T> {
    /// The friction model.
    pub friction: Friction<T>,
    /// Preview from the sample to the action of its torque: 1.5 sampling times and the lag of the servo amplifier.
    #[field(symbol = "T_p", unit = "s", range = 0.0..=1.0, default = 1.8e-3)]
    pub preview: T,
    /// Largest torque of the compensation.
    #[field(symbol = "M_c,max", unit = "N m", range = 0.0..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the feedforward.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionFeedforwardState<T> {
    /// State of the contact along the set-point.
    pub memory: Memory<T>,
}

impl<T: Scalar> FrictionFeedforward<T> {
    /// Starts with the bristle deflection of a steady motion; returns its torque [N m].
    #[inline(always)]
    pub(super) fn begin(&self, state: &mut FrictionFeedforwardState<T>, input: CompensationInput<T>) -> T {
        let (velocity, angle) = input.preview(self.preview);
        let zero = T::of(0.0);
        let moves = measurable(velocity) & velocity.abs().gt(zero);
        state.memory = Memory::choose(moves, &self.friction.steady_memory(velocity), &Memory::default());
        bounded(moves.select(self.friction.steady_torque(velocity, angle, zero), zero), self.torque_limit).torque
    }
}

impl<T: Scalar> Block<T> for FrictionFeedforward<T> {
    type State = FrictionFeedforwardState<T>;
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let (velocity, angle) = input.preview(self.preview);
        let (zero, before) = (T::of(0.0), state.memory);
        let contact = Contact { velocity, angle, load: zero, arrest: zero };
        let torque = self.friction.correct(&mut state.memory, before.deflection, contact, dt);
        state.memory = Memory::choose(measurable(state.memory.deflection), &state.memory, &before);
        bounded(torque, self.torque_limit)
    }
}
