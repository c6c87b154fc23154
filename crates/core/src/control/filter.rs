//! Filter of the controller's torque.

use super::position::within_limit;
use super::{ControllerOutput, finite_or};
use crate::Fields;
use crate::block::Block;
use crate::scalar::Scalar;

/// Filter of the controller's torque. Compensation is added behind it: it is not part of the vibrating loop.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum TorqueFilter<T> {
    /// None.
    Nothing,
    /// A notch at a resonance of the coupling.
    Notch(Notch<T>),
}

/// A notch, of second order and with the gain 1 at rest:
///
///   y = b₀·u + s₁,   s₁⁺ = b₁·u − a₁·y + s₂,   s₂⁺ = b₂·u − a₂·y
///
/// Its coefficients are designed for one sampling time. Its output is within the limit of the torque, like its input.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Notch<T> {
    /// Coefficients of the inputs, the newest first.
    #[field(symbol = "b", unit = "1", range = -2.0..=2.0)]
    pub numerator: [T; 3],
    /// Coefficients of the outputs one and two samples ago.
    #[field(symbol = "a", unit = "1", range = -2.0..=2.0)]
    pub denominator: [T; 2],
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the filter.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FilterState<T> {
    /// Contributions of earlier samples to the next one and to the one after it.
    #[field(symbol = "s", unit = "N m")]
    pub memory: [T; 2],
}

/// Inputs of the filter.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FilterInput<T> {
    /// Torque of the controller.
    #[field(symbol = "M", unit = "N m")]
    pub torque: T,
    /// Torque that is added behind it: the limit holds for the sum.
    #[field(symbol = "M_c", unit = "N m")]
    pub added_torque: T,
}

impl<T: Scalar> TorqueFilter<T> {
    /// The state in which it passes this torque [N m] unchanged.
    #[inline(always)]
    pub(super) fn settled(&self, torque: T) -> FilterState<T> {
        match self {
            TorqueFilter::Nothing => FilterState::default(),
            TorqueFilter::Notch(notch) => {
                let ([b0, _, b2], [_, a2]) = (notch.numerator, notch.denominator);
                FilterState { memory: [(T::of(1.0) - b0) * torque, (b2 - a2) * torque] }
            }
        }
    }
}

impl<T: Scalar> Block<T> for Notch<T> {
    type State = FilterState<T>;
    type Input = FilterInput<T>;
    type Output = ControllerOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, _dt: T) -> Self::Output {
        let ([b0, b1, b2], [a1, a2]) = (self.numerator, self.denominator);
        let torque = finite_or(input.torque, T::of(0.0));
        let passed = b0 * torque + state.memory[0];
        state.memory = [b1 * torque - a1 * passed + state.memory[1], b2 * torque - a2 * passed];
        ControllerOutput { torque: within_limit(passed, self.torque_limit, input.added_torque) }
    }
}
