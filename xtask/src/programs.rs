//! The test programs: cargo compiles them, and several run at a time. Cargo itself runs one after the other, and cores
//! are idle while the last long test of a program runs or a test waits for the clock.

use std::io::{BufRead, BufReader};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::Instant;

use serde_json::Value;

use crate::record::{Reads, Record};
use crate::schedule::Times;
use crate::suite::Counts;
use crate::workspace::{Kind, Workspace};

/// A compiled test program.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Program {
    /// Its root file, relative to the root of the workspace.
    pub(crate) source: String,
    pub(crate) executable: PathBuf,
    /// The folder of the package, in which it runs.
    pub(crate) package: PathBuf,
    /// Whether it runs alone, because it runs a bench in real time: `alone` in the manifest's
    /// `[package.metadata.stickslip]` lists its target, `lib` the unit tests of the library.
    pub(crate) alone: bool,
    /// Whether most of its tests wait for the clock, so that twice as many run at a time: `waits` in the same table.
    pub(crate) waits: bool,
    /// Fingerprint of what its result depends on; `None` if a file cannot be read.
    pub(crate) inputs: Option<u64>,
}

/// Compiles the tests by a `cargo test` command that runs none. Returns their programs.
pub(crate) fn compile(workspace: &Workspace, record: &Record, cargo: &mut Command) -> Result<Vec<Program>, String> {
    let failure = |error: std::io::Error| format!("cannot read the output of cargo: {error}");
    let arguments = ["--no-run", "--message-format=json-render-diagnostics"];
    let mut child = cargo.args(arguments).stdout(Stdio::piped()).spawn().map_err(failure)?;
    let messages = BufReader::new(child.stdout.take().expect("the output is piped"));
    let lines: Vec<String> = messages.lines().collect::<Result<_, _>>().map_err(failure)?;
    if !child.wait().map_err(failure)?.success() {
        return Err("the tests do not compile".into());
    }
    Ok(programs(workspace, record, &lines))
}

/// The test programs in the messages of cargo.
fn programs(workspace: &Workspace, record: &Record, messages: &[String]) -> Vec<Program> {
    let messages: Vec<Value> = messages.iter().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let built = messages.iter().filter(|it| it["reason"] == "compiler-artifact" && it["profile"]["test"] == false);
    let started: Vec<PathBuf> = built.filter_map(|it| Some(it["executable"].as_str()?.into())).collect();
    messages.iter().filter_map(|message| program(workspace, record, message, &started)).collect()
}

/// The test program in a message of cargo.
fn program(workspace: &Workspace, record: &Record, message: &Value, started: &[PathBuf]) -> Option<Program> {
    if message["reason"] != "compiler-artifact" || message["profile"]["test"] != true {
        return None;
    }
    let within = |path: &Value| Some(Path::new(path.as_str()?).strip_prefix(&workspace.root).ok()?.to_path_buf());
    let source = within(&message["target"]["src_path"])?;
    let package = workspace.package_of(&source)?;
    let kind = Kind::of(&message["target"]);
    let target = if kind == Kind::Library { "lib" } else { message["target"]["name"].as_str()? };
    let executable = PathBuf::from(message["executable"].as_str()?);
    // Unit tests start no programs and read no sources; integration tests of some crates do both.
    let (reads, starts) = if kind == Kind::Test { (Reads::All, started) } else { (Reads::NoSources, &[][..]) };
    let inputs = record.inputs(reads, starts.iter().chain([&executable]));
    Some(Program {
        source: source.to_string_lossy().into_owned(),
        executable,
        package: workspace.root.join(&package.folder),
        alone: package.listed("alone").contains(&target),
        waits: package.listed("waits").contains(&target),
        inputs,
    })
}

/// The largest number of failed tests of one program that are tried again. More failures are not due to a busy machine.
const RETRIED: usize = 4;

