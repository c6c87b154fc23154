//! `cargo xtask map`: the map of the crates in `ARCHITECTURE.md`, drawn from what cargo knows.

use std::collections::BTreeSet;
use std::path::Path;

use crate::tree::{self, failure};
use crate::workspace::{Package, Workspace};

const FILE: &str = "ARCHITECTURE.md";
const BEGIN: &str = "<!-- map -->\n";
const END: &str = "<!-- /map -->";

/// Writes the map into its place in `ARCHITECTURE.md`.
pub(crate) fn map() -> Result<(), String> {
    let root = tree::root()?;
    let file = root.join(FILE);
    let text = std::fs::read_to_string(&file).map_err(|error| failure("read", &file, &error))?;
    let old = committed(&text)?;
    let new = drawn(&Workspace::read(&root)?);
    if old == new {
        println!("the map in {FILE} is up to date");
        return Ok(());
    }
    let text = text.replacen(&format!("{BEGIN}{old}{END}"), &format!("{BEGIN}{new}{END}"), 1);
    std::fs::write(&file, text).map_err(|error| failure("write", &file, &error))?;
    println!("wrote the map in {FILE}");
    Ok(())
}

/// The part of a text between the markers.
pub fn committed(text: &str) -> Result<&str, String> {
    let after = text.split_once(BEGIN).map(|(_, after)| after);
    let between = after.and_then(|after| after.split_once(END)).map(|(between, _)| between);
    between.ok_or_else(|| format!("{FILE} lacks the lines `{}` and `{END}` around the map", BEGIN.trim()))
}

/// The packages and the arrows to those that they use outside tests, as a diagram for Mermaid. An arrow is left out
/// where others lead to the same package.
pub fn drawn(workspace: &Workspace) -> String {
    let mut lines = Vec::new();
    let mut connected = BTreeSet::new();
    for package in &workspace.packages {
        for used in direct(workspace, package) {
            lines.push(format!("  {} --> {}", label(package), label(used)));
            connected.extend([&package.name, &used.name]);
        }
    }
    let single = workspace.packages.iter().filter(|package| !connected.contains(&package.name));
    lines.extend(single.map(|package| format!("  {}", label(package))));
    lines.sort();
    format!("```mermaid\ngraph TD\n{}\n```\n", lines.join("\n"))
}

/// The packages that a package uses and that none of the others which it uses leads to.
fn direct<'a>(workspace: &'a Workspace, package: &'a Package) -> Vec<&'a Package> {
    let leads_to = |other: &str, used: &str| other != used && workspace.used_by(&[other]).contains(used);
    let direct = package.uses().filter(|used| !package.uses().any(|other| leads_to(other, used)));
    let names: BTreeSet<&str> = direct.collect();
    names.into_iter().filter_map(|name| workspace.package(name)).collect()
}

/// The name of a package's folder, which is shorter than that of the package.
fn label(package: &Package) -> std::path::Display<'_> {
    let name = package.folder.file_name().map_or(Path::new(&package.name), Path::new);
    name.display()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::sample;

    #[test]
    fn the_map_leaves_out_arrows_that_others_lead_along() {
        let workspace = sample(&[
            ("live", &["fit", "core", "rt"]),
            ("fit", &["core"]),
            ("core", &[]),
            ("rt", &[]),
            ("xtask", &["fit*"]),
        ]);
        let expected = "```mermaid\ngraph TD\n  fit --> core\n  live --> fit\n  live --> rt\n  xtask\n```\n";
        assert_eq!(drawn(&workspace), expected);
    }

    #[test]
    fn the_committed_map_is_between_the_markers_and_missing_markers_are_an_error() {
        assert_eq!(committed("# A\n<!-- map -->\nold\n<!-- /map -->\nB\n"), Ok("old\n"));
        for text in ["", "<!-- map -->\nold\n", "old\n<!-- /map -->\n"] {
            let error = committed(text).expect_err("a marker is missing");
            assert_eq!(error, "ARCHITECTURE.md lacks the lines `<!-- map -->` and `<!-- /map -->` around the map");
        }
    }
}
