//! Forbidden uses: `std` in the core, the virtual machine where something is measured, locks within the
//! deadline.

use std::collections::BTreeSet;
use std::path::PathBuf;

use xtask::workspace::{Kind, Package, Workspace};

use crate::{root, sample, sources, text, without_tests, workspace};

#[test]
fn the_core_has_no_std_and_no_unsafe() {
    for name in ["core", "software"] {
        let root = text(format!("crates/{name}/src/lib.rs"));
        for attribute in ["#![no_std]", "#![forbid(unsafe_code)]"] {
            assert!(root.lines().any(|line| line == attribute), "crates/{name}/src/lib.rs lacks {attribute}");
        }
    }
}

/// Folders and files, below `crates`, of controllers, laws, experiments, fits, identification and design.
const MEASURING: [&str; 9] = [
    "core/src/control",
    "core/src/render",
    "software/src",
    "core/src/tick/decoder.rs",
    "core/src/tick/mod.rs",
    "design/src",
    "experiment/src",
    "fit/src",
    "identify/src",
];

/// Parts of these that set up the virtual bench for a user, or compare a result with the true machine.
const NOT_MEASURING: [&str; 4] =
    ["experiment/src/demo", "experiment/src/load", "experiment/src/true_friction.rs", "experiment/src/workflow"];

/// Lines outside tests that use the virtual machine: its parameters, the inside of its sensors, its true state.
fn uses_of_the_true_machine(source: &str) -> Vec<&str> {
    const FORBIDDEN: [&str; 7] =
        ["plant::", "sensor::", "true_friction::", "::plant", "true_plant(", "true_state(", "VirtualBench"];
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    code.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .filter(|line| FORBIDDEN.iter().any(|word| line.contains(word)))
        .collect()
}

#[test]
fn controllers_laws_and_experiments_do_not_use_the_virtual_machine() {
    let path = |name: &str| root().join("crates").join(name);
    let (mut files, folders): (Vec<PathBuf>, Vec<_>) = MEASURING.iter().map(|it| path(it)).partition(|it| it.is_file());
    files.extend(folders.iter().flat_map(|folder| sources(folder)));
    files.retain(|file| !NOT_MEASURING.iter().any(|it| file.starts_with(path(it))));
    assert!(files.len() > 30);
    let mut wrong = Vec::new();
    for file in files {
        let source = text(&file);
        // The tick declares the module that closes it over the virtual machine.
        let lines =
            uses_of_the_true_machine(&source).into_iter().filter(|line| !line.contains("pub use virtual_bench::"));
        wrong.extend(lines.map(|line| format!("{}: {line}", file.display())));
    }
    assert_eq!(wrong, [""; 0]);
}

#[test]
fn a_use_of_the_virtual_machine_is_found() {
    let cheat = "use stickslip_core::plant::Plant;\nlet x = 1;\n#[cfg(test)]\nuse crate::true_friction::own_curve;\n";
    assert_eq!(uses_of_the_true_machine(cheat), ["use stickslip_core::plant::Plant;"]);
    for cheat in ["let own = bench.true_plant().own;", "let state = bench.true_state();"] {
        assert_eq!(uses_of_the_true_machine(cheat), [cheat]);
    }
}

/// Words of types and functions that wait for another thread.
fn locks(source: &str) -> Vec<&str> {
    const LOCKS: [&str; 9] =
        ["Mutex", "RwLock", "Condvar", "Barrier", "OnceLock", "LazyLock", "mpsc", ".join()", "thread::"];
    let code = without_tests(source);
    LOCKS.into_iter().filter(|lock| code.contains(lock)).collect()
}

/// The files that run within the deadline: `deadline` in `[package.metadata.stickslip]`. The rest that does is
/// `crates/core` and `crates/software`, which have no `std` and thus no locks.
fn within_the_deadline(workspace: &Workspace) -> Vec<PathBuf> {
    let files = |package: &Package| -> Vec<PathBuf> {
        package.listed("deadline").into_iter().map(|file| package.folder.join(file)).collect()
    };
    workspace.packages.iter().flat_map(files).collect()
}

#[test]
fn nothing_within_the_deadline_waits_for_another_thread() {
    let files = within_the_deadline(&workspace());
    assert!(!files.is_empty(), "no manifest lists `deadline` in [package.metadata.stickslip]");
    for file in files {
        assert_eq!(locks(&text(&file)), [""; 0], "{}", file.display());
    }
}

#[test]
fn a_lock_is_found_in_a_listed_file() {
    assert_eq!(locks("use std::sync::Mutex;\nfn step() { shared.lock(); }"), ["Mutex"]);
    assert_eq!(locks("fn step() {}\n#[cfg(test)]\nmod tests { use std::sync::mpsc; }"), [""; 0]);
    let workspace = sample(&[("rt", &[], serde_json::json!({ "deadline": ["src/cycle.rs"] }))]);
    assert_eq!(within_the_deadline(&workspace), [PathBuf::from("crates/rt/src/cycle.rs")]);
}

#[test]
fn manifests_have_known_lists_and_name_test_programs_that_exist() {
    for package in &workspace().packages {
        for key in package.lists() {
            assert!(["alone", "deadline", "waits"].contains(&key), "{}: unknown list {key}", package.name);
        }
        let tested = package.targets.iter().filter(|target| target.is_tested);
        let name = |kind, name| if kind == Kind::Library { "lib" } else { name };
        let programs: BTreeSet<_> = tested.map(|target| name(target.kind, target.name.as_str())).collect();
        for program in ["alone", "waits"].into_iter().flat_map(|list| package.listed(list)) {
            assert!(programs.contains(program), "{}: no test program {program} among {programs:?}", package.name);
        }
    }
}
