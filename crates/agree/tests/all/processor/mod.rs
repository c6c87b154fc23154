//! Processor in the loop: the generated C on a Cortex-M in QEMU gives the bits of Rust over a whole experiment.

mod bench;
mod experiment;
mod run;
mod table;
mod target;

use std::sync::OnceLock;
use std::time::Duration;

use stickslip::generate::{self, Precision};
use stickslip::parameters;
use stickslip_codegen::c;
use stickslip_codegen::record::{self, Recorded};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;
use stickslip_core::tick::Tick;

use run::{Bytes, Run, first_difference};
use target::{M4F, M7, Main, Target, available};

/// A hundred times the usual duration.
const LIMIT: Duration = Duration::from_secs(300);

/// The experiment runs once for all tests.
fn experiment() -> &'static (Tick<f64>, Run) {
    static EXPERIMENT: OnceLock<(Tick<f64>, Run)> = OnceLock::new();
    EXPERIMENT.get_or_init(experiment::experiment)
}

/// Runs a block on a processor and compares every output, state and status with Rust's.
fn agrees<F: Bytes, B: Fields<f64>>(target: Target, block: &B, run: &Run)
where
    B::With<F>: Block<F, Input: Default>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    let program = record::record::<B, F>(block);
    let code = c::print::<F>(&program, "block").expect("a good name");
    let single = F::C_SUFFIX == "f";
    let image = target.compile(&Main::Block { program: &program, code: &code, single, measure: false });
    let outcome = image.run(&run.inputs::<F>(), LIMIT);
    assert!(outcome.succeeded, "{}: {}", target.name, outcome.log);
    let top = program.steps.last().expect("a program has at least the block itself");
    let difference = first_difference(&run.outputs::<F, B>(block), &outcome.outputs, &top.output, &top.state, single);
    assert_eq!(difference, None, "{} {}", target.name, F::C_NAME);
}

#[test]
fn the_start_of_an_experiment_on_both_processors() {
    if available() {
        let (tick, run) = experiment();
        agrees::<f64, _>(M7, tick, &run.first(2_000));
        agrees::<f32, _>(M4F, tick, &run.first(500));
    }
}

#[test]
#[ignore = "minutes: cargo xtask study processor"]
fn a_whole_experiment_on_a_cortex_m4f_in_double() {
    if available() {
        let (tick, run) = experiment();
        println!("{} ticks in {} records", run.steps(), run.records.len());
        assert!(run.steps() as f64 * run.dt > 40.0, "{} ticks are less than a whole experiment", run.steps());
        agrees::<f64, _>(M4F, tick, run);
    }
}

#[test]
#[ignore = "minutes: cargo xtask study processor"]
fn a_whole_experiment_on_a_cortex_m4f_in_float() {
    if available() {
        let (tick, run) = experiment();
        agrees::<f32, _>(M4F, tick, run);
    }
}

#[test]
#[ignore = "minutes: cargo xtask study processor"]
fn a_whole_experiment_on_a_cortex_m7_in_double() {
    if available() {
        let (tick, run) = experiment();
        agrees::<f64, _>(M7, tick, run);
    }
}

/// The delivered project: its self-test recomputes vectors of the model and reports the first number that differs.
#[test]
fn the_self_test_of_a_block_passes_and_its_example_runs() {
    if available() {
        self_test("velocity_observer", M4F, Precision::Single);
    }
}

fn self_test(block: &str, target: Target, precision: Precision) {
    let preset = parameters::presets::find("clm-bench").and_then(|source| source.read()).expect("a preset that reads");
    let project = generate::generate(block, &preset, precision, None).expect("a block of the catalogue");
    let outcome = target.compile(&Main::Project(&project)).run(&[], LIMIT);
    assert!(outcome.succeeded, "{} {block}: {}", target.name, outcome.log);
    assert!(outcome.log.starts_with("time [s],") && outcome.log.lines().count() > 100, "{}", outcome.log);
}

#[test]
#[ignore = "minutes: cargo xtask study processor"]
fn the_self_test_of_every_block_of_the_catalogue_passes_and_its_example_runs() {
    if available() {
        for block in generate::blocks() {
            for (target, precision) in [(M7, Precision::Double), (M4F, Precision::Single)] {
                self_test(block.name, target, precision);
            }
        }
    }
}

