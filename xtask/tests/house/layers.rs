//! Arrows between the crates point one way.

use xtask::workspace::{Package, Workspace};

use crate::{sample, workspace};

/// The crates by their folders in `crates`, each group above the groups that it may use. Members of a group do not use
/// each other.
const LAYERS: [&[&str]; 11] = [
    &["derive"],
    &["core"],
    &["codegen", "rt", "software", "wide"],
    &["base"],
    &["recording", "fit"],
    &["identify", "design"],
    &["simulate"],
    &["bench"],
    &["experiment"],
    &["study", "generate"],
    &["live"],
];

/// Arrows that are allowed in spite of the layers: user, used crate.
const EXCEPTIONS: [(&str, &str); 0] = [];

/// The folder of a package in `crates`.
fn folder(package: &Package) -> Option<&str> {
    package.folder.strip_prefix("crates").ok()?.to_str()
}

/// The number of the layer of a package; packages in no layer are above all.
fn layer(package: &Package) -> usize {
    let place = |folder| LAYERS.iter().position(|group| group.contains(&folder));
    folder(package).and_then(place).unwrap_or(LAYERS.len())
}

/// Arrows that point upward or along a layer.
fn wrong_arrows(workspace: &Workspace) -> Vec<String> {
    let mut wrong = Vec::new();
    for user in workspace.packages.iter().filter(|package| layer(package) < LAYERS.len()) {
        for used in user.uses().filter_map(|name| workspace.package(name)) {
            let arrow = (folder(user).unwrap_or_default(), folder(used).unwrap_or_default());
            if layer(used) >= layer(user) && !EXCEPTIONS.contains(&arrow) {
                wrong.push(format!("{} uses {}, which is not in a lower layer", user.name, used.name));
            }
        }
    }
    wrong
}

#[test]
fn crates_use_crates_of_lower_layers_only() {
    assert_eq!(wrong_arrows(&workspace()), [""; 0], "layers, from the lowest: {LAYERS:?}");
}

#[test]
fn every_crate_of_the_layers_exists() {
    let workspace = workspace();
    let folders: Vec<_> = workspace.packages.iter().filter_map(folder).collect();
    let missing: Vec<_> = LAYERS.iter().copied().flatten().filter(|name| !folders.contains(name)).collect();
    assert!(missing.is_empty(), "no such folder in crates: {missing:?}");
}

#[test]
fn an_arrow_upward_or_along_a_layer_is_found() {
    let none = serde_json::json!(null);
    let all = sample(&[
        ("core", &["bench", "other"], none.clone()),
        ("bench", &["core"], none.clone()),
        ("fit", &["recording"], none.clone()),
        ("recording", &[], none.clone()),
        ("other", &["core"], none),
    ]);
    let expected = [
        "core uses bench, which is not in a lower layer",
        "core uses other, which is not in a lower layer",
        "fit uses recording, which is not in a lower layer",
    ];
    assert_eq!(wrong_arrows(&all), expected);
}
