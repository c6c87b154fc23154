//! `cargo xtask test`: everything that must hold, stage by stage.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::Value;

use crate::suite::{Counts, Outcome, Suite};
use crate::tools::{BARE_TARGET, WINDOWS_TARGET};
use crate::{documentation, guide, licences, programs, python, tools, tree};

/// Runs all stages in a copy of the tracked files. `Err` if one failed.
pub(crate) fn test() -> Result<(), String> {
    let root = tree::root()?;
    let copy = tree::copy_of(&root);
    let files = tree::files(&root)?;
    let mut suite = Suite::default();

    let mut tools = None;
    suite.stage("tools", seconds(120), |_| {
        tools = Some(tools::ensure());
        Ok(Outcome::Passed)
    });
    let tools = tools.expect("the stage has run");
    for line in &tools.missing {
        suite.skip(line.clone());
    }
    suite.stage("copy of the tracked files", seconds(10), |_| {
        tree::mirror(&root, &files, &copy)?;
        println!("{} files in {}", files.len(), copy.display());
        Ok(Outcome::Passed)
    });

    // The copy builds into the repository's target folder: each dependency is built once, for both.
    let target = target_folder(&root);
    let cargo = |arguments: &[&str]| {
        let mut command = cargo(&copy, arguments);
        command.env("CARGO_TARGET_DIR", &target);
        command
    };
    suite.stage("format", seconds(10), |_| {
        only_with(tools.rustfmt, "rustfmt", || run(&mut cargo(&["fmt", "--all", "--check"])))
    });
    suite.stage("lints", seconds(250), |_| {
        let lints = ["clippy", "--workspace", "--all-targets", "--locked", "--quiet", "--", "-D", "warnings"];
        only_with(tools.clippy, "clippy", || run(&mut cargo(&lints)))
    });
    suite.stage("licences", seconds(10), |_| {
        licences::check(&metadata(&mut cargo(&["metadata", "--format-version", "1", "--locked"]))?)?;
        Ok(Outcome::Passed)
    });
    suite.stage("core without std", seconds(30), |_| {
        let build = ["build", "--package", "stickslip-core", "--locked", "--quiet"];
        if tools.bare_target {
            run(&mut cargo(&[&build[..], &["--target", BARE_TARGET]].concat()))?;
            Ok(Outcome::Passed)
        } else {
            run(&mut cargo(&build))?;
            Ok(Outcome::Skipped(format!("built for this machine only, not for {BARE_TARGET}")))
        }
    });
    suite.stage("Windows compiles", seconds(130), |_| {
        if !tools.windows_target {
            return Ok(Outcome::Skipped(format!("target {WINDOWS_TARGET} is missing")));
        }
        let packages = ["check", "--package", "stickslip", "--package", "stickslip-cli", "--tests"];
        run(&mut cargo(&[&packages[..], &["--locked", "--quiet", "--target", WINDOWS_TARGET]].concat()))?;
        Ok(Outcome::Passed)
    });
    let packages = python::prepare(&target);
    let mut compiled = Vec::new();
    suite.stage("tests compile", seconds(950), |_| {
        // Without the examples: the lints have checked them, and tests of their own hold what they compute.
        let tests = ["test", "--workspace", "--tests", "--locked", "--quiet"];
        compiled = programs::compile(&copy, &mut cargo(&tests))?;
        Ok(Outcome::Passed)
    });
    suite.stage("tests", seconds(950), |counts| {
        let programs = programs::run(compiled, &target, counts);
        let documented = run_counting(&mut cargo(&["test", "--workspace", "--doc", "--locked", "--quiet"]), counts);
        match (programs?, documented?) {
            (again, ()) if again.is_empty() => Ok(Outcome::Passed),
            (again, ()) => Ok(Outcome::Again(again)),
        }
    });
    // The tests have left the program; another build of it would have other features, and take minutes.
    let program = target.join("debug").join(format!("stickslip{}", std::env::consts::EXE_SUFFIX));
    let built = || match program.exists() {
        true => Ok(()),
        false => run(&mut cargo(&["build", "--package", "stickslip-cli", "--locked", "--quiet"])),
    };
    suite.stage("python", seconds(270), |counts| {
        built()?;
        python::check(packages, &copy, &target, &program, counts)
    });
    suite.stage("page", seconds(500), |_| {
        let web = copy.join("web");
        if !tools::works("node") || !tools::works("npm") {
            return Ok(Outcome::Skipped("npm is missing".into()));
        }
        if !web.join("node_modules").exists() {
            run(npm(&web).args(["ci", "--no-audit", "--no-fund", "--silent"]))?;
        }
        run(npm(&web).args(["run", "--silent", "check"]))?;
        run(npm(&web).args(["run", "--silent", "unit"]))?;
        let chromium = std::env::var("CHROMIUM").unwrap_or_else(|_| "chromium".into());
        if !tools::works(&chromium) {
            return Ok(Outcome::Skipped("checked without a browser: chromium is missing".into()));
        }
        built()?;
        run(npm(&web).args(["run", "--silent", "browser"]).env("STICKSLIP", &program))?;
        Ok(Outcome::Passed)
    });
    suite.stage("documentation", seconds(40), |_| {
        // Libraries alone: the program and the library of one name would write the same pages.
        let output = cargo(&["doc", "--workspace", "--lib", "--no-deps", "--locked"]).output();
        let output = output.map_err(|error| format!("cannot start cargo doc: {error}"))?;
        let stderr = String::from_utf8_lossy(&output.stderr);
        let complaints = documentation::complaints(&stderr);
        if output.status.success() && complaints.is_empty() {
            return Ok(Outcome::Passed);
        }
        eprint!("{stderr}");
        Err(format!("{} complaints: {}", complaints.len(), complaints.join("; ")))
    });
    suite.stage("guide", seconds(10), |_| guide::build(&copy, &target.join("guide")));
    suite.stage("nothing left behind", seconds(5), |_| {
        let litter = tree::litter(&root, &files, &copy)?;
        let names: Vec<_> = litter.iter().map(|path| path.display().to_string()).collect();
        if names.is_empty() { Ok(Outcome::Passed) } else { Err(format!("a test wrote {}", names.join(", "))) }
    });

    println!("\n{}", suite.summary());
    if suite.passed() { Ok(()) } else { Err("not ready: see `failed:` above".into()) }
}

