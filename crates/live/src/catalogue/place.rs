//! Place of the catalogue of a run.

use std::path::{Component, Path, PathBuf};

/// Folder of results within a working folder.
const RESULTS: &str = "stickslip-out";
/// Folder of the index.
const INDEX: &str = "catalogue";

/// The catalogue of a project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Catalogue {
    /// The folders of its runs are relative to this folder.
    pub(super) root: PathBuf,
    pub(super) index: PathBuf,
}

impl Catalogue {
    /// The catalogue of all runs in a working folder.
    pub fn in_folder(folder: &Path) -> Self {
        let root = canonical(folder);
        Catalogue { index: root.join(RESULTS).join(INDEX), root }
    }

    /// The catalogue of a bench's project: that of the working folder if it contains the project; otherwise its own.
    pub fn of_project(project: &Path, working: &Path) -> Self {
        let (root, working) = (canonical(project), Self::in_folder(working));
        if root.starts_with(&working.root) { working } else { Catalogue { index: root.join(INDEX), root } }
    }

    /// Folder of the index.
    pub fn index(&self) -> &Path {
        &self.index
    }

    /// Whether a folder or file is in the project.
    pub fn covers(&self, path: &Path) -> bool {
        canonical(path).starts_with(&self.root)
    }

    /// Path of a run as stored: relative to the project's folder, the same on every system.
    pub(super) fn relative(&self, path: &Path) -> String {
        let path = canonical(path);
        let parts = path.strip_prefix(&self.root).unwrap_or(&path).components();
        parts.map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
    }

    /// The path of a stored relative one.
    pub(super) fn absolute(&self, folder: &str) -> PathBuf {
        self.root.join(folder)
    }

    /// Folder of deleted runs.
    pub(super) fn bin(&self) -> PathBuf {
        self.index.with_file_name("bin")
    }
}

/// Absolute path, with links resolved as far as it exists.
fn canonical(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    if cfg!(windows) {
        // `canonicalize` returns `\\\\?\\` paths there, which other programs do not accept.
        return path;
    }
    let mut missing = Vec::new();
    let mut existing = path.as_path();
    loop {
        if let Ok(existing) = existing.canonicalize() {
            return missing.iter().rev().fold(existing, |path, part| path.join(part));
        }
        match (existing.parent(), existing.components().next_back()) {
            (Some(above), Some(Component::Normal(part))) => {
                missing.push(part.to_owned());
                existing = above;
            }
            _ => return path,
        }
    }
}
