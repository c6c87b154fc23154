//! Which catalogue a run belongs to.

use std::path::{Component, Path, PathBuf};

/// Folder of results within a working folder.
const RESULTS: &str = "stickslip-out";
/// Folder of the index.
const INDEX: &str = "catalogue";

/// The catalogue of a project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Catalogue {
    /// What the folders of its runs are told from.
    pub(super) root: PathBuf,
    pub(super) index: PathBuf,
}

impl Catalogue {
    /// Of a working folder: all runs in it.
    pub fn in_folder(folder: &Path) -> Self {
        let root = whole(folder);
        Catalogue { index: root.join(RESULTS).join(INDEX), root }
    }

    /// Of the project that a bench is served for: that of the working folder, where it lies in there; else its own.
    pub fn of_project(project: &Path, working: &Path) -> Self {
        let (root, working) = (whole(project), Self::in_folder(working));
        if root.starts_with(&working.root) { working } else { Catalogue { index: root.join(INDEX), root } }
    }

    /// Folder of the index.
    pub fn index(&self) -> &Path {
        &self.index
    }

    /// Whether a folder or file lies in the project.
    pub fn covers(&self, path: &Path) -> bool {
        whole(path).starts_with(&self.root)
    }

    /// Where a run lies, as it is kept: from the project's folder on, the same on every system.
    pub(super) fn relative(&self, path: &Path) -> String {
        let path = whole(path);
        let parts = path.strip_prefix(&self.root).unwrap_or(&path).components();
        parts.map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
    }

    /// The way back.
    pub(super) fn absolute(&self, folder: &str) -> PathBuf {
        self.root.join(folder)
    }

    /// Folder of what was deleted.
    pub(super) fn bin(&self) -> PathBuf {
        self.index.with_file_name("bin")
    }
}

/// From the root on, without links as far as it exists.
fn whole(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    if cfg!(windows) {
        // `canonicalize` returns `\\\\?\\` paths there, which other programs do not take.
        return path;
    }
    let mut missing = Vec::new();
    let mut known = path.as_path();
    loop {
        if let Ok(known) = known.canonicalize() {
            return missing.iter().rev().fold(known, |path, part| path.join(part));
        }
        match (known.parent(), known.components().next_back()) {
            (Some(above), Some(Component::Normal(part))) => {
                missing.push(part.to_owned());
                known = above;
            }
            _ => return path,
        }
    }
}
