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

/// What became of a guarded step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It was taken.
    Ok,
    /// It was taken although an input is NaN or infinite: the block coped, as an observer that coasts.
    InputNotFinite,
    /// It was not taken: the state is as before, every output is 0.
    NotComputed,
}

/// A step for whoever acts on its results: NaN and infinity come neither out nor into the state, whatever goes in.
///
/// A step is not taken whose `dt` [s] is not positive and finite, or that would leave a number of output or state which
/// is not finite. `NAME_step` in the generated C is this function.
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
    // 0·x is 0 unless x is infinite or no number. A chain of comparisons keeps LLVM 22 busy without end.
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
    fn a_block_that_copes_with_a_lost_sensor_goes_on_and_says_so() {
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
        /// What it is multiplied with besides itself.
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
