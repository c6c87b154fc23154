//! The programs of the tests: cargo compiles them, and they run several at a time. Cargo itself runs one after the other,
//! and the cores wait wherever one long test is left of a program, or where it looks at a clock.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::Instant;

use serde_json::Value;

use crate::suite::Counts;

/// What holds a machine to its clock, and wants it for itself.
const ALONE: [&str; 5] = [
    "crates/rt/src/lib.rs",
    "crates/rt/tests/causes.rs",
    "crates/lab/tests/deadline.rs",
    "crates/app/tests/doctor.rs",
    "crates/app/tests/machines.rs",
];

/// What computes for long, the longest first.
const COMPUTING: [&str; 8] = [
    "crates/lab/src/lib.rs",
    "crates/codegen/tests/long/main.rs",
    "crates/codegen/tests/clean.rs",
    "crates/agree/tests/processor/main.rs",
    "crates/agree/tests/agree.rs",
    "crates/core/src/lib.rs",
    "crates/lab/tests/linear/main.rs",
    "crates/lab/tests/calibration.rs",
];

/// What waits for the clock of a bench, the longest first.
const WAITING: [&str; 4] = [
    "crates/app/tests/guide/main.rs",
    "crates/app/tests/examples.rs",
    "crates/lab/tests/running/main.rs",
    "crates/app/tests/served.rs",
];

/// A compiled file of tests.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Program {
    /// The file that it is made of, from the root of the workspace.
    source: String,
    executable: PathBuf,
    /// The folder of the package, where it runs.
    package: PathBuf,
}

/// Compiles all tests of the workspace at `root` by a `cargo test` that runs none; told are their programs.
pub(crate) fn compile(root: &Path, cargo: &mut Command) -> Result<Vec<Program>, String> {
    let failure = |error: std::io::Error| format!("cannot read what cargo says: {error}");
    let told = ["--no-run", "--message-format=json-render-diagnostics"];
    let mut child = cargo.args(told).stdout(Stdio::piped()).spawn().map_err(failure)?;
    let messages = BufReader::new(child.stdout.take().expect("the output is piped"));
    let lines: Vec<String> = messages.lines().collect::<Result<_, _>>().map_err(failure)?;
    if !child.wait().map_err(failure)?.success() {
        return Err("the tests do not compile".into());
    }
    Ok(lines.iter().filter_map(|line| program(root, line)).collect())
}

/// The program that a message of cargo is about, if it is one of tests.
fn program(root: &Path, message: &str) -> Option<Program> {
    let message: Value = serde_json::from_str(message).ok()?;
    if message["reason"] != "compiler-artifact" || message["profile"]["test"] != true {
        return None;
    }
    let source = Path::new(message["target"]["src_path"].as_str()?);
    Some(Program {
        source: source.strip_prefix(root).unwrap_or(source).to_string_lossy().replace('\\', "/"),
        executable: message["executable"].as_str()?.into(),
        package: Path::new(message["manifest_path"].as_str()?).parent()?.into(),
    })
}

/// Of one program so many tests that fail are asked again. More do not fail because the machine is busy.
const AGAIN: usize = 4;

/// Runs the programs as cargo would, as many at a time as there are cores but for those that want all. What one says is told
/// in one piece, once it has ended. A test that holds a bench to its clock may fail because others want the core: the few
/// that fail are asked once more, one after the other with the machine to themselves, and those that pass then are told.
/// `Err` with the programs of those that fail twice.
pub(crate) fn run(programs: Vec<Program>, target: &Path, counts: &mut Counts) -> Result<Vec<String>, String> {
    run_by(programs, counts, |program| {
        let mut command = Command::new(&program.executable);
        command.current_dir(&program.package).arg("--quiet");
        command.env("CARGO_MANIFEST_DIR", &program.package).env("CARGO_TARGET_DIR", target);
        command
    })
}

