//! The workspace as `cargo metadata` describes it: packages, their targets and the arrows between them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::command::json;

/// All packages of the workspace.
pub struct Workspace {
    /// Folder of the workspace.
    pub root: PathBuf,
    /// Its packages by name.
    pub packages: Vec<Package>,
}

/// A package of the workspace.
pub struct Package {
    /// Name for cargo.
    pub name: String,
    /// Folder, relative to the root of the workspace.
    pub folder: PathBuf,
    /// Packages that it uses.
    pub dependencies: Vec<Dependency>,
    /// Targets that cargo builds of it.
    pub targets: Vec<Target>,
    metadata: Value,
}

/// A package that another one uses.
pub struct Dependency {
    /// Name for cargo.
    pub name: String,
    /// Whether it is a package of the workspace.
    pub is_member: bool,
    /// Whether only tests and examples use it.
    pub is_for_tests: bool,
}

/// A library, program, test program or example.
pub struct Target {
    /// Name for cargo.
    pub name: String,
    /// Kind of the target.
    pub kind: Kind,
    /// Root file, relative to the root of the workspace.
    pub source: PathBuf,
    /// Whether cargo runs its tests by default.
    pub is_tested: bool,
}

/// The kind of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A library of any crate type.
    Library,
    /// A program.
    Program,
    /// An integration test program.
    Test,
    /// An example.
    Example,
    /// A benchmark or a build script.
    Other,
}

impl Kind {
    /// The kind of a target in the output of cargo.
    pub(crate) fn of(target: &Value) -> Self {
        match target["kind"][0].as_str() {
            Some("bin") => Self::Program,
            Some("test") => Self::Test,
            Some("example") => Self::Example,
            Some("bench" | "custom-build") | None => Self::Other,
            Some(_) => Self::Library,
        }
    }
}

impl Workspace {
    /// Reads the workspace at `root`.
    pub fn read(root: &Path) -> Result<Self, String> {
        let arguments = ["metadata", "--format-version", "1", "--no-deps", "--offline"];
        Self::parse(&json(Command::new("cargo").current_dir(root).args(arguments))?)
            .ok_or_else(|| "the output of cargo metadata lacks a field".into())
    }

    /// Reads the output of `cargo metadata`; `None` if a field is missing.
    pub fn parse(metadata: &Value) -> Option<Self> {
        let root = PathBuf::from(metadata["workspace_root"].as_str()?);
        let packages: Option<Vec<_>> = metadata["packages"].as_array()?.iter().map(|it| package(&root, it)).collect();
        let mut packages = packages?;
        packages.sort_by(|one, other| one.name.cmp(&other.name));
        Some(Self { root, packages })
    }

    /// The package with a name.
    pub fn package(&self, name: &str) -> Option<&Package> {
        self.packages.iter().find(|package| package.name == name)
    }

    /// The package whose folder contains a file; the path is relative to the root.
    pub(crate) fn package_of(&self, file: &Path) -> Option<&Package> {
        let holding = self.packages.iter().filter(|package| file.starts_with(&package.folder));
        holding.max_by_key(|package| package.folder.components().count())
    }

