//! The source distribution of the Python package contains all files that it is compiled from: Maturin packs the crates,
//! and `pyproject.toml` must name the files that they include from elsewhere.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use crate::{root, sources, without_tests, workspace};

/// The package in cargo.
const PACKAGE: &str = "stickslip-python";

/// Folders of the packed crates: the package and all members that it needs.
fn packed() -> Vec<PathBuf> {
    let workspace = workspace();
    let packages = workspace.used_by(&[PACKAGE]).into_iter().filter_map(|name| workspace.package(name));
    packages.map(|package| workspace.root.join(&package.folder)).collect()
}

/// A path without `..`.
fn plain(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut path, part| {
        if part == Component::ParentDir {
            path.pop();
        } else {
            path.push(part);
        }
        path
    })
}

/// The files that a Rust file includes outside its tests.
fn included(file: &Path, text: &str) -> Vec<PathBuf> {
    let text = without_tests(text);
    ["include_str!(", "include_bytes!(", "include!("]
        .iter()
        .flat_map(|name| text.split(name).skip(1))
        .filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next())
        .map(|path| plain(&file.with_file_name(path)))
        .collect()
}

/// The files outside of their crate that the crates include, relative to the root of the repository.
fn from_elsewhere() -> BTreeSet<String> {
    let root = root();
    let mut paths = BTreeSet::new();
    for folder in packed() {
        let build = Some(folder.join("build.rs")).filter(|file| file.exists());
        for file in sources(&folder.join("src")).into_iter().chain(build) {
            let text = std::fs::read_to_string(&file).expect("a source is text");
            let outside = included(&file, &text).into_iter().filter(|path| !path.starts_with(&folder));
            paths.extend(outside.map(|path| path.strip_prefix(&root).unwrap_or(&path).display().to_string()));
        }
    }
    paths
}

/// The patterns of files in the source distribution besides the crates.
fn patterns(pyproject: &str) -> Vec<&str> {
    let list = pyproject.split("\ninclude = [").nth(1).unwrap_or_default().split("\n]").next().unwrap_or_default();
    list.split("path = \"").skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

/// Whether a path matches a pattern, which has at most one star, for a part of a name.
fn matches(pattern: &str, path: &str) -> bool {
    let Some((begin, end)) = pattern.split_once('*') else { return pattern == path };
    let middle = path.strip_prefix(begin).and_then(|rest| rest.strip_suffix(end));
    middle.is_some_and(|name| !name.contains('/'))
}

/// Files that the list lacks, and patterns without a file.
fn differences(pyproject: &str) -> [Vec<String>; 2] {
    let (needed, patterns) = (from_elsewhere(), patterns(pyproject));
    let idle = patterns.iter().filter(|it| !needed.iter().any(|path| matches(it, path))).map(ToString::to_string);
    let idle = idle.collect();
    let missing = needed.into_iter().filter(|path| !patterns.iter().any(|it| matches(it, path)));
    [missing.collect(), idle]
}

#[test]
fn the_source_distribution_has_all_files_that_the_package_is_compiled_from() {
    let pyproject = std::fs::read_to_string(root().join("pyproject.toml")).expect("the package has a pyproject.toml");
    let [missing, idle] = differences(&pyproject);
    assert!(
        missing.is_empty() && idle.is_empty(),
        "`include` in pyproject.toml lacks {missing:?} and has unused {idle:?}"
    );
}

#[test]
fn missing_files_and_unused_patterns_are_found() {
    let [missing, idle] =
        differences("\ninclude = [\n    { path = \"presets/*.toml\" },\n    { path = \"no.csv\" },\n]\n");
    assert!(missing.contains(&"data/friction/emps.toml".into()), "{missing:?}");
    assert!(!missing.iter().any(|path| path.starts_with("presets")), "{missing:?}");
    assert_eq!(idle, ["no.csv"]);
}

#[test]
fn an_included_file_is_found_and_one_in_tests_is_not() {
    let text = "const A: &str = include_str!(\n    \"../../../data/a.toml\"\n);\nconst B: &[u8] = include_bytes!(\"b\");\n\
                #[cfg(test)]\nmod tests {\n    const C: &str = include_str!(\"c\");\n}\n";
    let paths = included(Path::new("/w/crates/base/src/one.rs"), text);
    assert_eq!(paths, [Path::new("/w/data/a.toml"), Path::new("/w/crates/base/src/b")]);
}

#[test]
fn a_pattern_matches_in_one_folder() {
    assert!(matches("presets/*.toml", "presets/emps.toml") && matches("a/b.csv", "a/b.csv"));
    for path in ["presets/old/emps.toml", "presets/emps.csv", "data/presets/emps.toml"] {
        assert!(!matches("presets/*.toml", path), "{path}");
    }
    let list = "\ninclude = [\n    { path = \"a/*.toml\", format = \"sdist\" },\n    { path = \"b.csv\" },\n]\nx = \"path = \"";
    assert_eq!(patterns(list), ["a/*.toml", "b.csv"]);
}
