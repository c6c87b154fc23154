//! The vectors of the self-test: what the model makes of a short run that meets everything a block may meet.

use stickslip_core::block::{Block, Status, guarded};
use stickslip_core::fields::Fields;

use super::excitation::{period, span, spread, triangle};
use crate::record::{Precision, Program, Step};
use crate::tree::Tree;

/// Zeros, subnormals, what overflows, and what is no number.
const SPECIAL: [f64; 12] =
    [0.0, -0.0, 5e-324, -5e-324, 1e-310, 1e-40, -1e-40, 1e38, -1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
/// Steps that sweep, that jump, and that jump by a millionth; then come the special values, one a step.
const SWEEP: u32 = 20;
const JUMP: u32 = 30;
const TINY: u32 = 36;
/// Steps in all; the two last have a time step that is none.
pub(super) const STEPS: u32 = TINY + SPECIAL.len() as u32 + 2;

/// A step of the model.
pub(super) struct Vector<F> {
    pub(super) dt: F,
    pub(super) input: Vec<F>,
    pub(super) output: Vec<F>,
    pub(super) state: Vec<F>,
    pub(super) status: Status,
}

/// The run of a block from its state at the start, by steps of `dt` [s].
pub(super) fn vectors<F: Precision, B: Block<F, Input: Default>>(block: &B, dt: f64) -> Vec<Vector<F>> {
    let mut state = B::State::default();
    let template = B::Input::default();
    run(&Tree::of(&template), dt, |input, dt| {
        let mut numbers = input.iter();
        let given = template.merge(&template, &mut |old, _| numbers.next().copied().unwrap_or(old));
        let (output, status) = guarded(block, &mut state, given, dt);
        (list(&output), list(&state), status)
    })
}

/// The same of a program that no block stands behind.
pub(super) fn of_program<F: Precision>(program: &Program, top: &Step, dt: f64) -> Vec<Vector<F>> {
    let numbers = |values: &[f64]| -> Vec<F> { values.iter().map(|value| F::of(*value)).collect() };
    let (parameters, mut state) = (numbers(&program.parameters), numbers(&program.start));
    run(&top.input, dt, |input, dt| {
        let (output, status) = program.evaluate_guarded(&parameters, &mut state, input, dt);
        (output, state.clone(), status)
    })
}

/// The inputs that are met, and what a step makes of each: output, state, status.
fn run<F: Precision>(
    input: &Tree,
    dt: f64,
    mut step: impl FnMut(&[F], F) -> (Vec<F>, Vec<F>, Status),
) -> Vec<Vector<F>> {
    let spans: Vec<_> = input.leaves().iter().map(|leaf| span(leaf.1)).collect();
    let vector = |k: u32| {
        let value = |i: usize| match k {
            0..SWEEP => spans[i].at(triangle(k, period(i)) + 1e-3 * spread(k, i)),
            SWEEP..JUMP => spans[i].at(spread(k, i)),
            JUMP..TINY => spans[i].at(1e-6 * spread(k, i)),
            _ if (k - TINY) as usize % spans.len() == i => SPECIAL[(k - TINY) as usize % SPECIAL.len()],
            _ => spans[i].at(spread(k, i)),
        };
        let input: Vec<F> = (0..spans.len()).map(|i| F::of(value(i))).collect();
        let dt = F::of(if k == STEPS - 2 {
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

fn list<F: Precision>(value: &impl Fields<F>) -> Vec<F> {
    let mut out = Vec::new();
    value.map(&mut |number: F| {
        out.push(number);
        number
    });
    out
}
