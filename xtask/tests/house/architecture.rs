//! ARCHITECTURE.md lists the crates and dependencies that cargo knows, has their map, and names files that exist.

use std::collections::BTreeSet;

use xtask::map;

use crate::{root, text, workspace};

/// The paths in backticks in a text: words with a slash or the ending of a file, without spaces.
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

/// The cells of each row of the table below a heading, without the head of the table.
fn table<'a>(text: &'a str, heading: &str) -> Vec<Vec<&'a str>> {
    let (_, section) = text.split_once(&format!("\n## {heading}\n")).expect("the heading exists");
    let section = section.split("\n## ").next().unwrap_or_default();
    let rows = section.lines().filter(|line| line.starts_with('|')).skip(2);
    rows.map(|row| row.trim_matches('|').split('|').map(str::trim).collect()).collect()
}

fn names(cell: &str) -> impl Iterator<Item = String> {
    cell.split(", ").filter(|name| !name.is_empty()).map(String::from)
}

#[test]
fn every_path_in_the_architecture_exists() {
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

/// Links and pictures of a page at the root that lead to no file.
fn dead_links(text: &str) -> Vec<&str> {
    let targets = text.split("](").skip(1).filter_map(|part| part.split_once(')')).map(|(target, _)| target);
    targets.filter(|target| !target.contains("://") && !root().join(target).exists()).collect()
}

#[test]
fn every_link_of_the_pages_at_the_root_leads_to_a_file() {
    for page in ["README.md", "SECURITY.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "CHANGELOG.md"] {
        assert_eq!(dead_links(&text(page)), [] as [&str; 0], "{page}");
    }
    assert_eq!(dead_links("[a](README.md) [b](https://b.org) ![c](nowhere.png)"), ["nowhere.png"]);
}

#[test]
fn every_crate_of_the_workspace_is_in_the_architecture() {
    let text = text("ARCHITECTURE.md");
    let rows = table(&text, "Crates").into_iter();
    let declared: BTreeSet<_> = rows.map(|row| (row[0].trim_matches('`').to_string(), row[1].to_string())).collect();
    let members = workspace().packages.into_iter();
    let real: BTreeSet<_> = members.map(|package| (package.folder.display().to_string(), package.name)).collect();
    assert_eq!(real, declared, "left: cargo, right: the table \"Crates\"");
}

#[test]
fn the_map_in_the_architecture_is_up_to_date() {
    let text = text("ARCHITECTURE.md");
    let committed = map::committed(&text).unwrap_or_else(|error| panic!("{error}: add both, then run cargo xtask map"));
    assert!(committed == map::drawn(&workspace()), "the crates and arrows have changed: run cargo xtask map");
}

#[test]
fn every_dependency_has_a_line_in_the_architecture_and_every_line_a_dependency() {
    let text = text("ARCHITECTURE.md");
    let declared: BTreeSet<String> = table(&text, "Dependencies").iter().flat_map(|row| names(row[0])).collect();
    let used = workspace().packages.into_iter().flat_map(|package| package.dependencies);
    let real: BTreeSet<String> = used.filter(|used| !used.is_member).map(|used| used.name).collect();
    assert_eq!(real, declared, "left: the manifests, right: the table \"Dependencies\"");
}
