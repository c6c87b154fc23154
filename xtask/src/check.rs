//! `cargo xtask check`: the changed packages, for daily work.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use crate::changes::Changes;
use crate::command::{Cargo, run};
use crate::test::Part;
use crate::workspace::{Kind, Workspace};
use crate::{page, tree};

/// Checks the files that differ from the main branch. Stops at the first failed step.
pub(crate) fn check() -> Result<(), String> {
    let start = Instant::now();
    let root = tree::root()?;
    let workspace = Workspace::read(&root)?;
    let Changes { since, files } = Changes::find(&root)?;
    if files.is_empty() {
        println!("no changed files ({since})");
        return Ok(());
    }
    println!("changed files: {} ({since})", files.len());
    let plan = Plan::new(&workspace, &files);
    let outcome = plan.run(&Cargo::new(&root, &root));
    for (part, files) in &plan.elsewhere {
        println!("not checked here, run `cargo xtask test {part}`: {}", shortened(files));
    }
    let result = if outcome.is_ok() { "passed" } else { "failed" };
    println!("total {:.1} s, {result}", start.elapsed().as_secs_f64());
    outcome
}

/// The checks for a set of changed files.
struct Plan<'a> {
    workspace: &'a Workspace,
    /// Packages with changed files.
    packages: BTreeSet<&'a str>,
    /// Whether the page has changed files.
    page: bool,
    /// Files that are checked by a part of `cargo xtask test` alone.
    elsewhere: BTreeMap<&'static str, Vec<PathBuf>>,
}

impl<'a> Plan<'a> {
    fn new(workspace: &'a Workspace, files: &BTreeSet<PathBuf>) -> Self {
        let mut plan = Self { workspace, packages: BTreeSet::new(), page: false, elsewhere: BTreeMap::new() };
        for file in files {
            if file.starts_with("web") {
                plan.page = true;
            } else if let Some(part) = part_of(workspace, file) {
                plan.elsewhere.entry(part.name()).or_default().push(file.clone());
            } else if let Some(package) = workspace.package_of(file) {
                plan.packages.insert(&package.name);
            }
        }
        plan
    }

    fn run(&self, cargo: &Cargo) -> Result<(), String> {
        if !self.packages.is_empty() {
            let packages: Vec<_> = self.packages.iter().copied().collect();
            println!("packages: {}", packages.join(", "));
            step("format", &mut cargo.command(self.format()))?;
            step("lints", &mut cargo.command(self.lints()))?;
            step("interfaces", &mut cargo.command(self.interfaces()))?;
            step("unit tests", &mut cargo.command(self.unit_tests()))?;
        }
        if self.page {
            timed("page", || page::check_sources(&cargo.folder.join("web")))?;
        }
        Ok(())
    }

    fn format(&self) -> Vec<&'a str> {
        [&["fmt", "--check"], &selected(&self.packages)[..]].concat()
    }

    /// Lints of the changed packages alone: those that they use are only compiled.
    fn lints(&self) -> Vec<&'a str> {
        let targets = ["--no-deps", "--all-targets", "--quiet", "--", "-D", "warnings"];
        [&["clippy"], &selected(&self.packages)[..], &targets].concat()
    }

    /// Compiles the packages that use the changed ones, without code and without lints; empty if there are none. Cargo
    /// itself leaves out what is up to date. All packages are selected since each selection has its own features of
    /// shared dependencies, and would compile them again.
    fn interfaces(&self) -> Vec<&'a str> {
        let changed: Vec<_> = self.packages.iter().copied().collect();
        let users = self.workspace.users_of(&changed);
        if users.len() == changed.len() { vec![] } else { vec!["check", "--workspace", "--lib", "--bins", "--quiet"] }
    }

    /// Runs the tests in the libraries and programs of the changed packages; empty if they have none. Packages without a
    /// library are selected too, and nothing of them is built: with their dependencies, the features of shared
    /// dependencies are the same whichever package has changed.
    fn unit_tests(&self) -> Vec<&'a str> {
        let mut targets = Vec::new();
        let mut packages = BTreeSet::new();
        for package in self.packages.iter().filter_map(|name| self.workspace.package(name)) {
            for target in package.targets.iter().filter(|target| target.is_tested) {
                match target.kind {
                    Kind::Library => targets.push("--lib"),
                    Kind::Program => targets.extend(["--bin", &target.name]),
                    _ => continue,
                }
                packages.insert(package.name.as_str());
            }
        }
        if targets.is_empty() {
            return targets;
        }
        let without = self.workspace.packages.iter().filter(|it| it.targets(Kind::Library).next().is_none());
        packages.extend(without.map(|package| package.name.as_str()));
        [&["test", "--quiet"], &selected(&packages)[..], &targets].concat()
    }
}