fn run_by(
    programs: Vec<Program>,
    counts: &mut Counts,
    command: impl Fn(&Program) -> Command + Sync,
) -> Result<Vec<String>, String> {
    if programs.is_empty() {
        return Err("there are no programs of tests".into());
    }
    let (alone, together) = ordered(programs);
    let told = Mutex::new((counts, Vec::new()));
    let run_one = |program: Program| {
        let begun = Instant::now();
        let (passed, said) = play(&mut command(&program));
        let (counts, failed) = &mut *told.lock().expect("nobody panics with it");
        println!("{said}{}: {:.1} s", program.source, begun.elapsed().as_secs_f64());
        said.lines().for_each(|line| counts.read(line));
        if !passed {
            failed.push((program, failures(&said)));
        }
    };
    alone.into_iter().for_each(run_one);
    let waiting = Mutex::new(together);
    // From both ends, so that one that computes runs beside one that waits.
    let next = |worker: usize| {
        let mut waiting = waiting.lock().expect("nobody panics with it");
        if worker.is_multiple_of(2) { waiting.pop_front() } else { waiting.pop_back() }
    };
    std::thread::scope(|scope| {
        for worker in 0..std::thread::available_parallelism().map_or(2, NonZero::get) {
            let (next, run_one) = (&next, &run_one);
            scope.spawn(move || {
                while let Some(program) = next(worker) {
                    run_one(program);
                }
            });
        }
    });
    let (counts, failed) = told.into_inner().expect("nobody has panicked with it");
    let (mut alone, mut twice) = (Vec::new(), Vec::new());
    for (program, tests) in failed {
        let mut command = command(&program);
        command.args(["--exact", "--test-threads=1"]).args(&tests);
        let (passed, said) = if (1..=AGAIN).contains(&tests.len()) { play(&mut command) } else { Default::default() };
        println!("{said}");
        // None is as good as failed: a name that no test has, or a program that ended before its tests did.
        let again = said.lines().fold(Counts::default(), |mut sum, line| {
            sum.read(line);
            sum
        });
        if passed && again.passed as usize == tests.len() {
            counts.failed -= again.passed;
            counts.passed += again.passed;
            alone.extend(tests);
        } else {
            twice.push(program.source);
        }
    }
    twice.sort();
    if twice.is_empty() { Ok(alone) } else { Err(format!("failed: {}", twice.join(", "))) }
}

/// The tests that a harness lists last, each on a line of its own, as those that failed.
fn failures(said: &str) -> Vec<String> {
    let list = said.rsplit_once("\nfailures:\n").map_or("", |(_, list)| list);
    let names = list.lines().map_while(|line| line.strip_prefix("    "));
    names.map(str::to_owned).collect()
}

/// Those that run alone; and the others, the longest computing first and the longest waiting last.
fn ordered(programs: Vec<Program>) -> (Vec<Program>, VecDeque<Program>) {
    let (alone, mut together): (Vec<_>, Vec<_>) =
        programs.into_iter().partition(|program| ALONE.contains(&program.source.as_str()));
    let place = |list: &[&str], program: &Program| list.iter().position(|source| *source == program.source);
    together.sort_by_key(|program| {
        let first = place(&COMPUTING, program).unwrap_or(COMPUTING.len());
        (first, place(&WAITING, program).map_or(0, |place| WAITING.len() - place))
    });
    (alone, together.into())
}

