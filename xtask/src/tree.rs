//! A copy of the tracked files of the repository.
//!
//! Checks that pass there need no file that a fresh clone lacks.

use std::collections::BTreeSet;
use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Root of the repository.
pub fn root() -> Result<PathBuf, String> {
    let manifest = std::env::var("CARGO_MANIFEST_DIR").map_err(|_| "start xtask with `cargo xtask`".to_string())?;
    Ok(Path::new(&manifest).parent().expect("xtask is a folder of the repository").to_path_buf())
}

/// Folder of the copy: always the same for a repository, so that unchanged files are not built again.
pub(crate) fn copy_of(root: &Path) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    root.hash(&mut hasher);
    std::env::temp_dir().join(format!("stickslip-tree-{:016x}", hasher.finish()))
}

/// The files of the repository, relative to it: those that git tracks, or all without git.
pub(crate) fn files(root: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let git = Command::new("git").current_dir(root).args(["ls-files", "-z"]).output();
    match git {
        Ok(list) if list.status.success() && root.join(".git").exists() => Ok(String::from_utf8_lossy(&list.stdout)
            .split_terminator('\0')
            .map(PathBuf::from)
            // Not those whose deletion is not committed.
            .filter(|file| root.join(file).is_file())
            .collect()),
        _ => all_files(root),
    }
}

/// All files in a folder, relative to it, without build outputs.
fn all_files(root: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let mut files = BTreeSet::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        let path = root.join(&folder);
        for entry in fs::read_dir(&path).map_err(|error| failure("list", &path, &error))? {
            let entry = entry.map_err(|error| failure("list", &path, &error))?;
            let name = folder.join(entry.file_name());
            if [".git", "target", "stickslip-out", "web/dist", "web/node_modules"]
                .iter()
                .any(|output| name == Path::new(output))
            {
                continue;
            }
            if entry.path().is_dir() {
                folders.push(name);
            } else {
                files.insert(name);
            }
        }
    }
    Ok(files)
}

/// Makes `copy` contain these files and no others. Files with the same content keep their time.
pub(crate) fn mirror(root: &Path, files: &BTreeSet<PathBuf>, copy: &Path) -> Result<(), String> {
    fs::create_dir_all(copy).map_err(|error| failure("create", copy, &error))?;
    for name in all_files(copy)?.difference(files) {
        let path = copy.join(name);
        fs::remove_file(&path).map_err(|error| failure("remove", &path, &error))?;
    }
    for name in files.iter().filter(|name| !same(&root.join(name), &copy.join(name))) {
        let (from, to) = (root.join(name), copy.join(name));
        let folder = to.parent().expect("a file has a folder");
        fs::create_dir_all(folder).map_err(|error| failure("create", folder, &error))?;
        fs::copy(&from, &to).map_err(|error| failure("copy", &from, &error))?;
    }
    Ok(())
}

/// The files that were changed, added or removed in the copy.
pub(crate) fn leftovers(root: &Path, files: &BTreeSet<PathBuf>, copy: &Path) -> Result<Vec<PathBuf>, String> {
    let now = all_files(copy)?;
    let changed = files.iter().filter(|name| !same(&root.join(name), &copy.join(name)));
    Ok(now.difference(files).chain(changed).cloned().collect())
}

fn same(one: &Path, other: &Path) -> bool {
    matches!((fs::read(one), fs::read(other)), (Ok(one), Ok(other)) if one == other)
}

/// The message of a failed action on a path.
pub(crate) fn failure(action: &str, path: &Path, error: &std::io::Error) -> String {
    format!("cannot {action} {}: {error}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(files: &[(&str, &str)]) -> (tempfile::TempDir, BTreeSet<PathBuf>) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let names = files.iter().map(|(name, _)| PathBuf::from(name)).collect();
        (folder, names)
    }

    #[test]
    fn a_copy_has_the_files_of_the_tree_and_no_others() {
        let (root, files) = tree(&[("a.rs", "1"), ("deep/b.rs", "2")]);
        let (copy, _) = tree(&[("a.rs", "old"), ("stray.rs", "?"), ("target/built", "?")]);
        mirror(root.path(), &files, copy.path()).unwrap();
        assert_eq!(all_files(copy.path()).unwrap(), files);
        assert_eq!(fs::read_to_string(copy.path().join("a.rs")).unwrap(), "1");
        assert_eq!(leftovers(root.path(), &files, copy.path()).unwrap(), Vec::<PathBuf>::new());
    }

    #[test]
    fn a_file_with_the_same_content_keeps_its_time() {
        let (root, files) = tree(&[("a.rs", "1")]);
        let (copy, _) = tree(&[("a.rs", "1")]);
        let then = std::time::SystemTime::UNIX_EPOCH;
        fs::File::options().write(true).open(copy.path().join("a.rs")).unwrap().set_modified(then).unwrap();
        mirror(root.path(), &files, copy.path()).unwrap();
        assert_eq!(fs::metadata(copy.path().join("a.rs")).unwrap().modified().unwrap(), then);
    }

    #[test]
    fn files_that_a_test_adds_changes_or_removes_are_found() {
        let (root, files) = tree(&[("a.rs", "1"), ("b.rs", "2"), ("c.rs", "3")]);
        let (copy, _) = tree(&[("a.rs", "1"), ("b.rs", "changed"), ("left.txt", "?")]);
        let files = leftovers(root.path(), &files, copy.path()).unwrap();
        assert_eq!(files, ["left.txt", "b.rs", "c.rs"].map(PathBuf::from));
    }

    #[test]
    fn without_git_all_files_except_build_outputs_belong_to_the_tree() {
        let (root, _) = tree(&[("a.rs", "1"), ("deep/target/b.rs", "2"), ("target/built", "?"), (".ci/run", "3")]);
        let expected = [".ci/run", "a.rs", "deep/target/b.rs"].map(PathBuf::from);
        assert_eq!(files(root.path()).unwrap(), BTreeSet::from(expected));
    }
}
