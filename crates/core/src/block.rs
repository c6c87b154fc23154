//! Blocks of the tick.

use crate::fields::Fields;
use crate::scalar::Scalar;

/// A piece of the signal path: parameters are `&self`, the state is an argument, the step cannot fail.
pub trait Block<T: Scalar>: Fields<T> {
    /// State of the block; `Copy`, so that snapshots, replay and bumpless transfer need no code.
    type State: Fields<T> + Default;
    /// Inputs of a step.
    type Input: Fields<T>;
    /// Outputs of a step.
    type Output: Fields<T>;

    /// One step of `dt` [s].
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output;

    /// The step of a block within another: the recorder of `stickslip-codegen` turns it into a function call.
    #[inline(always)]
    fn run(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        T::call(self, state, input, dt)
    }
}

/// Result of a guarded step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The step was computed.
    Ok,
    /// The step was computed although an input is NaN or infinite: the block handles it, as an observer that coasts.
    InputNotFinite,
    /// The step was not computed: the state is unchanged, every output is 0.
    NotComputed,
}

/// A step that never returns NaN or infinity, nor leaves them in the state, for any input.
///
/// A step is refused if its `dt` [s] is not positive and finite, or if it would leave a non-finite number in output or
/// state. `NAME_step` in the generated C is this function.
pub fn guarded<T: Scalar<Mask = bool>, B: Block<T>>(
    block: &B,
    state: &mut B::State,
    input: B::Input,
    dt: T,
) -> (B::Output, Status) {
    let before = *state;
    let output = block.step(state, input, dt);
    let possible = is_finite(dt) && dt.gt(T::of(0.0));
    if !(possible && all_finite(state) && all_finite(&output)) {
        *state = before;
        (output.merge(&output, &mut zero), Status::NotComputed)
    } else if all_finite(&input) {
        (output, Status::Ok)
    } else {
        (output, Status::InputNotFinite)
    }
}

fn is_finite<T: Scalar>(value: T) -> T::Mask {
    value.abs().lt(T::of(f64::INFINITY))
}

fn zero<T: Scalar>(_: T, _: T) -> T {
    T::of(0.0)
}

fn all_finite<T: Scalar<Mask = bool>, V: Fields<T>>(value: &V) -> bool {
    // 0·x is 0 unless x is infinite or NaN. A chain of comparisons makes LLVM 22 very slow.
    let mut sum = T::of(0.0);
    let _ = value.merge(value, &mut adding_zeros(&mut sum));
    is_finite(sum)
}

/// Adds 0·x to a sum: one closure for all structs.
fn adding_zeros<T: Scalar>(sum: &mut T) -> impl FnMut(T, T) -> T {
    |number, _| {
        *sum += number * T::of(0.0);
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{VelocityObserver, VelocityObserverInput, VelocityObserverState};

    fn step(state: &mut VelocityObserverState<f64>, angle: f64, acceleration: f64, dt: f64) -> (f64, Status) {
        let input = VelocityObserverInput { angle, acceleration };
        let (output, status) = guarded(&VelocityObserver::<f64>::default(), state, input, dt);
        (output.angle, status)
    }

    #[test]
    fn a_guarded_step_is_the_step_as_long_as_it_is_finite() {
        let (mut state, mut plain) = (VelocityObserverState::default(), VelocityObserverState::default());
        let (angle, status) = step(&mut state, 0.5, 1.0, 1e-3);
        let input = VelocityObserverInput { angle: 0.5, acceleration: 1.0 };
        let expected = VelocityObserver::<f64>::default().step(&mut plain, input, 1e-3);
        assert_eq!((angle, status, state), (expected.angle, Status::Ok, plain));
    }

    #[test]
    fn a_block_that_handles_a_lost_sensor_goes_on_and_reports_it() {
        let mut state = VelocityObserverState::default();
        step(&mut state, 0.5, 1.0, 1e-3);
        let before = state;
        let (angle, status) = step(&mut state, f64::NAN, 1.0, 1e-3);
        assert!(angle.is_finite() && state != before);
        assert_eq!(status, Status::InputNotFinite);
    }

    #[test]
    fn a_step_that_cannot_be_computed_leaves_the_state_alone() {
        let mut state = VelocityObserverState::default();
        step(&mut state, 0.5, 1.0, 1e-3);
        let before = state;
        for dt in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
            assert_eq!(step(&mut state, 0.5, 1.0, dt), (0.0, Status::NotComputed), "dt = {dt}");
            assert_eq!(state, before);
        }
        let power = Power::<f64>::default();
        assert_eq!(guarded(&power, &mut (), 1e200, 1e-3), (0.0, Status::NotComputed));
        assert_eq!(guarded(&power, &mut (), 3.0, 1e-3), (9.0, Status::Ok));
    }

    /// A block that overflows.
    #[derive(Clone, Copy, Debug, PartialEq, crate::Fields)]
    struct Power<T> {
        /// The second factor.
        #[field(unit = "1", default = 1.0)]
        factor: T,
    }

    impl Block<f64> for Power<f64> {
        type State = ();
        type Input = f64;
        type Output = f64;

        fn step(&self, _state: &mut (), input: f64, _dt: f64) -> f64 {
            self.factor * input * input
        }
    }
}
