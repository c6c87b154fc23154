//! Files that differ from the main branch, by git.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const MAIN: &str = "main";
const UPSTREAM: &str = "origin/main";

/// Changed, new and deleted files, committed or not.
pub(crate) struct Changes {
    /// The commit of the comparison, in words.
    pub(crate) since: String,
    /// Relative to the root of the repository.
    pub(crate) files: BTreeSet<PathBuf>,
}

impl Changes {
    /// The changes since the branch left main; on main, those that are not in its upstream; without either, those that
    /// are not committed.
    pub(crate) fn find(root: &Path) -> Result<Self, String> {
        let branch = git(root, &["symbolic-ref", "--short", "--quiet", "HEAD"]).unwrap_or_default();
        let against = if branch.trim() == MAIN { UPSTREAM } else { MAIN };
        let (since, commit) = match git(root, &["merge-base", "HEAD", against]) {
            Ok(commit) => (format!("since {against}"), commit),
            Err(_) => ("not committed".into(), git(root, &["rev-parse", "HEAD"])?),
        };
        let changed = git(root, &["diff", "--name-only", "--no-renames", "-z", commit.trim(), "--"])?;
        let new = git(root, &["ls-files", "--others", "--exclude-standard", "-z"])?;
        let files = [changed, new].iter().flat_map(|list| list.split_terminator('\0')).map(PathBuf::from).collect();
        Ok(Self { since, files })
    }
}

/// The output of git.
fn git(root: &Path, arguments: &[&str]) -> Result<String, String> {
    let output = Command::new("git").current_dir(root).args(arguments).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("cannot start git: {error}"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let error = String::from_utf8_lossy(&output.stderr);
    Err(format!("git {}: {}", arguments.join(" "), error.lines().next().unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A repository with one commit of `old.rs` and `gone.rs` on main.
    fn repository() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        run(&folder, &["init", "--quiet", "--initial-branch", MAIN]);
        write(&folder, "old.rs", "1");
        write(&folder, "gone.rs", "1");
        commit(&folder);
        folder
    }

    fn run(folder: &tempfile::TempDir, arguments: &[&str]) {
        git(folder.path(), &[&["-c", "user.name=test", "-c", "user.email=test@localhost"], arguments].concat())
            .unwrap();
    }

    fn write(folder: &tempfile::TempDir, name: &str, text: &str) {
        std::fs::write(folder.path().join(name), text).expect("it can be written");
    }

    fn commit(folder: &tempfile::TempDir) {
        run(folder, &["add", "--all"]);
        run(folder, &["commit", "--quiet", "--message", "A commit"]);
    }

    fn changes_in(folder: &tempfile::TempDir) -> (String, Vec<String>) {
        let Changes { since, files } = Changes::find(folder.path()).unwrap();
        (since, files.iter().map(|file| file.display().to_string()).collect())
    }

    #[test]
    fn a_branch_is_compared_with_the_commit_where_it_left_main() {
        let folder = repository();
        run(&folder, &["checkout", "--quiet", "-b", "topic"]);
        write(&folder, "committed.rs", "1");
        commit(&folder);
        run(&folder, &["checkout", "--quiet", MAIN]);
        write(&folder, "of_main.rs", "1");
        commit(&folder);
        run(&folder, &["checkout", "--quiet", "topic"]);
        write(&folder, "old.rs", "2");
        write(&folder, "new.rs", "1");
        std::fs::remove_file(folder.path().join("gone.rs")).expect("it exists");
        let expected = ["committed.rs", "gone.rs", "new.rs", "old.rs"].map(String::from).to_vec();
        assert_eq!(changes_in(&folder), ("since main".into(), expected));
    }

    #[test]
    fn main_is_compared_with_its_upstream_or_else_with_its_last_commit() {
        let folder = repository();
        assert_eq!(changes_in(&folder), ("not committed".into(), vec![]));
        run(&folder, &["update-ref", "refs/remotes/origin/main", "HEAD"]);
        write(&folder, "old.rs", "2");
        commit(&folder);
        assert_eq!(changes_in(&folder), ("since origin/main".into(), vec!["old.rs".into()]));
        run(&folder, &["update-ref", "-d", "refs/remotes/origin/main"]);
        write(&folder, "new.rs", "1");
        assert_eq!(changes_in(&folder), ("not committed".into(), vec!["new.rs".into()]));
    }
}
