//! Controllers in C, compiled here: a good one, and one for each fault.

mod clocked;
#[path = "../../../../bench/src/external/fmu/tests/fixture.rs"]
mod fixture;
mod fmu;
mod roles;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use stickslip_rt::FloatingPoint;

use stickslip::bench::external::process::{HostProcess, host};
use stickslip::bench::external::*;
use stickslip::bench::{Bench as _, Command as Order, VirtualBench};
use stickslip::load::{self, load};
use stickslip::parameters::presets::find;
use stickslip::run::{Record, replay};
use stickslip::{Error, Preset, Watch};
use stickslip_software::supervise::ExternalFault;

/// Environment variables that make a test process a host, and its mapping.
const HOSTED: &str = "STICKSLIP_TEST_HOST";
const MAPPED: &str = "STICKSLIP_TEST_MAP";
/// And its role.
const AS: &str = "STICKSLIP_TEST_ROLE";

/// This very program, as a host: it runs [`hosts`] alone.
pub(super) fn here() -> HostProcess {
    let program = std::env::current_exe().expect("a program has a path");
    let test = "loaded::hosts";
    let call = format!("exec '{}' --exact {test} --nocapture", program.display());
    let words = "for last; do role=\"$word\"; word=\"$last\"; done";
    let script = format!("{words}; {HOSTED}=\"$last\" {AS}=\"$role\" {MAPPED}=\"$2\" {call}");
    let arguments = ["-c".into(), script.into()];
    HostProcess { program: "sh".into(), arguments: arguments.into_iter().chain(["host".into()]).collect() }
}

/// The only test that runs in a host process.
#[test]
fn hosts() {
    if let Some(file) = std::env::var_os(HOSTED) {
        let map = std::env::var(MAPPED).unwrap_or_default();
        let map: Vec<_> = map.split_once('=').map(|(signal, name)| (signal.into(), name.into())).into_iter().collect();
        let role = std::env::var(AS).ok().and_then(|name| Role::find(&name)).expect("it has a role");
        host(Path::new(&file), role, &map).expect("the parent sends requests");
        std::process::exit(0);
    }
}

fn compiled(folder: &Path, source: &str, options: &[&str]) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let library = folder.join("controller.so");
    let mut compiler = Command::new("cc");
    let compiler = compiler.args(["-O1", "-Wall", "-Werror", "-shared", "-fPIC"]).args(options);
    let compiler = compiler
        .arg("-I")
        .arg(here.join("../bench/src/external"))
        .arg("-o")
        .arg(&library)
        .arg(here.join(source))
        .arg("-lm");
    assert!(compiler.status().expect("there is a compiler").success(), "{source}");
    library
}

fn faulty(folder: &Path, fault: usize) -> PathBuf {
    compiled(folder, "tests/laboratory/loaded/faults.c", &[&format!("-DFAULT={fault}")])
}

pub(super) fn preset() -> Preset<f64> {
    find("clm-bench").expect("it is built in").read().expect("it is right")
}

const EXAMPLE: &str = "../../examples/controller/p_pi.c";

#[test]
fn values_are_sent_with_a_sample_and_the_verdict_is_returned() {
    let folder = tempfile::tempdir().unwrap();
    let library = compiled(folder.path(), "tests/laboratory/loaded/tuned.c", &[]);
    let sample = ModuleSample { reference_position: 1.0, ..ModuleSample::default() };
    for mut external in [
        External::trusted(&library, Role::Controller).unwrap(),
        External::in_own_process(&library, Role::Controller, &here()).unwrap(),
    ] {
        let mut console = external.console();
        external.begin(1e-3, 1.0).unwrap();
        assert_eq!(external.step(&sample), Ok(1.0));
        let accepted = console.put(&[2.0, 0.0, 0.25]);
        assert_eq!((external.step(&sample), console.verdict(accepted)), (Ok(2.25), Some(0)));
        let refused = console.put(&[6.0, 0.0, 0.5]);
        assert_eq!((external.step(&sample), console.verdict(refused)), (Ok(2.25), Some(-2)), "the last values remain");
        assert_eq!((external.step(&sample), external.values()), (Ok(2.25), &[2.0, 0.0, 0.25][..]));
        // While inactive they wait for its start.
        let waits = console.put(&[3.0, 0.0, 0.0]);
        assert!(external.take_for_begin() && !external.take_for_begin());
        assert_eq!(console.verdict(waits), Some(0));
        external.begin(1e-3, 1.0).unwrap();
        assert_eq!(external.step(&sample), Ok(3.0));
        console.count();
        assert_eq!(console.durations().0.count, 5);
    }
}

#[test]
fn the_bench_runs_the_example_and_replays_its_run_without_it() {
    let folder = tempfile::tempdir().unwrap();
    let library = compiled(folder.path(), EXAMPLE, &[]);
    let run = folder.path().join("run.mf4");
    let trusted = External::trusted(&library, Role::Controller).unwrap();
    assert_eq!((trusted.description().name.as_str(), trusted.hash().len()), ("P-PI cascade", 64));
    let here_it_is = load(&preset(), trusted, 0.0, 3, Some(&run), &Watch::silent()).unwrap();
    assert_eq!(here_it_is.fault, None);
    let apart = External::in_own_process(&library, Role::Controller, &here()).unwrap();
    let apart = load(&preset(), apart, 0.0, 3, None, &Watch::silent()).unwrap();
    let of = |loaded: &load::Loaded, name: &str| loaded.summary().value(name).unwrap();
    let rms = "controller.sine_0.5hz.rms";
    assert_eq!(of(&here_it_is, rms), of(&apart, rms), "the same bits in either process");
    assert!(of(&apart, rms) < 0.1 && of(&apart, rms) != of(&apart, "own.sine_0.5hz.rms"), "{}", of(&apart, rms));
    assert!(of(&apart, "call.count") > 4000.0 && of(&apart, "fault") == 0.0);
    drop(here_it_is);
    std::fs::remove_file(library).unwrap();
    let replayed = replay(&Record::read(&run).unwrap(), &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed}");
}

