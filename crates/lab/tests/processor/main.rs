//! Processor in the loop: the generated C on a Cortex-M in QEMU gives the bits of Rust over a whole experiment.
#![expect(unreachable_pub, reason = "a test has no users")]

mod experiment;
mod run;
mod target;

use std::sync::OnceLock;
use std::time::Duration;

use stickslip_codegen::c;
use stickslip_codegen::record::{self, Recorded};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::tick::Tick;

use run::{Bytes, Run, first_difference};
use target::{M4F, M7, Main, Target, available};

/// A hundred times what it takes.
const LIMIT: Duration = Duration::from_secs(300);

/// The experiment is made once for all tests.
fn experiment() -> &'static (Tick<f64>, Run) {
    static EXPERIMENT: OnceLock<(Tick<f64>, Run)> = OnceLock::new();
    EXPERIMENT.get_or_init(experiment::experiment)
}

/// Runs a block on a processor and compares every output, state and status with Rust's.
fn agrees<F: Bytes, B: Fields<f64>>(target: Target, block: &B, run: &Run)
where
    B::With<F>: Block<F, Input: Default>,
    B::With<Recorded<F>>: Block<Recorded<F>, Input: Default>,
{
    let program = record::record::<B, F>(block);
    let code = c::print::<F>(&program, "block").expect("a good name");
    let single = F::C_SUFFIX == "f";
    let image = target.compile(&Main::Block { program: &program, code: &code, single, measure: false });
    let ran = image.run(&run.inputs::<F>(), LIMIT);
    assert!(ran.succeeded, "{}: {}", target.name, ran.said);
    let top = program.steps.last().expect("a program has at least the block itself");
    let difference = first_difference(&run.outputs::<F, B>(block), &ran.outputs, &top.output, &top.state, single);
    assert_eq!(difference, None, "{} {}", target.name, F::C_NAME);
}

#[test]
fn a_whole_experiment_on_a_cortex_m4f_in_double() {
    if available() {
        let (tick, run) = experiment();
        assert!(run.steps() as f64 * run.dt > 40.0, "{} ticks are no whole experiment", run.steps());
        agrees::<f64, _>(M4F, tick, run);
    }
}

#[test]
fn a_whole_experiment_on_a_cortex_m4f_in_float() {
    if available() {
        let (tick, run) = experiment();
        agrees::<f32, _>(M4F, tick, run);
    }
}

#[test]
fn a_whole_experiment_on_a_cortex_m7_in_double() {
    if available() {
        let (tick, run) = experiment();
        agrees::<f64, _>(M7, tick, run);
    }
}