/// The part that covers a file which is not compiled by cargo as a part of its package.
fn part_of(workspace: &Workspace, file: &Path) -> Option<Part> {
    let is_python = file.extension().is_some_and(|it| it == "py" || it == "pyi") && file.starts_with("python");
    if is_python || file == Path::new("pyproject.toml") {
        Some(Part::Python)
    } else if workspace.package_of(file).is_some() {
        None
    } else if file.starts_with("docs/src") || file == Path::new("docs/book.toml") {
        Some(Part::Guide)
    } else {
        Some(Part::Rust)
    }
}

fn selected<'a>(packages: &BTreeSet<&'a str>) -> Vec<&'a str> {
    packages.iter().flat_map(|package| ["--package", package]).collect()
}

/// The first files of a list.
fn shortened(files: &[PathBuf]) -> String {
    const SHOWN: usize = 5;
    let mut names: Vec<_> = files.iter().take(SHOWN).map(|file| file.display().to_string()).collect();
    if files.len() > SHOWN {
        names.push(format!("{} more", files.len() - SHOWN));
    }
    names.join(", ")
}

/// Runs a command of cargo unless it has no arguments.
fn step(name: &str, command: &mut Command) -> Result<(), String> {
    if command.get_args().next().is_none() { Ok(()) } else { timed(name, || run(command)) }
}

fn timed(name: &str, work: impl FnOnce() -> Result<(), String>) -> Result<(), String> {
    let start = Instant::now();
    let outcome = work();
    println!("== {name}: {:.1} s", start.elapsed().as_secs_f64());
    outcome
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::sample;

    fn workspace() -> Workspace {
        sample(&[("app", &["live"]), ("live", &["core"]), ("core", &[]), ("agree", &["core*"])])
    }

    fn plan<'a>(workspace: &'a Workspace, files: &[&str]) -> Plan<'a> {
        Plan::new(workspace, &files.iter().map(PathBuf::from).collect())
    }

    #[test]
    fn the_packages_of_the_changed_files_are_checked() {
        let workspace = workspace();
        let plan = plan(&workspace, &["crates/core/src/tick.rs", "crates/core/Cargo.toml", "crates/live/src/lib.rs"]);
        assert_eq!(plan.packages, ["core", "live"].into());
        assert_eq!(plan.format(), ["fmt", "--check", "--package", "core", "--package", "live"]);
        assert!(!plan.page && plan.elsewhere.is_empty());
    }

    #[test]
    fn users_of_a_changed_package_are_compiled_and_a_package_without_users_needs_no_such_step() {
        let workspace = workspace();
        assert_eq!(plan(&workspace, &["crates/core/src/lib.rs"]).interfaces()[0], "check");
        assert!(plan(&workspace, &["crates/app/src/lib.rs"]).interfaces().is_empty());
        assert!(plan(&workspace, &["crates/agree/src/lib.rs"]).interfaces().is_empty());
    }

    #[test]
    fn unit_tests_run_for_changed_packages_that_have_some() {
        let mut workspace = workspace();
        let live = workspace.packages.iter_mut().find(|package| package.name == "live").expect("it exists");
        live.targets[0].is_tested = false;
        let app = workspace.packages.iter_mut().find(|package| package.name == "app").expect("it exists");
        app.targets[0].kind = Kind::Program;
        let arguments = |file: &str| plan(&workspace, &[file]).unit_tests().join(" ");
        assert_eq!(arguments("crates/core/src/lib.rs"), "test --quiet --package app --package core --lib");
        assert_eq!(arguments("crates/app/src/main.rs"), "test --quiet --package app --bin app");
        assert_eq!(arguments("crates/live/src/lib.rs"), "");
    }

    #[test]
    fn other_files_are_named_with_the_part_that_covers_them() {
        let workspace = workspace();
        let files =
            ["web/src/main.ts", "docs/src/loop.md", "python/stickslip/_law.py", "presets/emps.toml", "README.md"];
        let plan = plan(&workspace, &files);
        assert!(plan.page && plan.packages.is_empty());
        let elsewhere: Vec<_> = plan.elsewhere.iter().map(|(part, files)| (*part, shortened(files))).collect();
        let expected = [
            ("guide", "docs/src/loop.md"),
            ("python", "python/stickslip/_law.py"),
            ("rust", "README.md, presets/emps.toml"),
        ];
        assert_eq!(elsewhere, expected.map(|(part, files)| (part, files.to_string())));
    }

    #[test]
    fn a_long_list_of_files_is_shortened() {
        let files: Vec<PathBuf> = (0..8).map(|number| PathBuf::from(format!("{number}.md"))).collect();
        assert_eq!(shortened(&files), "0.md, 1.md, 2.md, 3.md, 4.md, 3 more");
    }
}