#[test]
fn each_fault_is_named_and_braked_and_the_bench_continues() {
    let messages = [
        "signal 11, invalid memory access",
        "has not answered for 0.200 s",
        "torque is not finite",
        "torque is not finite",
        "reported a failure (code 7)",
        "changed the rounding of floating-point numbers",
        "exited (exit code 3)",
    ];
    for (fault, message) in messages.into_iter().enumerate() {
        let folder = tempfile::tempdir().unwrap();
        let library = faulty(folder.path(), fault);
        let external =
            External::in_own_process_within(&library, Role::Controller, &here(), Duration::from_millis(200)).unwrap();
        let loaded = load(&preset(), external, 0.0, 1, None, &Watch::silent()).unwrap();
        let reason = loaded.fault.as_deref().unwrap_or("nothing");
        assert!(reason.contains(message), "{fault}: {reason}");
        assert!(
            loaded.summary().value("own.sine_0.5hz.rms").is_some_and(|rms| rms < 0.1),
            "{fault}: the bench continues"
        );
    }
    assert!(FloatingPoint::standard().was_standard());
}

#[test]
#[cfg(target_os = "linux")]
fn a_controller_that_overwrites_the_shared_memory_does_not_affect_the_bench() {
    let folder = tempfile::tempdir().unwrap();
    let library = faulty(folder.path(), 7);
    for sample in [0.0, 1.0, 300.0] {
        let mut external =
            External::in_own_process_within(&library, Role::Controller, &here(), Duration::from_millis(200)).unwrap();
        external.set("sample", sample).unwrap();
        external.begin(1e-3, 1.0).unwrap();
        // Any number, or any fault, depending on its words.
        let torques = (0..400).map_while(|_| external.step(&ModuleSample::default()).ok());
        assert!(torques.inspect(|torque| assert!(torque.is_finite())).count() as f64 >= sample);
    }
    let external =
        External::in_own_process_within(&library, Role::Controller, &here(), Duration::from_millis(200)).unwrap();
    let loaded = load(&preset(), external, 0.0, 1, None, &Watch::silent()).unwrap();
    assert!(loaded.summary().value("own.sine_0.5hz.rms").is_some_and(|rms| rms < 0.1), "the bench continues");
}

#[test]
fn a_mode_that_a_trusted_library_changes_is_restored_and_a_fault() {
    let folder = tempfile::tempdir().unwrap();
    let mut external = External::trusted(&faulty(folder.path(), 5), Role::Controller).unwrap();
    external.set("sample", 0.0).unwrap();
    external.begin(1e-3, 1.0).unwrap();
    assert_eq!(external.step(&ModuleSample::default()), Err(ExternalFault::FloatingPoint));
    assert!(FloatingPoint::standard().was_standard());
    assert!(external.set("sample", -1.0).unwrap_err().to_string().contains("outside 0 … 1000000000 1"));
    assert!(external.set("gain", 0.0).unwrap_err().to_string().contains("The controller has: sample."));
}

#[test]
fn an_invalid_controller_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("text.so");
    std::fs::write(&text, "no library").unwrap();
    let refused = |opened: Result<External, Error>| opened.err().expect("the controller is invalid").to_string();
    for opened in
        [External::trusted(&text, Role::Controller), External::in_own_process(&text, Role::Controller, &here())]
    {
        let message = refused(opened);
        assert!(message.contains("text.so") && message.contains("cc -shared -fPIC"), "{message}");
    }
    let library = compiled(folder.path(), "tests/laboratory/loaded/faults.c", &["-DFAULT=9", "-Dstickslip_end=other"]);
    assert!(refused(External::trusted(&library, Role::Controller)).contains("no function stickslip_end"));
    let missing = HostProcess { program: "/nowhere/stickslip".into(), arguments: Vec::new() };
    assert!(refused(External::in_own_process(&text, Role::Controller, &missing)).contains("/nowhere/stickslip"));
}

#[test]
fn an_invalid_description_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let messages = [
        "its functions have version 2, and version 1 is required",
        "stickslip_describe returns NULL",
        "parameters is NULL or too many",
        "name is NULL",
        "a parameter's name is NULL",
        "a parameter's unit is NULL",
        "a parameter's help is NULL",
        "the range of gain is NaN … 1",
        "the range of gain is 1 … 0",
        "gain begins with 1.5, outside 0 … 1",
        "a parameter is called \"The Gain\"",
        "two parameters are called gain",
        "parameters is NULL or too many",
        "it has no name",
        "gain begins with NaN, outside 0 … 1",
        "the range of gain is 0 … inf",
    ];
    for (case, message) in messages.into_iter().enumerate() {
        // A separate file: the system loads a library name once.
        let folder = folder.path().join(case.to_string());
        std::fs::create_dir(&folder).unwrap();
        let library = compiled(&folder, "tests/laboratory/loaded/described.c", &[&format!("-DCASE={case}")]);
        let refused =
            External::trusted(&library, Role::Controller).err().expect("the description is invalid").to_string();
        assert!(refused.contains(message) && refused.contains("controller.so: "), "{case}: {refused}");
    }
    // A valid description that refuses to start.
    let library = compiled(folder.path(), "tests/laboratory/loaded/described.c", &["-DCASE=99"]);
    let started = External::trusted(&library, Role::Controller).unwrap().begin(1e-3, 1.0);
    assert_eq!(started, Err(ExternalFault::Failed { code: -1 }));
}