/// The command that runs a program as cargo does.
pub(crate) fn command(program: &Program, target: &Path) -> Command {
    let mut command = Command::new(&program.executable);
    command.current_dir(&program.package).arg("--quiet");
    command.env("CARGO_MANIFEST_DIR", &program.package).env("CARGO_TARGET_DIR", target);
    if program.waits {
        command.env("RUST_TEST_THREADS", (2 * cores()).to_string());
    }
    command
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(2, NonZero::get)
}

/// Runs the programs in the order of `times`, one per core; those that need the machine run first, alone. A test in real
/// time may fail because other programs use the core: a few failed tests of a program run once more, alone,
/// one after the other. Returns those that pass then and the times. `Err` with the programs of those that fail twice.
/// Programs that passed with the same inputs, by `record`, do not run.
pub(crate) fn run(
    programs: Vec<Program>,
    times: &mut Times,
    record: &mut Record,
    counts: &mut Counts,
    command: impl Fn(&Program) -> Command + Sync,
) -> Result<Vec<String>, String> {
    if programs.is_empty() {
        return Err("no test program was compiled".into());
    }
    let (mut retried, mut failed) = (Vec::new(), Vec::new());
    let programs = programs.into_iter().filter(|it| !record.is_unchanged(&it.source, it.inputs)).collect();
    for Failed { program, tests } in run_all(programs, times, record, counts, &command) {
        if passes_alone(command(&program), &tests) {
            counts.failed -= tests.len() as u32;
            counts.passed += tests.len() as u32;
            retried.extend(tests);
        } else {
            failed.push(program.source);
        }
    }
    failed.sort();
    if failed.is_empty() { Ok(retried) } else { Err(format!("failed: {}", failed.join(", "))) }
}

/// A program with failed tests.
struct Failed {
    program: Program,
    tests: Vec<String>,
}

/// Runs each program once. The output of a program is printed in one piece when it ends.
fn run_all(
    programs: Vec<Program>,
    times: &mut Times,
    record: &mut Record,
    counts: &mut Counts,
    command: &(impl Fn(&Program) -> Command + Sync),
) -> Vec<Failed> {
    let (alone, together) = times.order(programs);
    let results = Mutex::new((times, record, counts, Vec::new()));
    let run_one = |program: Program| {
        let start = Instant::now();
        let (passed, output) = execute(&mut command(&program));
        let took = start.elapsed();
        let (times, record, counts, failed) = &mut *results.lock().expect("no thread panics with the lock");
        println!("{output}{}: {:.1} s", program.source, took.as_secs_f64());
        times.add(&program, took);
        output.lines().for_each(|line| counts.read(line));
        if passed {
            record.add(&program.source, program.inputs);
        } else {
            failed.push(Failed { tests: failures(&output), program });
        }
    };
    alone.into_iter().for_each(run_one);
    let waiting = Mutex::new(together);
    let next = || waiting.lock().expect("no thread panics with the lock").pop_front();
    std::thread::scope(|scope| {
        for _ in 0..cores() {
            scope.spawn(|| std::iter::from_fn(next).for_each(run_one));
        }
    });
    results.into_inner().expect("no thread has panicked").3
}

/// Whether the tests pass when they run alone. Fewer passed tests than names are a failure: a name without a test, or a
/// program that ended early.
fn passes_alone(mut command: Command, tests: &[String]) -> bool {
    if !(1..=RETRIED).contains(&tests.len()) {
        return false;
    }
    let (passed, output) = execute(command.args(["--exact", "--test-threads=1"]).args(tests));
    println!("{output}");
    let mut counts = Counts::default();
    output.lines().for_each(|line| counts.read(line));
    passed && counts.passed as usize == tests.len()
}

/// The failed tests that a test program lists at its end, each on a line.
fn failures(output: &str) -> Vec<String> {
    let list = output.rsplit_once("\nfailures:\n").map_or("", |(_, list)| list);
    let names = list.lines().map_while(|line| line.strip_prefix("    "));
    names.map(str::to_owned).collect()
}