/// npm in a folder.
fn npm(folder: &Path) -> Command {
    let mut command = Command::new("npm");
    command.current_dir(folder);
    command
}

const fn seconds(number: u64) -> Duration {
    Duration::from_secs(number)
}

/// Cargo in a folder, with the arguments given.
pub(crate) fn cargo<A: AsRef<OsStr>>(folder: &Path, arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new("cargo");
    command.current_dir(folder).args(arguments);
    command
}

/// `Err` with the command unless it succeeds.
pub(crate) fn run(command: &mut Command) -> Result<(), String> {
    let status = command.status().map_err(|error| format!("cannot start {}: {error}", line(command)))?;
    if status.success() { Ok(()) } else { Err(format!("{} failed", line(command))) }
}

/// As [`run`], counting the tests that it reports.
pub(crate) fn run_counting(command: &mut Command, counts: &mut Counts) -> Result<(), String> {
    let failure = |error: std::io::Error| format!("cannot read what the tests say: {error}");
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(failure)?;
    let output = child.stdout.take().expect("the output is piped");
    for line in BufReader::new(output).lines() {
        let line = line.map_err(failure)?;
        println!("{line}");
        counts.read(&line);
    }
    let status = child.wait().map_err(failure)?;
    if status.success() { Ok(()) } else { Err(format!("{} failed", line(command))) }
}

/// What a command that prints JSON prints.
fn metadata(command: &mut Command) -> Result<Value, String> {
    let output = command.stderr(Stdio::inherit()).output();
    let output = output.map_err(|error| format!("cannot start {}: {error}", line(command)))?;
    serde_json::from_slice(&output.stdout).map_err(|error| format!("{}: {error}", line(command)))
}

/// Runs a check that needs a part of the tool chain.
fn only_with(there: bool, part: &str, check: impl FnOnce() -> Result<(), String>) -> Result<Outcome, String> {
    if there { check().map(|()| Outcome::Passed) } else { Ok(Outcome::Skipped(format!("{part} is missing"))) }
}

/// Where cargo builds to.
pub(crate) fn target_folder(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |folder| root.join(folder))
}

fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_without_its_tool_is_skipped_and_not_run() {
        let outcome = only_with(false, "clippy", || Err("was run".into()));
        assert!(matches!(outcome, Ok(Outcome::Skipped(reason)) if reason == "clippy is missing"));
        assert!(only_with(true, "clippy", || Err("was run".into())).is_err());
    }

    #[test]
    fn a_command_that_fails_or_is_not_there_is_named() {
        let failed = run(Command::new("cargo").arg("no-such-subcommand").stderr(Stdio::null()));
        assert_eq!(failed, Err("cargo no-such-subcommand failed".into()));
        let absent = run(&mut Command::new("no-such-command")).expect_err("there is no such command");
        assert!(absent.starts_with("cannot start no-such-command: "), "{absent}");
    }

    #[test]
    fn a_command_that_prints_no_json_is_an_error() {
        assert!(metadata(Command::new("cargo").arg("--version")).is_err());
    }
}
