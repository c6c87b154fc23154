//! Golden files: accepts what the program gives now.

use std::process::Command;

use crate::{python, test, tree};

/// Runs the tests so that those with golden files write them instead of comparing.
pub(crate) fn bless() -> Result<(), String> {
    let root = tree::root()?;
    let mut tests = test::cargo(&root, ["test", "--workspace", "--quiet"]);
    // The first is read by expect-test, the second by trybuild.
    test::run(tests.env("UPDATE_EXPECT", "1").env("TRYBUILD", "overwrite"))?;
    python::bless(&root, &test::target_folder(&root))?;
    println!("Blessed. What changed:");
    test::run(Command::new("git").current_dir(&root).args(["status", "--short"]))
}
