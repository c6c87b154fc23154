//! The part `rust`: format, lints, licences, other targets, tests, documentation.

use crate::budget::{BARE_CORE, COMPILE, DOC_TESTS, DOCUMENTATION, FORMAT, LICENCES, LINTS, TESTS, WINDOWS};
use crate::command::{Cargo, json, run, run_counting};
use crate::programs::Program;
use crate::record::Record;
use crate::schedule::Times;
use crate::suite::{Outcome, Suite};
use crate::test::Run;
use crate::tools::{BARE_TARGET, Tools, WINDOWS_TARGET};
use crate::workspace::Workspace;
use crate::{documentation, licences, programs};

/// Number of slowest test programs in the summary.
const SLOWEST: usize = 10;

pub(crate) fn check(Run { suite, tools, cargo, record }: &mut Run) {
    suite.stage(FORMAT, |_| only_with(tools.rustfmt, "rustfmt", || cargo.run(["fmt", "--all", "--check"])));
    suite.stage(LINTS, |_| {
        let lints = ["clippy", "--workspace", "--all-targets", "--locked", "--quiet", "--", "-D", "warnings"];
        // The tests build this crate with its optional main device only.
        let default =
            ["clippy", "--package", "stickslip-fieldbus", "--lib", "--locked", "--quiet", "--", "-D", "warnings"];
        only_with(tools.clippy, "clippy", || cargo.run(lints).and_then(|outcome| cargo.run(default).map(|_| outcome)))
    });
    suite.stage(LICENCES, |_| {
        licences::check(&json(&mut cargo.command(["metadata", "--format-version", "1", "--locked"]))?)?;
        Ok(Outcome::Passed)
    });
    suite.stage(BARE_CORE, |_| bare_core(cargo, tools));
    suite.stage(WINDOWS, |_| windows(cargo, tools));
    tests(suite, cargo, record);
    suite.stage(DOCUMENTATION, |_| document(cargo));
}

/// Builds the core and the software of the bench without `std`.
fn bare_core(cargo: &Cargo, tools: &Tools) -> Result<Outcome, String> {
    let build = ["build", "--package", "stickslip-software", "--locked", "--quiet"];
    if tools.bare_target {
        cargo.run([&build[..], &["--target", BARE_TARGET]].concat())?;
        return Ok(Outcome::Passed);
    }
    cargo.run(build)?;
    Ok(Outcome::Skipped(format!("built for this machine only, not for {BARE_TARGET}")))
}

/// Checks the program and all crates that it consists of for Windows.
fn windows(cargo: &Cargo, tools: &Tools) -> Result<Outcome, String> {
    if !tools.windows_target {
        return Ok(Outcome::Skipped(format!("target {WINDOWS_TARGET} is missing")));
    }
    let workspace = Workspace::read(&cargo.folder)?;
    let packages = workspace.used_by(&["stickslip-cli"]);
    let mut check = cargo.command(["check", "--locked", "--quiet", "--target", WINDOWS_TARGET]);
    run(check.args(packages.iter().flat_map(|package| ["--package", package])))?;
    Ok(Outcome::Passed)
}

fn tests(suite: &mut Suite, cargo: &Cargo, record: &mut Record) {
    let mut compiled = Vec::new();
    suite.stage(COMPILE, |_| {
        // Without the examples: the lints check them, and tests check their results.
        let tests = ["test", "--workspace", "--tests", "--locked", "--quiet"];
        compiled = programs::compile(&Workspace::read(&cargo.folder)?, record, &mut cargo.command(tests))?;
        Ok(Outcome::Passed)
    });
    let were_compiled = !compiled.is_empty();
    let mut times = Times::of_last_run(&cargo.target);
    suite.stage(TESTS, |counts| {
        let command = |program: &Program| programs::command(program, &cargo.target);
        let retried = programs::run(compiled, &mut times, record, counts, command)?;
        Ok(if retried.is_empty() { Outcome::Passed } else { Outcome::Retried(retried) })
    });
    if were_compiled {
        times.store(&cargo.target);
        suite.slowest = times.slowest(SLOWEST);
    }
    suite.stage(DOC_TESTS, |counts| {
        run_counting(&mut cargo.command(["test", "--workspace", "--doc", "--locked", "--quiet"]), counts)?;
        Ok(Outcome::Passed)
    });
}

fn document(cargo: &Cargo) -> Result<Outcome, String> {
    // The libraries alone: the program and the library of the same name would write the same pages.
    let output = cargo.command(["doc", "--workspace", "--lib", "--no-deps", "--locked"]).output();
    let output = output.map_err(|error| format!("cannot start cargo doc: {error}"))?;
    let stderr = String::from_utf8_lossy(&output.stderr);
    let problems = documentation::problems(&stderr);
    if output.status.success() && problems.is_empty() {
        return Ok(Outcome::Passed);
    }
    eprint!("{stderr}");
    Err(format!("{} problems: {}", problems.len(), problems.join("; ")))
}

/// Runs a check that needs a part of the tool chain.
fn only_with(available: bool, part: &str, check: impl FnOnce() -> Result<(), String>) -> Result<Outcome, String> {
    if available { check().map(|()| Outcome::Passed) } else { Ok(Outcome::Skipped(format!("{part} is missing"))) }
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
}
