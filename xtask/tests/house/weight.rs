//! Crates stay small, and few test programs are linked.

use xtask::workspace::{Kind, Package};

use crate::{root, sources, text, without_tests, workspace};

/// The most lines of Rust in `src` of a package, without tests.
const LINES: usize = 12_000;
/// The most integration test programs of a package: linking one takes longer than most tests.
const TEST_PROGRAMS: usize = 2;

fn lines(package: &Package) -> usize {
    let folder = root().join(&package.folder).join("src");
    sources(&folder).iter().map(|file| without_tests(&text(file)).lines().count()).sum()
}

#[test]
fn no_crate_has_more_than_12000_lines_without_tests() {
    let workspace = workspace();
    let sizes = workspace.packages.iter().map(|package| (&package.name, lines(package)));
    let large: Vec<_> = sizes.filter(|(_, lines)| *lines > LINES).collect();
    assert!(large.is_empty(), "more than {LINES} lines in src without tests: {large:?}");
}

#[test]
fn no_package_has_more_than_two_integration_test_programs() {
    let workspace = workspace();
    let names = |package: &Package| package.targets(Kind::Test).map(|target| target.name.clone()).collect::<Vec<_>>();
    let programs = workspace.packages.iter().map(|package| (&package.name, names(package)));
    let many: Vec<_> = programs.filter(|(_, names)| names.len() > TEST_PROGRAMS).collect();
    assert!(many.is_empty(), "more than {TEST_PROGRAMS} test programs: {many:?}");
}

#[test]
fn tests_do_not_count_as_lines() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let file = folder.path().join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, text).unwrap();
    };
    write("lib.rs", "mod deep;\nmod tests;\n\n#[cfg(test)]\nmod tests {\n    use super::*;\n}\n");
    write("deep/one.rs", "fn one() {}\n");
    write("deep/tests.rs", "use super::*;\n");
    write("deep/tests/more.rs", "use super::*;\n");
    write("deep/figure.svg", "<svg/>\n");
    let counted: usize = sources(folder.path()).iter().map(|file| without_tests(&text(file)).lines().count()).sum();
    assert_eq!(counted, 4);
}