#[test]
fn a_failed_self_test_on_the_processor_is_detected() {
    if available() {
        let preset =
            parameters::presets::find("clm-bench").and_then(|source| source.read()).expect("a preset that reads");
        let mut project =
            generate::generate("pid", &preset, Precision::Double, None).expect("a block of the catalogue");
        let source = project.files.iter_mut().find(|(name, _)| name == "pid.c").expect("a project has its source");
        let (head, body) = source.1.split_once("_raw_step(").expect("the source has the step");
        source.1 = format!("{head}_raw_step({}", body.replace(" - ", " + "));
        let outcome = M7.compile(&Main::Project(&project)).run(&[], LIMIT);
        assert!(!outcome.succeeded && !outcome.log.starts_with("time [s],"), "{}", outcome.log);
    }
}

/// Machine, software and noise, each tick from the state that the processor itself left.
#[test]
#[ignore = "minutes: cargo xtask study processor"]
fn the_whole_bench_in_closed_loop() {
    if available() {
        let (bench, run) = bench::bench(8_000);
        agrees::<f64, _>(M7, &bench, &run);
        let (bench, run) = bench::bench(800);
        agrees::<f64, _>(M4F, &bench, &run);
        agrees::<f32, _>(M4F, &bench, &run);
    }
}

#[test]
fn the_committed_table_is_up_to_date() {
    if available() {
        let (tick, run) = experiment();
        table::check(&table::measure(tick, run));
    }
}

#[test]
fn a_changed_number_of_the_table_is_reported() {
    let row = table::Row { key: ["Cortex-M7", "double", "pid"].map(String::from), numbers: [1000.0; 7] };
    let then = |instructions: f64, block: &str| {
        let mut cells = serde_json::Map::from_iter(row.cells());
        cells.insert("instructions".into(), instructions.into());
        cells.insert("block".into(), block.into());
        serde_json::Value::Object(cells)
    };
    assert_eq!(table::differs(&then(1000.0, "pid"), &row, 0.02), None);
    assert_eq!(table::differs(&then(985.0, "pid"), &row, 0.02), None);
    let message = table::differs(&then(970.0, "pid"), &row, 0.02);
    assert_eq!(message.as_deref(), Some("Cortex-M7 double pid: instructions was 970, is 1000"));
    assert!(table::differs(&then(1000.0, "cascade"), &row, 0.02).is_some_and(|text| text.contains("the table has")));
}

#[test]
fn a_wrong_bit_is_located_by_tick_and_number() {
    let (tick, run) = experiment();
    let run = run.first(2_000);
    let program = record::record::<Tick<f64>, f64>(tick);
    let top = program.steps.last().expect("a program has at least the block itself");
    let expected = run.outputs::<f64, _>(tick);
    let compared = |actual: &[u8]| first_difference(&expected, actual, &top.output, &top.state, false);
    assert_eq!(compared(&expected), None);
    let row = 4 + 8 * (top.output.numbers() + top.state.numbers());
    let mut wrong = expected.clone();
    wrong[1_234 * row + 4 + 8 * 5] ^= 1;
    let difference = compared(&wrong).expect("it is wrong");
    assert!(difference.starts_with("tick 1234 of "), "{difference}");
    assert!(difference.contains(", estimated_velocity: "), "{difference}");
    assert!(compared(&expected[..expected.len() - row]).is_some_and(|text| text.contains("None found")));
}

#[test]
fn a_fault_is_reported_and_a_hanging_program_is_ended() {
    if available() {
        for target in [M4F, M7] {
            let wild = "int main(void) { return *(volatile int *)0xF0000000u; }";
            let outcome = target.compile(&Main::Text(wild)).run(&[], LIMIT);
            assert!(!outcome.succeeded && outcome.log.starts_with("hard fault: "), "{}", outcome.log);
            let failing = target.compile(&Main::Text("int main(void) { return 3; }")).run(&[], LIMIT);
            assert!(!failing.succeeded && failing.log.is_empty(), "{}", failing.log);
        }
        let hanging = M4F.compile(&Main::Text("int main(void) { for (;;) {} }")).run(&[], Duration::from_millis(500));
        assert!(!hanging.succeeded && hanging.log.contains("the program hangs"), "{}", hanging.log);
    }
}
