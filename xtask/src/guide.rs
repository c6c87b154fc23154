//! The part `guide`: the book by mdBook, and the tests of its commands, links, files and symbols, which need no mdBook.

use std::path::Path;
use std::process::Command;

use crate::budget::{GUIDE, GUIDE_TESTS};
use crate::command::run_counting;
use crate::suite::Outcome;
use crate::test::Run;

/// The test program of the command line and the names of its tests that run the commands of the guide. The part `rust`
/// runs them with all others.
const TESTS: [&str; 2] = ["program", "guide::"];

/// Builds the book, and runs the tests of the guide unless they have run.
pub(crate) fn check(Run { suite, cargo, .. }: &mut Run, with_tests: bool) {
    suite.stage(GUIDE, |_| build("mdbook", &cargo.folder, &cargo.target.join("guide")));
    if with_tests {
        suite.stage(GUIDE_TESTS, |counts| {
            // `--workspace` for the features that the part `rust` builds with.
            let [program, names] = TESTS;
            let test = ["test", "--workspace", "--locked", "--quiet", "--test", program, names];
            run_counting(&mut cargo.command(test), counts)?;
            Ok(Outcome::Passed)
        });
    }
}

/// Builds the book of a tree into a folder.
fn build(program: &str, tree: &Path, into: &Path) -> Result<Outcome, String> {
    let mut command = Command::new(program);
    let output = match command.arg("build").arg(tree.join("docs")).arg("--dest-dir").arg(into).output() {
        Ok(output) => output,
        Err(error) => {
            let remedy = "`cargo install mdbook --no-default-features --locked`";
            return Ok(Outcome::Skipped(format!("cannot start {program} ({error}); {remedy}")));
        }
    };
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    judge(program, output.status.success(), &text)
}

/// The result of a program with this output and exit status.
fn judge(program: &str, succeeded: bool, output: &str) -> Result<Outcome, String> {
    // mdBook reports an included file that is missing and builds the book without it.
    let problems: Vec<&str> = output.lines().filter(|line| is_problem(line)).collect();
    if succeeded && problems.is_empty() {
        return Ok(Outcome::Passed);
    }
    eprint!("{output}");
    Err(format!("{program} reports: {}", problems.join("; ")))
}

fn is_problem(line: &str) -> bool {
    ["ERROR", "WARN"].iter().any(|word| line.contains(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_and_a_failure_are_errors() {
        let start = " INFO Book building has started";
        assert!(matches!(judge("mdbook", true, start), Ok(Outcome::Passed)));
        assert!(judge("mdbook", false, start).is_err());
        let incomplete = judge("mdbook", true, "ERROR Error updating \"{{#include gone.md}}\"").map(|_| ());
        assert!(incomplete.is_err_and(|reason| reason.contains("gone.md")));
        assert!(build("false", Path::new("."), Path::new(".")).is_err());
    }

    #[test]
    fn without_mdbook_the_stage_is_skipped_with_the_remedy() {
        let skipped = build("no-such-mdbook", Path::new("."), Path::new("."));
        assert!(matches!(skipped, Ok(Outcome::Skipped(reason)) if reason.contains("cargo install mdbook")));
    }
}
