//! The house stands as ARCHITECTURE.md draws it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the repository").to_path_buf()
}

fn text(file: &str) -> String {
    std::fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// The workspace's members as Cargo sees them.
fn members() -> Vec<Value> {
    let arguments = ["metadata", "--format-version", "1", "--no-deps", "--offline"];
    let output = Command::new(env!("CARGO")).current_dir(root()).args(arguments).output().expect("cargo runs");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON");
    metadata["packages"].as_array().expect("a workspace has packages").clone()
}

/// The paths that a text names in backticks: with a slash or the ending of a file, and without a space.
fn paths(text: &str) -> BTreeSet<&str> {
    const ENDINGS: [&str; 6] = [".md", ".rs", ".toml", ".svg", ".json", ".csv"];
    let quoted = text.split('`').skip(1).step_by(2);
    quoted
        .filter(|word| word.contains('/') || ENDINGS.iter().any(|ending| word.ends_with(ending)))
        .filter(|word| !word.contains([' ', '<', '(', '←']))
        .collect()
}

fn absent(text: &str) -> Vec<&str> {
    paths(text).into_iter().filter(|path| !root().join(path).exists()).collect()
}

/// The cells of each row of the table below a heading; the head of the table is not among them.
fn table<'a>(text: &'a str, heading: &str) -> Vec<Vec<&'a str>> {
    let (_, section) = text.split_once(&format!("\n## {heading}\n")).expect("the heading exists");
    let section = section.split("\n## ").next().unwrap_or_default();
    let rows = section.lines().filter(|line| line.starts_with('|')).skip(2);
    rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

fn names(cell: &str) -> impl Iterator<Item = String> {
    cell.split(", ").filter(|name| !name.is_empty()).map(String::from)
}

/// An arrow of the house: user, used, whether only tests use it.
type Arrow = (String, String, bool);

fn declared_arrows(text: &str) -> BTreeSet<Arrow> {
    let mut arrows = BTreeSet::new();
    for row in table(text, "Crates") {
        arrows.extend(names(row[2]).map(|used| (row[1].to_string(), used, false)));
        arrows.extend(names(row[3]).map(|used| (row[1].to_string(), used, true)));
    }
    arrows
}

/// What the members' manifests say: within the house (by path) or without.
fn real_arrows(members: &[Value], within: bool) -> BTreeSet<Arrow> {
    let mut arrows = BTreeSet::new();
    for package in members {
        for used in package["dependencies"].as_array().expect("a package lists what it uses") {
            if used["path"].is_string() == within {
                let name = |value: &Value| value["name"].as_str().expect("a package has a name").to_string();
                arrows.insert((name(package), name(used), used["kind"] == "dev"));
            }
        }
    }
    arrows
}

#[test]
fn every_path_named_in_the_architecture_exists() {
    assert_eq!(absent(&text("ARCHITECTURE.md")), [] as [&str; 0]);
    assert_eq!(absent(&text("CONTRIBUTING.md")), [] as [&str; 0]);
}

#[test]
fn a_path_that_does_not_exist_is_found() {
    assert_eq!(
        absent("`crates/core`, `crates/nowhere`, `NOTHING.md`, `a ← b/c`, `MIT`"),
        ["NOTHING.md", "crates/nowhere"]
    );
}

#[test]
fn the_arrows_between_the_crates_are_those_of_the_architecture() {
    assert_eq!(real_arrows(&members(), true), declared_arrows(&text("ARCHITECTURE.md")), "left Cargo, right the table");
}

#[test]
fn every_crate_of_the_workspace_is_in_the_architecture() {
    let text = text("ARCHITECTURE.md");
    let declared: BTreeSet<_> = table(&text, "Crates").iter().map(|row| (row[0].trim_matches('`'), row[1])).collect();
    let members = members();
    let folder = |package: &Value| {
        let manifest = Path::new(package["manifest_path"].as_str().expect("a package has a manifest")).to_path_buf();
        let folder = manifest.parent().expect("a manifest lies in a folder");
        folder.strip_prefix(root()).expect("a member lies in the repository").display().to_string()
    };
    let real: Vec<_> = members.iter().map(|package| (folder(package), package["name"].as_str().unwrap())).collect();
    assert_eq!(real.iter().map(|(folder, name)| (folder.as_str(), *name)).collect::<BTreeSet<_>>(), declared);
}

