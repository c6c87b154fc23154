//! Golden files: replaces them by the current output.

use std::process::Command;

use crate::command::{Cargo, run};
use crate::{python, tree};

/// Runs the tests so that those with golden files write them instead of comparing.
pub(crate) fn bless() -> Result<(), String> {
    let root = tree::root()?;
    let cargo = Cargo::new(&root, &root);
    // expect-test reads the first variable, trybuild the second.
    let mut tests = cargo.command(["test", "--workspace", "--quiet"]);
    run(tests.env("UPDATE_EXPECT", "1").env("TRYBUILD", "overwrite"))?;
    python::bless(&cargo)?;
    println!("Golden files rewritten. Changed files:");
    run(Command::new("git").current_dir(&root).args(["status", "--short"]))
}
