//! From blocks to linear systems, with exact slopes.

use nalgebra::DMatrix;
use stickslip_core::block::Block;
use stickslip_core::fields::{Fields, each};
use stickslip_core::scalar::{Dual, Scalar};

use super::{Port, StateSpace};
use stickslip_base::Error;
use stickslip_base::parameters::{Value, flatten};

/// Derivatives taken at once.
pub(crate) const WIDTH: usize = 6;

/// A number with [`WIDTH`] derivatives.
pub(crate) type Wide = Dual<WIDTH>;

/// A block for small deviations from a state and an input: one sample of `dt` [s] is one step of it.
///
/// Slopes are those of dual numbers, exact; the state need not be in equilibrium. Terms that switch at a threshold of a
/// signal stay on their side, and converters and counters have the slope 0.
///
/// # Errors
/// A slope that is not finite.
pub fn linearise<B>(block: &B, state: &B::State, input: &B::Input, dt: f64) -> Result<StateSpace, Error>
where
    B: Block<f64>,
    B::With<Wide>:
        Block<Wide, State = <B::State as Fields<f64>>::With<Wide>, Input = <B::Input as Fields<f64>>::With<Wide>>,
{
    let wide: B::With<Wide> = block.map(&mut Dual::of);
    let states = count(state);
    let inputs = count(input);
    let system = slopes(states, inputs, dt, |mut seed| {
        let (mut state, input) = (state.map(&mut seed), input.map(&mut seed));
        let output = wide.step(&mut state, input, Dual::of(dt));
        let mut numbers = Vec::new();
        keep(&state, &mut numbers);
        keep(&output, &mut numbers);
        numbers
    })?;
    let mut copy = *state;
    let output = block.step(&mut copy, *input, dt);
    Ok(system.named(ports(input), ports(&output)))
}

/// Number of values of a struct.
pub(crate) fn count<F: Fields<f64>>(values: &F) -> usize {
    let (mut copy, mut count) = (*values, 0);
    each(&mut copy, &mut |_: &mut f64| count += 1);
    count
}

/// Appends the numbers of a struct.
pub(crate) fn keep<F: Fields<Wide>>(values: &F, numbers: &mut Vec<Wide>) {
    let mut copy = *values;
    each(&mut copy, &mut |value: &mut Wide| numbers.push(*value));
}

/// Name and unit of each number, without choices.
fn ports<F: Fields<f64>>(values: &F) -> Vec<Port> {
    let numbers = flatten(values).into_iter().filter(|entry| matches!(entry.value, Value::Number(_)));
    numbers.map(|entry| Port::new(entry.path, entry.field.unit)).collect()
}

/// The slopes of a step. `run` has its states, then its inputs seeded in this order, and returns the new states and
/// then the outputs; it is called once for each [`WIDTH`] of them.
pub(crate) fn slopes(
    states: usize,
    inputs: usize,
    dt: f64,
    mut run: impl FnMut(&mut dyn FnMut(f64) -> Wide) -> Vec<Wide>,
) -> Result<StateSpace, Error> {
    let columns = states + inputs;
    let mut all = DMatrix::zeros(0, columns);
    for first in (0..columns.max(1)).step_by(WIDTH) {
        let mut index = 0usize;
        let results = run(&mut |value| {
            let slot = index.wrapping_sub(first);
            index += 1;
            if slot < WIDTH { Dual::variable(value, slot) } else { Dual::of(value) }
        });
        if first == 0 {
            all = DMatrix::zeros(results.len(), columns);
        }
        for (row, value) in results.iter().enumerate() {
            for slot in 0..WIDTH.min(columns - first) {
                all[(row, first + slot)] = value.gradient[slot];
            }
        }
    }
    let outputs = all.nrows() - states;
    let part = |row, column, rows, columns| all.view((row, column), (rows, columns)).into_owned();
    StateSpace::new(
        part(0, 0, states, states),
        part(0, states, states, inputs),
        part(states, 0, outputs, states),
        part(states, states, outputs, inputs),
        Some(dt),
    )
}