#[test]
fn a_new_arrow_differs_from_the_table() {
    let table =
        "\n## Crates\n| folder | package | uses | tests | why |\n|-|-|-|-|-|\n| `a` | one | two | three, four | |\n";
    let arrow = |used: &str, tests| ("one".to_string(), used.to_string(), tests);
    assert_eq!(declared_arrows(table), [arrow("two", false), arrow("three", true), arrow("four", true)].into());
    let member = serde_json::json!({ "name": "one", "dependencies": [
        { "name": "two", "path": "/two", "kind": null },
        { "name": "five", "path": "/five", "kind": "dev" },
        { "name": "serde", "kind": null },
    ]});
    assert_eq!(real_arrows(&[member], true), [arrow("two", false), arrow("five", true)].into());
}

#[test]
fn every_dependency_has_its_line_in_the_architecture_and_every_line_its_dependency() {
    let text = text("ARCHITECTURE.md");
    let declared: BTreeSet<String> = table(&text, "Dependencies").iter().flat_map(|row| names(row[0])).collect();
    let real: BTreeSet<String> = real_arrows(&members(), false).into_iter().map(|(_, used, _)| used).collect();
    assert_eq!(real, declared, "left the manifests, right the table");
}

#[test]
fn the_core_has_no_std_and_no_unsafe() {
    let core = text("crates/core/src/lib.rs");
    for attribute in ["#![no_std]", "#![forbid(unsafe_code)]"] {
        assert!(core.lines().any(|line| line == attribute), "crates/core/src/lib.rs lacks {attribute}");
    }
}

/// Lines outside tests that reach into the virtual machine: its values, the inside of its sensors, the truth.
fn reaches_for_the_truth(source: &str) -> Vec<&str> {
    let code = source.split("#[cfg(test)]").next().unwrap_or_default();
    let forbidden = ["plant::", "sensor::", "truth::", "::plant", "::truth", "VirtualBench"];
    code.lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .filter(|line| forbidden.iter().any(|word| line.contains(word)))
        .collect()
}

#[test]
fn controllers_laws_and_experiments_do_not_see_the_virtual_machine() {
    let mut folders: Vec<PathBuf> = ["core/src/control", "core/src/render", "core/src/supervise", "lab/src/experiment"]
        .iter()
        .chain(&["lab/src/design", "lab/src/fit", "lab/src/identify"])
        .map(|folder| root().join("crates").join(folder))
        .collect();
    let mut files = vec![root().join("crates/core/src/tick/mod.rs"), root().join("crates/core/src/tick/decoder.rs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    assert!(files.len() > 30);
    for file in files.iter().filter(|file| !file.ends_with("tests.rs")) {
        let source = std::fs::read_to_string(file).unwrap();
        // The tick declares the module that closes it over the machine; that one is meant to.
        let lines = reaches_for_the_truth(&source);
        let lines: Vec<_> = lines.iter().filter(|line| !line.contains("pub use virtual_bench::")).collect();
        assert!(lines.is_empty(), "{}: {lines:?}", file.display());
    }
}

#[test]
fn a_look_at_the_virtual_machine_is_found() {
    let cheat = "use stickslip_core::plant::Plant;\nlet x = 1;\n#[cfg(test)]\nuse crate::truth::own_curve;\n";
    assert_eq!(reaches_for_the_truth(cheat), ["use stickslip_core::plant::Plant;"]);
}

/// Files all of whose code, tests aside, runs within the deadline. The rest that does is `crates/core`, which has no
/// `std` to lock with.
const WITHIN_THE_DEADLINE: [&str; 9] = [
    "crates/rt/src/executive.rs",
    "crates/rt/src/cycle.rs",
    "crates/rt/src/clock.rs",
    "crates/rt/src/timing.rs",
    "crates/lab/src/bench/clocked/cycle.rs",
    "crates/lab/src/bench/io.rs",
    "crates/lab/src/bench/virtual_bench.rs",
    "crates/lab/src/bench/faults/faulty.rs",
    "crates/lab/src/noise.rs",
];

/// What could wait for another thread.
fn locks(source: &str) -> Vec<&str> {
    const LOCKS: [&str; 9] =
        ["Mutex", "RwLock", "Condvar", "Barrier", "OnceLock", "LazyLock", "mpsc", ".join()", "thread::"];
    let code = source.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    LOCKS.into_iter().filter(|lock| code.contains(lock)).collect()
}

#[test]
fn nothing_within_the_deadline_waits_for_another_thread() {
    for file in WITHIN_THE_DEADLINE {
        assert_eq!(locks(&text(file)), Vec::<&str>::new(), "{file}");
    }
}

#[test]
fn a_lock_is_found() {
    assert_eq!(locks("use std::sync::Mutex;\nfn step() { shared.lock(); }"), ["Mutex"]);
    assert_eq!(locks("fn step() {}\n#[cfg(test)]\nmod tests { use std::sync::mpsc; }"), Vec::<&str>::new());
    assert!(!locks(&text("crates/lab/src/bench/clocked/mod.rs")).is_empty(), "outside of it there are some");
}
