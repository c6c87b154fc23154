//! The guide as a book, laid out by mdBook where there is one.
//!
//! Its commands, links, files and symbols are checked by the tests of `stickslip-cli`, which need no mdBook.

use std::path::Path;
use std::process::Command;

use crate::suite::Outcome;

/// Builds the book of a tree into a folder.
pub(crate) fn build(tree: &Path, into: &Path) -> Result<Outcome, String> {
    build_with("mdbook", tree, into)
}

fn build_with(program: &str, tree: &Path, into: &Path) -> Result<Outcome, String> {
    let mut command = Command::new(program);
    let output = match command.arg("build").arg(tree.join("docs")).arg("--dest-dir").arg(into).output() {
        Ok(output) => output,
        Err(error) => {
            let remedy = "`cargo install mdbook --no-default-features --locked`";
            return Ok(Outcome::Skipped(format!("cannot start {program} ({error}); {remedy}")));
        }
    };
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    judge(program, output.status.success(), &said)
}

/// Whether a program that said this and ended so has made a book.
fn judge(program: &str, succeeded: bool, said: &str) -> Result<Outcome, String> {
    // A file that is not there to be included is told of, and the book built without it.
    let complaints: Vec<&str> = said.lines().filter(|line| complains(line)).collect();
    if succeeded && complaints.is_empty() {
        return Ok(Outcome::Passed);
    }
    eprint!("{said}");
    Err(format!("{program} complains: {}", complaints.join("; ")))
}

fn complains(line: &str) -> bool {
    ["ERROR", "WARN"].iter().any(|word| line.contains(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_book_with_a_complaint_or_a_failure_is_none() {
        let begun = " INFO Book building has started";
        assert!(matches!(judge("mdbook", true, begun), Ok(Outcome::Passed)));
        assert!(judge("mdbook", false, begun).is_err());
        let lacks = judge("mdbook", true, "ERROR Error updating \"{{#include gone.md}}\"").map(|_| ());
        assert!(lacks.is_err_and(|why| why.contains("gone.md")));
    }

    #[test]
    fn a_program_that_fails_makes_no_book() {
        assert!(build_with("false", Path::new("."), Path::new(".")).is_err());
    }

    #[test]
    fn without_mdbook_the_stage_is_skipped_with_the_remedy() {
        let skipped = build_with("no-such-mdbook", Path::new("."), Path::new("."));
        assert!(matches!(skipped, Ok(Outcome::Skipped(why)) if why.contains("cargo install mdbook")));
    }
}
