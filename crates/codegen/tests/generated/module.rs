//! A declared controller as C: its project is clean and passes its self-test, and its library has the five functions.

use std::path::Path;

use super::support::compiler::{STRICT, compile, tool};
use stickslip_codegen::record::{Computed, Declared, Program, record_declared};
use stickslip_codegen::{c, module};
use stickslip_core::scalar::{Mask, Scalar};

/// Flags of the library, which must compile without a warning.
const LIBRARY: [&str; 5] = ["-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off"];

/// A velocity controller with an integral that stops at the limit of the torque.
fn law() -> Program {
    let declared = |name: &str, help: &str, value: f64| Declared {
        name: name.into(),
        unit: "N m s/rad".into(),
        help: help.into(),
        minimum: 0.0,
        maximum: if name == "gain" { 10.0 } else { f64::INFINITY },
        value,
    };
    let parameters = vec![declared("gain", "Says \"how stiff\" it is.", 0.5), declared("fabs", "", 2.0)];
    let signature = module::signature("law", "A law.", parameters, vec![declared("integral", "", 0.0)]);
    let program = record_declared::<f64, ()>(&signature, |it| {
        let deviation = it.input[2] - it.input[5];
        let torque = it.parameters[0] * deviation + it.state[0] + (it.parameters[1] * it.input[0]).sin();
        let free = torque.abs().lt(it.input[6]);
        let integral = free.select(it.state[0] + it.parameters[1].abs() * deviation * it.dt, it.state[0]);
        Ok(Computed { state: vec![integral], output: vec![torque] })
    });
    program.expect("it computes")
}

/// A law without parameters and state.
fn bare() -> Program {
    let signature = module::signature("law", "", Vec::new(), Vec::new());
    let program =
        record_declared::<f64, ()>(&signature, |it| Ok(Computed { state: Vec::new(), output: vec![-it.input[4]] }));
    program.expect("it computes")
}

fn write(folder: &Path, program: Program) {
    let project = c::project_of(program, "law", 1e-3).expect("a good name");
    let module = module::source(&project.program, "law");
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bench/src/external/stickslip_module.h");
    std::fs::copy(header, folder.join("stickslip_module.h")).expect("the header is in the repository");
    for (name, text) in project.files.into_iter().chain([("law_module.c".into(), module)]) {
        std::fs::write(folder.join(name), text).expect("a small file can be written");
    }
}

#[test]
fn a_declared_controller_passes_its_self_test_and_compiles_without_a_warning() {
    for program in [law(), bare()] {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        write(folder.path(), program);
        for compiler in ["gcc", "clang"] {
            compile(folder.path(), compiler, &STRICT, &["law.c", "law_selftest.c", "main.c"], "example");
            let (success, table) = tool(folder.path(), "./example", "", &[]);
            assert!(success && table.lines().count() == 401, "{table}");
            compile(folder.path(), compiler, &[&STRICT[..], &LIBRARY].concat(), &["law_module.c"], "law.so");
            let (_, symbols) = tool(folder.path(), "nm", "binutils", &["-D", "--defined-only", "law.so"]);
            let exported: Vec<&str> = symbols.lines().filter_map(|line| line.split(" T ").nth(1)).collect();
            let expected =
                ["stickslip_begin", "stickslip_describe", "stickslip_end", "stickslip_set", "stickslip_step"];
            assert_eq!(exported, expected, "{symbols}");
        }
        // No variable besides those of an instance: writable variables would be in d or b.
        let alone = [&STRICT[..], &["-O2", "-fno-pic", "-c"]].concat();
        compile(folder.path(), "gcc", &alone, &["law_module.c"], "law.o");
        let (_, symbols) = tool(folder.path(), "nm", "binutils", &["law.o"]);
        let written: Vec<&str> = symbols.lines().filter(|line| "dDbBC".contains(&line[17..18])).collect();
        assert!(symbols.contains(" r DESCRIPTION") && written.is_empty(), "{symbols}");
    }
}

#[test]
fn the_selftest_of_a_declared_controller_finds_a_changed_line() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    write(folder.path(), law());
    let source = folder.path().join("law.c");
    let text = std::fs::read_to_string(&source).expect("it was just written");
    let wrong = text.replacen("p->gain *", "1.0000001 * p->gain *", 1);
    assert_ne!(text, wrong);
    std::fs::write(&source, wrong).expect("a small file can be written");
    compile(folder.path(), "gcc", &STRICT, &["law.c", "law_selftest.c", "main.c"], "example");
    let (success, message) = tool(folder.path(), "./example", "", &[]);
    assert!(!success && message.contains("output torque"), "{message}");
}

/// The evaluation of a program has the results of its block, including calls.
#[test]
fn a_program_that_is_evaluated_has_the_bits_of_its_block() {
    use super::support::{assert_same, bench, case, number};
    use stickslip_codegen::record::record;
    let block = bench::bench();
    let program = record::<_, f64>(&block);
    let trajectories = case::trajectories(&block, bench::TICK);
    let evaluated: Vec<Vec<f64>> = trajectories
        .iter()
        .map(|trajectory| {
            let mut state = program.start.clone();
            let steps = trajectory.inputs.iter().map(|input| {
                let (next, output) = program.evaluate(&trajectory.parameters, &state, input, trajectory.dt);
                state = next;
                [output, state.clone()].concat()
            });
            steps.collect::<Vec<_>>().concat()
        })
        .collect();
    assert_same("evaluated", &number::run(&block, &trajectories), &evaluated);
}
