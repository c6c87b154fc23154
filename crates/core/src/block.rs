//! What runs in the tick.

use crate::fields::Fields;
use crate::scalar::Scalar;

/// A piece of the signal path: parameters are `&self`, state is handed in, the step cannot fail.
pub trait Block<T: Scalar>: Fields<T> {
    /// Everything that the block remembers; `Copy`, so that snapshots, replay and take-over need no code.
    type State: Fields<T> + Default;
    /// What it reads in a step.
    type Input: Fields<T>;
    /// What it gives in a step.
    type Output: Fields<T>;

    /// One step of `dt` [s].
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output;

    /// The step of a block within another: the recorder of `stickslip-codegen` makes a function call of it.
    #[inline(always)]
    fn run(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        T::call(self, state, input, dt)
    }
}