/// Whether a program succeeds, and its output.
fn execute(command: &mut Command) -> (bool, String) {
    match command.stdin(Stdio::null()).output() {
        Ok(output) => {
            let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
            (output.status.success(), text.concat())
        }
        Err(error) => (false, format!("cannot start {}: {error}\n", command.get_program().display())),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use crate::workspace::sample;

    fn a_program(source: &str) -> Program {
        Program {
            source: source.into(),
            executable: "true".into(),
            package: ".".into(),
            alone: false,
            waits: false,
            inputs: None,
        }
    }

    /// A record in an empty folder for a tree without files.
    fn empty_record() -> (tempfile::TempDir, Record) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let record = Record::new(folder.path(), folder.path(), &BTreeSet::new(), &[], false);
        (folder, record)
    }

    #[test]
    fn a_message_of_cargo_gives_the_test_program() {
        let message = |test: &str, executable: &str| {
            format!(
                r#"{{"reason":"compiler-artifact","profile":{{"test":{test}}},"executable":{executable},
                "target":{{"kind":["test"],"name":"slot","src_path":"/w/crates/rt/tests/slot.rs"}}}}"#
            )
        };
        let workspace = sample(&[("rt", &[])]);
        let (_folder, record) = empty_record();
        let read = |line: &str| programs(&workspace, &record, &[line.into()]).pop();
        let program = read(&message("true", r#""/t/slot-1""#)).expect("a test program");
        assert_eq!(program.source, "crates/rt/tests/slot.rs");
        assert_eq!(program.executable, Path::new("/t/slot-1"));
        assert_eq!(program.package, Path::new("/w/crates/rt"));
        assert!(!program.alone);
        // A library, a program that a test starts, other messages, other output.
        assert_eq!(read(&message("true", "null")), None);
        assert_eq!(read(&message("false", r#""/t/slot-1""#)), None);
        assert_eq!(read(r#"{"reason":"build-finished","success":true}"#), None);
        assert_eq!(read("running 3 tests"), None);
    }

    #[test]
    fn the_manifest_lists_the_programs_that_run_alone_and_those_that_wait() {
        let of = |kind: &str, name: &str, file: &str| {
            let packages = serde_json::json!([{
                "name": "rt", "manifest_path": "/w/crates/rt/Cargo.toml", "dependencies": [], "targets": [],
                "metadata": { "stickslip": { "alone": ["lib", "causes"], "waits": ["slot"] } },
            }]);
            let metadata = serde_json::json!({ "workspace_root": "/w", "packages": packages });
            let workspace = Workspace::parse(&metadata).expect("it is complete");
            let message = serde_json::json!({
                "reason": "compiler-artifact", "profile": { "test": true }, "executable": "/t/it",
                "target": { "kind": [kind], "name": name, "src_path": format!("/w/crates/rt/{file}") },
            });
            let (_folder, record) = empty_record();
            program(&workspace, &record, &message, &[]).expect("a test program")
        };
        let causes = of("test", "causes", "tests/causes.rs");
        assert!(of("lib", "rt", "src/lib.rs").alone && causes.alone && !causes.waits);
        let slot = of("test", "slot", "tests/slot.rs");
        assert!(!slot.alone && slot.waits && !of("bin", "rt", "src/main.rs").alone);
        let threads = |program| {
            let command = command(program, Path::new("/t"));
            command.get_envs().any(|(name, _)| name == "RUST_TEST_THREADS")
        };
        assert!(threads(&slot) && !threads(&causes));
    }

    fn run_scripts(programs: &[&str], script: impl Fn(&str) -> String + Sync) -> (Result<Vec<String>, String>, Counts) {
        let mut counts = Counts::default();
        let programs = programs.iter().map(|name| a_program(name)).collect();
        let (_folder, mut record) = empty_record();
        let outcome = run(programs, &mut Times::default(), &mut record, &mut counts, |program| {
            let mut command = Command::new("sh");
            command.args(["-c", &script(&program.source), "sh"]);
            command
        });
        (outcome, counts)
    }

    #[test]
    fn all_programs_run_and_count_and_the_failed_ones_are_named() {
        let (outcome, counts) = run_scripts(&["a", "b", "c", "d"], |name| match name {
            "a" => "echo 'test result: ok. 3 passed; 0 failed; 1 ignored'".into(),
            "b" => "echo 'test result: FAILED. 2 passed; 1 failed; 0 ignored'; exit 101".into(),
            "c" => "exec no-such-program".into(),
            _ => "exit 1".into(),
        });
        assert_eq!(outcome, Err("failed: b, c, d".into()));
        assert_eq!(counts, Counts { passed: 5, failed: 1, skipped: 1 });
    }

    #[test]
    fn the_time_of_each_program_is_noted() {
        let mut times = Times::default();
        let (_folder, mut record) = empty_record();
        let command = |_: &Program| Command::new("true");
        let outcome = run(vec![a_program("a")], &mut times, &mut record, &mut Counts::default(), command);
        assert_eq!(outcome, Ok(Vec::new()));
        assert_eq!(times.slowest(10).len(), 1);
    }

    #[test]
    fn a_program_that_passed_does_not_run_again_and_one_that_failed_does() {
        let (_folder, mut record) = empty_record();
        let inputs = record.inputs(Reads::All, []);
        let mut ran = |script: &str| {
            let programs = vec![Program { inputs, ..a_program("a") }];
            let started = AtomicU32::new(0);
            let _ = run(programs, &mut Times::default(), &mut record, &mut Counts::default(), |_| {
                started.fetch_add(1, Ordering::Relaxed);
                Command::new(script)
            });
            started.into_inner() > 0
        };
        assert!(ran("false") && ran("true"));
        assert!(!ran("true"));
    }

    /// Runs a test program in which these tests fail; `alone` is the script for them when they run alone.
    fn harness(failing: &[&str], alone: &str) -> (Result<Vec<String>, String>, Counts) {
        let list: String = failing.iter().map(|name| format!("    {name}\n")).collect();
        let script = format!(
            r#"if [ "$1" = --exact ]; then {alone}; fi
            printf 'failures:\n\n---- one stdout ----\nit panics:\n    not a name\n\nfailures:\n{list}\n'
            printf 'test result: FAILED. 1 passed; {} failed; 0 ignored\n'; exit 101"#,
            failing.len(),
        );
        run_scripts(&["it"], |_| script.clone())
    }

    #[test]
    fn a_test_that_passes_alone_is_listed_and_one_that_fails_twice_fails() {
        let passes = "echo \"test result: ok. $(($# - 2)) passed; 0 failed; 0 ignored\"; exit 0";
        let (outcome, counts) = harness(&["one", "by::clock"], passes);
        assert_eq!(outcome, Ok(vec!["one".into(), "by::clock".into()]));
        assert_eq!(counts, Counts { passed: 3, failed: 0, skipped: 0 });

        let fails = "echo 'test result: FAILED. 1 passed; 1 failed; 0 ignored'; exit 101";
        let missing = "echo 'test result: ok. 0 passed; 0 failed; 0 ignored'; exit 0";
        for alone in [fails, missing] {
            let (outcome, counts) = harness(&["one", "by::clock"], alone);
            assert_eq!((outcome, counts.failed), (Err("failed: it".into()), 2), "{alone}");
        }
        let (outcome, counts) = harness(&["a", "b", "c", "d", "e"], passes);
        assert_eq!((outcome, counts.failed), (Err("failed: it".into()), 5), "too many for a second try");
    }

    #[test]
    fn no_program_is_an_error() {
        assert!(run_scripts(&[], |_| String::new()).0.is_err());
    }
}