/// Whether a program succeeds, and what it says.
fn play(command: &mut Command) -> (bool, String) {
    match command.stdin(Stdio::null()).output() {
        Ok(output) => {
            let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
            (output.status.success(), said.concat())
        }
        Err(error) => (false, format!("cannot start {}: {error}\n", command.get_program().display())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn a_program(source: &str) -> Program {
        Program { source: source.into(), executable: "true".into(), package: ".".into() }
    }

    #[test]
    fn the_files_that_are_named_are_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for source in ALONE.iter().chain(&COMPUTING).chain(&WAITING) {
            assert!(root.join(source).is_file(), "{source}");
        }
    }

    #[test]
    fn a_program_of_tests_is_told_from_what_cargo_says() {
        let message = |test: &str, executable: &str| {
            format!(
                r#"{{"reason":"compiler-artifact","manifest_path":"/w/crates/rt/Cargo.toml","profile":{{"test":{test}}},
                "target":{{"src_path":"/w/crates/rt/tests/slot.rs"}},"executable":{executable}}}"#
            )
        };
        let told = |line: &str| program(Path::new("/w"), line);
        let found = told(&message("true", r#""/t/slot-1""#)).expect("it is one");
        assert_eq!(found.source, "crates/rt/tests/slot.rs");
        assert_eq!(found.executable, Path::new("/t/slot-1"));
        assert_eq!(found.package, Path::new("/w/crates/rt"));
        // A library, a program that others start, other messages, and what is none.
        assert_eq!(told(&message("true", "null")), None);
        assert_eq!(told(&message("false", r#""/t/slot-1""#)), None);
        assert_eq!(told(r#"{"reason":"build-finished","success":true}"#), None);
        assert_eq!(told("running 3 tests"), None);
    }

    #[test]
    fn what_computes_is_first_what_waits_last_and_none_is_lost() {
        let all = [WAITING[0], "some/other.rs", COMPUTING[1], ALONE[0], WAITING[1], COMPUTING[0]];
        let (alone, together) = ordered(all.map(a_program).into());
        assert_eq!(alone, [a_program(ALONE[0])]);
        let expected = [COMPUTING[0], COMPUTING[1], "some/other.rs", WAITING[1], WAITING[0]];
        assert_eq!(together, expected.map(a_program));
    }

    #[test]
    fn all_run_all_are_counted_and_those_that_fail_are_named() {
        let mut counts = Counts::default();
        let outcome = run_by(["a", "b", "c", "d"].map(a_program).into(), &mut counts, |program| {
            let (program, script) = match program.source.as_str() {
                "a" => ("sh", "echo 'test result: ok. 3 passed; 0 failed; 1 ignored'"),
                "b" => ("sh", "echo 'test result: FAILED. 2 passed; 1 failed; 0 ignored'; exit 101"),
                "c" => ("no-such-program", ""),
                _ => ("sh", "exit 1"),
            };
            let mut command = Command::new(program);
            command.args(["-c", script]);
            command
        });
        assert_eq!(outcome, Err("failed: b, c, d".into()));
        assert_eq!(counts, Counts { passed: 5, failed: 1, skipped: 1 });
    }

    /// A harness of three tests; named are those that fail among others, then what happens to who is asked by name.
    fn harness(failing: &[&str], alone: &str) -> (Result<Vec<String>, String>, Counts) {
        let mut counts = Counts::default();
        let list: String = failing.iter().map(|name| format!("    {name}\n")).collect();
        let script = format!(
            r#"if [ "$1" = --exact ]; then {alone}; fi
            printf 'failures:\n\n---- one stdout ----\nit panics:\n    not a name\n\nfailures:\n{list}\n'
            printf 'test result: FAILED. 1 passed; {} failed; 0 ignored\n'; exit 101"#,
            failing.len(),
        );
        let outcome = run_by(vec![a_program("it")], &mut counts, |_| {
            let mut command = Command::new("sh");
            command.args(["-c", &script, "sh"]);
            command
        });
        (outcome, counts)
    }

    #[test]
    fn a_test_that_passes_alone_is_told_and_one_that_fails_twice_fails() {
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
        assert_eq!((outcome, counts.failed), (Err("failed: it".into()), 5), "so many are no chance");
    }

    #[test]
    fn no_programs_are_no_passed_tests() {
        assert!(run(Vec::new(), Path::new("."), &mut Counts::default()).is_err());
    }
}
