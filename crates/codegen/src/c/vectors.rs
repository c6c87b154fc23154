//! The vectors of the self-test: the results of the model in a short run with all kinds of inputs.

use stickslip_core::block::{Block, Status, guarded};
use stickslip_core::fields::{Fields, each};

use super::excitation::{period, span, spread, triangle};
use crate::record::{Precision, Program, Real};
use crate::tree::Tree;

/// Zeros, subnormals, values that overflow, and non-finite values.
const SPECIAL: [f64; 12] =
    [0.0, -0.0, 5e-324, -5e-324, 1e-310, 1e-40, -1e-40, 1e38, -1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
/// Steps with sweeps, with jumps, and with jumps by a millionth; then one special value per step.
const SWEEP: u32 = 20;
const JUMP: u32 = 30;
const TINY: u32 = 36;
/// Number of steps; the last two have an invalid time step.
pub(super) const STEPS: u32 = TINY + SPECIAL.len() as u32 + 2;

/// A step of the model: numbers of its precision.
pub(super) struct Vector {
    pub(super) dt: f64,
    pub(super) input: Vec<f64>,
    pub(super) output: Vec<f64>,
    pub(super) state: Vec<f64>,
    pub(super) status: Status,
}

/// The run of a block from its state at the start, by steps of `dt` [s].
pub(super) fn vectors<F: Precision, B: Block<F, Input: Default>>(block: &B, dt: f64) -> Vec<Vector> {
    let mut state = B::State::default();
    let mut values = B::Input::default();
    run(Real::of::<F>(), &Tree::of(&values), dt, &mut |input, dt| {
        let mut numbers = input.iter();
        each(&mut values, &mut |number| {
            *number = F::of(*numbers.next().expect("a struct has as many numbers as its tree"));
        });
        let (output, status) = guarded(block, &mut state, values, F::of(dt));
        (list(&output), list(&state), status)
    })
}

/// The same of a program that was recorded in the precision `F`.
pub(super) fn of_program<F: Precision>(program: &Program, dt: f64) -> Vec<Vector> {
    let numbers = |values: &[f64]| -> Vec<F> { values.iter().map(|value| F::of(*value)).collect() };
    let values = |numbers: &[F]| -> Vec<f64> { numbers.iter().map(|number| (*number).into()).collect() };
    let (parameters, mut state) = (numbers(&program.parameters), numbers(&program.start));
    run(Real::of::<F>(), &program.top().input, dt, &mut |input, dt| {
        let (output, status) = program.evaluate_guarded(&parameters, &mut state, &numbers(input), F::of(dt));
        (values(&output), values(&state), status)
    })
}

/// Output, state and status after a step.
type Results = (Vec<f64>, Vec<f64>, Status);

/// The inputs of a run, and the results of a step with each.
fn run(real: Real, input: &Tree, dt: f64, step: &mut dyn FnMut(&[f64], f64) -> Results) -> Vec<Vector> {
    let spans: Vec<_> = input.leaves().iter().map(|leaf| span(leaf.1)).collect();
    let vector = |k: u32| {
        let value = |i: usize| match k {
            0..SWEEP => spans[i].at(triangle(k, period(i)) + 1e-3 * spread(k, i)),
            SWEEP..JUMP => spans[i].at(spread(k, i)),
            JUMP..TINY => spans[i].at(1e-6 * spread(k, i)),
            _ if (k - TINY) as usize % spans.len() == i => SPECIAL[(k - TINY) as usize % SPECIAL.len()],
            _ => spans[i].at(spread(k, i)),
        };
        let input: Vec<f64> = (0..spans.len()).map(|i| real.nearest(value(i))).collect();
        let dt = real.nearest(if k == STEPS - 2 {
            0.0
        } else if k == STEPS - 1 {
            f64::NAN
        } else {
            dt
        });
        let (output, state, status) = step(&input, dt);
        Vector { dt, input, output, state, status }
    };
    (0..STEPS).map(vector).collect()
}

/// The numbers of a struct, in the order of declaration.
fn list<F: Precision>(value: &impl Fields<F>) -> Vec<f64> {
    let (mut copy, mut numbers) = (*value, Vec::new());
    each(&mut copy, &mut |number: &mut F| numbers.push((*number).into()));
    numbers
}
