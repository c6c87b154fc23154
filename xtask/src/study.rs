//! `cargo xtask study NAME`: studies that are too long for the tests. The result is committed; a test compares a part
//! of it with the program.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use crate::command::{Cargo, output, run};
use crate::tree;
use crate::workspace::{Kind, Workspace};

/// The package whose examples contain the studies.
const PACKAGE: &str = "stickslip";
/// The study whose page is written from the output of its test program.
const GENERATED_C: &str = "generated-c";
/// The study of mutated files, which runs as long as is requested.
const FUZZ: &str = "fuzz";
/// Its number of minutes, as an environment variable of the test program.
const FUZZ_MINUTES: &str = "STICKSLIP_FUZZ_MINUTES";
/// Folder of the results, relative to the root of the repository.
const FOLDER: &str = "docs/studies";

/// Studies that are test programs: their name, package, program, and the arguments of the program.
const PROGRAMS: [(&str, &str, &str, &[&str]); 3] = [
    (FUZZ, "stickslip", "laboratory", &["--ignored", "--nocapture", "fuzz::"]),
    (GENERATED_C, "stickslip-codegen", "long", &[]),
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
        let command = [&test[..], arguments].concat();
        if name != GENERATED_C {
            return cargo.run(command);
        }
        let printed = output(&mut cargo.command(command))?;
        let page = passed_page(&String::from_utf8_lossy(&printed), &compilers());
        let file = root.join(FOLDER).join(format!("{name}.md"));
        return std::fs::write(&file, page).map_err(|error| tree::failure("write", &file, &error));
    }
    cargo.run(["run", "--quiet", "--release", "--package", PACKAGE, "--example", name, "--", FOLDER])
}

/// Reads mutated files of every format for a number of minutes.
pub(crate) fn fuzz(minutes: &str) -> Result<(), String> {
    if !minutes.parse::<f64>().is_ok_and(|minutes| minutes.is_finite() && minutes > 0.0) {
        return Err(format!("--minutes {minutes}: a positive number is required"));
    }
    let root = tree::root()?;
    let Some((_, package, program, arguments)) = PROGRAMS.iter().find(|(study, ..)| *study == FUZZ) else {
        return Err(format!("unknown study \"{FUZZ}\""));
    };
    let cargo = Cargo::new(&root, &root);
    let mut command =
        cargo.command([&["test", "--release", "--package", package, "--test", program, "--"], *arguments].concat());
    run(command.env(FUZZ_MINUTES, minutes))
}

/// First line of `--version` of each C compiler that the study uses.
fn compilers() -> Vec<String> {
    let version = |name: &str| {
        let output = Command::new(name).arg("--version").output().ok()?;
        Some(String::from_utf8_lossy(&output.stdout).lines().next()?.to_owned())
    };
    ["gcc", "clang"].into_iter().filter_map(version).collect()
}

/// The page of a passed study: its command, the compilers and the tests. Only a program that passed is given.
fn passed_page(printed: &str, compilers: &[String]) -> String {
    let mut page = format!(
        "# Generated C, bit for bit\n\n\
         Output and state of each block are equal in Rust and in generated C, bit for bit, in every tick: a million ticks \
         in double precision (100,000 for blocks of more than 30,000 operations) and 100,000 in single precision, compiled \
         with `-O2` for the baseline and with `-O3 -march=native`. Written by `cargo xtask study {GENERATED_C}`.\n\n"
    );
    compilers.iter().for_each(|compiler| {
        let _ = writeln!(page, "- compiler: {compiler}");
    });
    page += "\n| test | result |\n|-|-|\n";
    let results = printed.lines().filter_map(|line| line.strip_prefix("test ")?.split_once(" ... "));
    let mut results: Vec<_> = results.filter(|(_, result)| *result == "ok").collect();
    results.sort_unstable();
    results.iter().for_each(|(test, _)| {
        let _ = writeln!(page, "| `{test}` | passed |");
    });
    page
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
    fn an_invalid_number_of_minutes_is_refused() {
        for minutes in ["", "0", "-1", "inf", "long"] {
            assert!(fuzz(minutes).expect_err("invalid").contains("a positive number is required"), "{minutes}");
        }
    }

    #[test]
    fn the_page_of_a_passed_study_lists_its_tests_and_compilers() {
        let printed = "running 2 tests\ntest pid ... ok\ntest lag ... ok\n\ntest result: ok. 2 passed; 0 failed\n";
        let page = passed_page(printed, &["gcc 13".into()]);
        assert!(
            page.ends_with("- compiler: gcc 13\n\n| test | result |\n|-|-|\n| `lag` | passed |\n| `pid` | passed |\n")
        );
    }

    #[test]
    fn every_block_is_in_the_result_of_the_study_of_generated_c() {
        let root = tree::root().expect("cargo sets CARGO_MANIFEST_DIR");
        let read = |file: &str| std::fs::read_to_string(root.join(file)).expect("a file of the repository");
        let (list, page) = (read("crates/codegen/tests/support/list.rs"), read("docs/studies/generated-c.md"));
        let blocks = list.split("agree!(").skip(1).filter_map(|line| Some(line.split_once(',')?.0.trim()));
        let missing: Vec<_> = blocks.filter(|block| !page.contains(&format!("| `{block}` |"))).collect();
        assert!(missing.is_empty(), "run cargo xtask study generated-c: it lacks {missing:?}");
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
