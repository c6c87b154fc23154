//! The kinds of numbers that are compared, as rows of `f64`.

use stickslip_core::block::{Block, guarded};
use stickslip_core::fields::{Fields, each};
use stickslip_core::scalar::{Dual, Lanes, Scalar};

use super::case::Trajectory;

/// A number with one value or several lanes. Single precision is exact in `f64`.
pub trait Number: Scalar {
    const WIDTH: usize;
    /// The value of each lane in turn.
    fn gather(value: impl FnMut(usize) -> f64) -> Self;
    fn lane(&self, lane: usize) -> f64;
}

impl Number for f64 {
    const WIDTH: usize = 1;
    fn gather(mut value: impl FnMut(usize) -> f64) -> Self {
        value(0)
    }
    fn lane(&self, _lane: usize) -> f64 {
        *self
    }
}

impl Number for f32 {
    const WIDTH: usize = 1;
    fn gather(mut value: impl FnMut(usize) -> f64) -> Self {
        value(0) as f32
    }
    fn lane(&self, _lane: usize) -> f64 {
        f64::from(*self)
    }
}

impl<F: Number + Scalar<Mask = bool>, const N: usize> Number for Lanes<F, N> {
    const WIDTH: usize = N;
    fn gather(mut value: impl FnMut(usize) -> f64) -> Self {
        Lanes(std::array::from_fn(|i| F::gather(|_| value(i))))
    }
    fn lane(&self, lane: usize) -> f64 {
        self.0[lane].lane(0)
    }
}

/// The gradient of a dual is seeded somehow: its value must not depend on it.
impl<const N: usize> Number for Dual<N> {
    const WIDTH: usize = 1;
    fn gather(mut value: impl FnMut(usize) -> f64) -> Self {
        let value = value(0);
        Dual { value, gradient: std::array::from_fn(|i| i as f64 - value) }
    }
    fn lane(&self, _lane: usize) -> f64 {
        self.value
    }
}

/// The numbers of a value.
pub fn numbers<T: Scalar>(value: &impl Fields<T>) -> Vec<T> {
    let (mut copy, mut out) = (*value, Vec::new());
    each(&mut copy, &mut |number: &mut T| out.push(*number));
    out
}

/// The value with other numbers.
pub fn filled<T: Scalar, V: Fields<T>>(template: &V, numbers: impl IntoIterator<Item = T>) -> V {
    let (mut value, mut numbers) = (*template, numbers.into_iter());
    each(&mut value, &mut |number| *number = numbers.next().expect("one number for each field"));
    value
}

/// One step. A separate function, so that each kind of number is compiled once for a block.
#[inline(never)]
pub fn step<T: Scalar, B: Block<T>>(block: &B, state: &mut B::State, input: &B::Input, dt: T) -> B::Output {
    block.step(state, *input, dt)
}

/// Output and state after each step of each trajectory, each trajectory from the state at the start.
pub fn run<T: Number, B: Block<T, Input: Default>>(block: &B, trajectories: &[Trajectory]) -> Vec<Vec<f64>> {
    assert_eq!(trajectories.len() % T::WIDTH, 0);
    let mut out = Vec::new();
    for group in trajectories.chunks(T::WIDTH) {
        let row = |of: &dyn Fn(&Trajectory) -> &[f64]| -> Vec<T> {
            (0..of(&group[0]).len()).map(|i| T::gather(|lane| of(&group[lane])[i])).collect()
        };
        let block = filled(block, row(&|t| &t.parameters));
        let mut state = B::State::default();
        let mut rows = vec![Vec::new(); T::WIDTH];
        for number in 0..group[0].inputs.len() {
            let input = filled(&B::Input::default(), row(&|t| &t.inputs[number]));
            let output = step(&block, &mut state, &input, T::of(group[0].dt));
            let (output, state) = (numbers(&output), numbers(&state));
            for (lane, row) in rows.iter_mut().enumerate() {
                row.extend(output.iter().chain(&state).map(|v| v.lane(lane)));
            }
        }
        out.extend(rows);
    }
    out
}

/// Output, status and state after each guarded step, as [`run`].
pub fn run_guarded<T, B>(block: &B, trajectories: &[Trajectory]) -> Vec<Vec<f64>>
where
    T: Number + Scalar<Mask = bool>,
    B: Block<T, Input: Default>,
{
    let all = |values: &[f64]| values.iter().map(|v| T::of(*v)).collect::<Vec<T>>();
    let row = |trajectory: &Trajectory| {
        let block = filled(block, all(&trajectory.parameters));
        let mut state = B::State::default();
        let mut row = Vec::new();
        for input in &trajectory.inputs {
            let input = filled(&B::Input::default(), all(input));
            let (output, status) = guarded(&block, &mut state, input, T::of(trajectory.dt));
            row.extend(numbers(&output).iter().map(|v| v.lane(0)));
            row.push(f64::from(status as u8));
            row.extend(numbers(&state).iter().map(|v| v.lane(0)));
        }
        row
    };
    trajectories.iter().map(row).collect()
}
