//! The source distribution of the Python package holds all that it is compiled from: Maturin packs the crates, and what
//! they include from elsewhere `pyproject.toml` must name.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// The manifest of the package, among those of Cargo.
const PACKAGE: &str = "stickslip-python";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the repository").to_path_buf()
}

/// Folders of the crates that are packed: that of the package and of all members that it needs.
fn packed() -> BTreeSet<PathBuf> {
    let arguments = ["metadata", "--format-version", "1", "--no-deps", "--offline"];
    let output = Command::new(env!("CARGO")).current_dir(root()).args(arguments).output().expect("cargo runs");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON");
    let members: BTreeMap<PathBuf, &Value> = metadata["packages"]
        .as_array()
        .expect("a workspace has packages")
        .iter()
        .map(|it| (folder(&it["manifest_path"]).parent().expect("a manifest lies in a folder").to_path_buf(), it))
        .collect();
    let package = members.iter().find(|(_, it)| it["name"] == PACKAGE).expect("the package is a member").0.clone();
    let (mut found, mut left) = (BTreeSet::new(), vec![package]);
    while let Some(next) = left.pop() {
        let used = members[&next]["dependencies"].as_array().expect("a package lists what it uses");
        let here = used.iter().filter(|it| it["path"].is_string() && it["kind"] != "dev");
        left.extend(here.map(|it| folder(&it["path"])).filter(|it| !found.contains(it)));
        found.insert(next);
    }
    found
}

fn folder(value: &Value) -> PathBuf {
    value.as_str().expect("Cargo names a path").into()
}

/// A path without `..`.
fn plain(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut found, part| {
        if part == Component::ParentDir {
            found.pop();
        } else {
            found.push(part);
        }
        found
    })
}

/// What the text of a file includes when it is compiled for use: tests at its foot are not.
fn included(file: &Path, text: &str) -> Vec<PathBuf> {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    ["include_str!(", "include_bytes!(", "include!("]
        .iter()
        .flat_map(|name| text.split(name).skip(1))
        .filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next())
        .map(|path| plain(&file.with_file_name(path)))
        .collect()
}

/// The files of a crate that are compiled for use.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let (mut found, mut left) = (vec![folder.join("build.rs")], vec![folder.join("src")]);
    while let Some(next) = left.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder of sources can be listed") {
            let path = entry.expect("an entry can be read").path();
            let tests = path.file_stem().is_some_and(|it| it == "tests");
            match (path.is_dir(), path.extension().is_some_and(|it| it == "rs")) {
                _ if tests => {}
                (true, _) => left.push(path),
                (_, true) => found.push(path),
                _ => {}
            }
        }
    }
    found.retain(|path| path.exists());
    found
}

/// What the crates include from outside of them, from the root of the repository on.
fn from_elsewhere() -> BTreeSet<String> {
    let root = root();
    let mut found = BTreeSet::new();
    for folder in packed() {
        for file in sources(&folder) {
            let text = std::fs::read_to_string(&file).expect("a source is text");
            let outside = included(&file, &text).into_iter().filter(|path| !path.starts_with(&folder));
            found.extend(outside.map(|path| path.strip_prefix(&root).unwrap_or(&path).display().to_string()));
        }
    }
    found
}

/// The patterns of files that go into the source distribution besides the crates.
fn patterns(pyproject: &str) -> Vec<&str> {
    let list = pyproject.split("\ninclude = [").nth(1).unwrap_or_default().split("\n]").next().unwrap_or_default();
    list.split("path = \"").skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

/// Whether a path is one of a pattern, which has at most one star, for a part of a name.
fn matches(pattern: &str, path: &str) -> bool {
    let Some((begin, end)) = pattern.split_once('*') else { return pattern == path };
    let middle = path.strip_prefix(begin).and_then(|rest| rest.strip_suffix(end));
    middle.is_some_and(|name| !name.contains('/'))
}

/// What a list of files lacks, and which of its patterns are of no use.
fn differences(pyproject: &str) -> [Vec<String>; 2] {
    let (needed, patterns) = (from_elsewhere(), patterns(pyproject));
    let idle = patterns.iter().filter(|it| !needed.iter().any(|path| matches(it, path))).map(ToString::to_string);
    let idle = idle.collect();
    let missing = needed.into_iter().filter(|path| !patterns.iter().any(|it| matches(it, path)));
    [missing.collect(), idle]
}

#[test]
fn what_the_package_is_compiled_from_is_in_its_source_distribution() {
    let pyproject = std::fs::read_to_string(root().join("pyproject.toml")).expect("the package has a pyproject.toml");
    let [missing, idle] = differences(&pyproject);
    assert!(missing.is_empty() && idle.is_empty(), "include of pyproject.toml lacks {missing:?}, needs no {idle:?}");
}

#[test]
fn a_list_that_lacks_files_or_names_others_differs() {
    let [missing, idle] =
        differences("\ninclude = [\n    { path = \"presets/*.toml\" },\n    { path = \"no.csv\" },\n]\n");
    assert!(missing.contains(&"data/friction/emps.toml".into()), "{missing:?}");
    assert!(!missing.iter().any(|path| path.starts_with("presets")), "{missing:?}");
    assert_eq!(idle, ["no.csv"]);
}

#[test]
fn a_file_from_elsewhere_is_found_and_one_of_a_test_is_not() {
    let text = "const A: &str = include_str!(\n    \"../../../data/a.toml\"\n);\nconst B: &[u8] = include_bytes!(\"b\");\n\
                #[cfg(test)]\nmod tests {\n    const C: &str = include_str!(\"c\");\n}\n";
    let found = included(Path::new("/house/crates/lab/src/one.rs"), text);
    assert_eq!(found, [Path::new("/house/data/a.toml"), Path::new("/house/crates/lab/src/b")]);
}

#[test]
fn a_pattern_is_of_one_folder() {
    assert!(matches("presets/*.toml", "presets/emps.toml") && matches("a/b.csv", "a/b.csv"));
    for path in ["presets/old/emps.toml", "presets/emps.csv", "data/presets/emps.toml"] {
        assert!(!matches("presets/*.toml", path), "{path}");
    }
    let list = "\ninclude = [\n    { path = \"a/*.toml\", format = \"sdist\" },\n    { path = \"b.csv\" },\n]\nx = \"path = \"";
    assert_eq!(patterns(list), ["a/*.toml", "b.csv"]);
}
