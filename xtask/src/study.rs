//! `cargo xtask study NAME`: studies that are too long for the tests. The result is committed; a test compares a part
//! of it with the program.

use std::path::Path;

use crate::command::Cargo;
use crate::tree;
use crate::workspace::{Kind, Workspace};

/// The package whose examples contain the studies.
const PACKAGE: &str = "stickslip";
/// Folder of the results, relative to the root of the repository.
const FOLDER: &str = "docs/studies";

/// Studies that are test programs: their name, package, program, and the arguments of the program. They pass or fail.
const PROGRAMS: [(&str, &str, &str, &[&str]); 2] = [
    ("generated-c", "stickslip-codegen", "long", &[]),
    ("processor", "stickslip-agree", "all", &["--ignored", "processor::"]),
];

/// Lists the studies.
pub(crate) fn list() -> Result<(), String> {
    println!("{}", studies(&Workspace::read(&tree::root()?)?).join("\n"));
    Ok(())
}

/// Runs a study, optimised as the program of users.
pub(crate) fn study(name: &str) -> Result<(), String> {
    let root = tree::root()?;
    let names = studies(&Workspace::read(&root)?);
    if !names.iter().any(|study| study == name) {
        return Err(format!("unknown study \"{name}\"; the studies are {}", names.join(", ")));
    }
    let cargo = Cargo::new(&root, &root);
    if let Some((_, package, program, arguments)) = PROGRAMS.iter().find(|(study, ..)| *study == name) {
        let test = ["test", "--release", "--package", package, "--test", program, "--"];
        return cargo.run([&test[..], arguments].concat());
    }
    cargo.run(["run", "--quiet", "--release", "--package", PACKAGE, "--example", name, "--", FOLDER])
}

/// The test programs, and the examples whose text contains the command that runs them as a study.
fn studies(workspace: &Workspace) -> Vec<String> {
    let examples = workspace.package(PACKAGE).into_iter().flat_map(|package| package.targets(Kind::Example));
    let studies = examples.filter(|example| is_study(&example.name, &workspace.root.join(&example.source)));
    let programs = PROGRAMS.iter().map(|(name, ..)| (*name).to_owned());
    studies.map(|example| example.name.clone()).chain(programs).collect()
}

fn is_study(name: &str, source: &Path) -> bool {
    std::fs::read_to_string(source).is_ok_and(|text| text.contains(&format!("cargo xtask study {name}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_study_is_refused_with_the_known_ones() {
        let refusal = study("coverige").expect_err("no example has that name");
        assert!(refusal.starts_with("unknown study \"coverige\"; the studies are "), "{refusal}");
        assert!(refusal.contains("coverage"), "{refusal}");
    }

    #[test]
    fn an_example_with_its_command_is_a_study() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let source = folder.path().join("main.rs");
        std::fs::write(&source, "//! Coverage.\n//!\n//!     cargo xtask study coverage\n").expect("it can be written");
        assert!(is_study("coverage", &source));
        assert!(!is_study("margins", &source));
    }
}