    /// Packages that the given ones use outside tests, directly and indirectly; the given ones included.
    pub fn used_by<'a>(&'a self, names: &[&'a str]) -> BTreeSet<&'a str> {
        self.closure(names, |package| package.uses().collect())
    }

    /// Packages that use the given ones outside tests, directly and indirectly; the given ones included.
    pub(crate) fn users_of<'a>(&'a self, names: &[&'a str]) -> BTreeSet<&'a str> {
        let uses = |user: &Package, used: &Package| user.uses().any(|name| name == used.name);
        let users = |used: &'a Package| self.packages.iter().filter(move |user| uses(user, used));
        self.closure(names, |package| users(package).map(|user| user.name.as_str()).collect())
    }

    fn closure<'a>(&'a self, names: &[&'a str], next: impl Fn(&'a Package) -> Vec<&'a str>) -> BTreeSet<&'a str> {
        let (mut closure, mut left) = (BTreeSet::new(), names.to_vec());
        while let Some(name) = left.pop() {
            if closure.insert(name) {
                left.extend(self.package(name).map(&next).unwrap_or_default());
            }
        }
        closure
    }
}

impl Package {
    /// Packages of the workspace that it uses outside tests.
    pub fn uses(&self) -> impl Iterator<Item = &str> {
        let used = self.dependencies.iter().filter(|it| it.is_member && !it.is_for_tests);
        used.map(|it| it.name.as_str())
    }

    /// Its targets of a kind.
    pub fn targets(&self, kind: Kind) -> impl Iterator<Item = &Target> {
        self.targets.iter().filter(move |target| target.kind == kind)
    }

    /// The names of the lists in `[package.metadata.stickslip]`.
    pub fn lists(&self) -> Vec<&str> {
        self.metadata["stickslip"].as_object().into_iter().flatten().map(|(key, _)| key.as_str()).collect()
    }

    /// A list of `[package.metadata.stickslip]` in its manifest; empty without one.
    pub fn listed(&self, key: &str) -> Vec<&str> {
        let list = self.metadata["stickslip"][key].as_array();
        list.into_iter().flatten().filter_map(Value::as_str).collect()
    }
}

fn package(root: &Path, package: &Value) -> Option<Package> {
    let within = |path: &Value| Some(Path::new(path.as_str()?).strip_prefix(root).ok()?.to_path_buf());
    let dependency = |it: &Value| {
        let (is_member, is_for_tests) = (it["path"].is_string(), it["kind"] == "dev");
        Some(Dependency { name: it["name"].as_str()?.into(), is_member, is_for_tests })
    };
    let target = |it: &Value| {
        let (kind, is_tested) = (Kind::of(it), it["test"].as_bool()?);
        Some(Target { name: it["name"].as_str()?.into(), kind, source: within(&it["src_path"])?, is_tested })
    };
    Some(Package {
        name: package["name"].as_str()?.into(),
        folder: within(&package["manifest_path"])?.parent()?.into(),
        dependencies: package["dependencies"].as_array()?.iter().map(dependency).collect::<Option<_>>()?,
        targets: package["targets"].as_array()?.iter().map(target).collect::<Option<_>>()?,
        metadata: package["metadata"].clone(),
    })
}

/// A workspace for tests: each package with what it uses; a name with `*` is used by tests alone.
#[cfg(test)]
pub(crate) fn sample(packages: &[(&str, &[&str])]) -> Workspace {
    let package = |(name, uses): &(&str, &[&str])| {
        let dependency = |used: &&str| {
            let kind = used.ends_with('*').then_some("dev");
            serde_json::json!({ "name": used.trim_end_matches('*'), "path": "/w", "kind": kind })
        };
        serde_json::json!({
            "name": name, "manifest_path": format!("/w/crates/{name}/Cargo.toml"), "metadata": null,
            "dependencies": uses.iter().map(dependency).collect::<Vec<_>>(),
            "targets": [
                { "name": name, "kind": ["lib"], "test": true, "src_path": format!("/w/crates/{name}/src/lib.rs") },
            ],
        })
    };
    let packages: Vec<_> = packages.iter().map(package).collect();
    Workspace::parse(&serde_json::json!({ "workspace_root": "/w", "packages": packages })).expect("it is complete")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn users_and_used_packages_are_found_at_any_distance_but_not_through_tests() {
        let all = sample(&[("app", &["live"]), ("live", &["core"]), ("core", &[]), ("agree", &["core*"])]);
        assert_eq!(all.users_of(&["core"]), ["app", "core", "live"].into());
        assert_eq!(all.used_by(&["app"]), ["app", "core", "live"].into());
        assert_eq!(all.users_of(&["agree"]), ["agree"].into());
    }

    #[test]
    fn a_file_belongs_to_the_package_in_whose_folder_it_is() {
        let all = sample(&[("core", &[]), ("core/inner", &[])]);
        let name = |file: &str| all.package_of(Path::new(file)).map(|package| package.name.as_str());
        assert_eq!(name("crates/core/src/deep/tick.rs"), Some("core"));
        assert_eq!(name("crates/core/inner/Cargo.toml"), Some("core/inner"));
        assert_eq!(name("crates/core2/src/lib.rs"), None);
    }

    #[test]
    fn lists_in_a_manifest_are_read_and_missing_ones_are_empty() {
        let mut all = sample(&[("rt", &[])]);
        assert_eq!(all.packages[0].listed("alone"), [] as [&str; 0]);
        all.packages[0].metadata = serde_json::json!({ "stickslip": { "alone": ["lib", "causes"] } });
        assert_eq!(all.packages[0].listed("alone"), ["lib", "causes"]);
    }
}
