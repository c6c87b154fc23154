//! The workspace has the structure that ARCHITECTURE.md describes.

mod architecture;
mod isolation;
mod layers;
mod source_distribution;
mod weight;
mod words;

use std::path::{Path, PathBuf};

use xtask::workspace::Workspace;

fn root() -> PathBuf {
    xtask::root().expect("cargo sets CARGO_MANIFEST_DIR")
}

fn text(file: impl AsRef<Path>) -> String {
    let path = root().join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn workspace() -> Workspace {
    Workspace::read(&root()).unwrap_or_else(|error| panic!("{error}"))
}

/// A workspace of packages in `crates`: each with the packages that it uses and its `[package.metadata.stickslip]`.
fn sample(packages: &[(&str, &[&str], serde_json::Value)]) -> Workspace {
    let package = |(name, uses, metadata): &(&str, &[&str], serde_json::Value)| {
        let uses = uses.iter().map(|used| serde_json::json!({ "name": used, "path": "/w", "kind": null }));
        serde_json::json!({
            "name": name, "manifest_path": format!("/w/crates/{name}/Cargo.toml"), "targets": [],
            "dependencies": uses.collect::<Vec<_>>(), "metadata": { "stickslip": metadata },
        })
    };
    let packages: Vec<_> = packages.iter().map(package).collect();
    Workspace::parse(&serde_json::json!({ "workspace_root": "/w", "packages": packages })).expect("it is complete")
}

/// The Rust files in a folder, without files and folders of tests.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let (mut files, mut left) = (Vec::new(), vec![folder.to_path_buf()]);
    while let Some(next) = left.pop() {
        let list = std::fs::read_dir(&next).unwrap_or_else(|error| panic!("{}: {error}", next.display()));
        for path in list.map(|entry| entry.expect("an entry can be read").path()) {
            if path.file_stem().is_some_and(|name| name == "tests") {
                continue;
            }
            if path.is_dir() {
                left.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                files.push(path);
            }
        }
    }
    files
}

/// The text of a Rust file without the tests at its end.
fn without_tests(source: &str) -> &str {
    source.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default()
}
