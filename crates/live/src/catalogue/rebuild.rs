//! Rebuilds the index from the folders.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use super::Catalogue;
use super::entry::Entry;
use super::facts::{Facts, RECORD};
use super::label::{self, Label, identity};
use super::store::rfc3339;
use stickslip_base::Error;

/// Ignored folders.
const OTHERS: [&str; 3] = ["target", "node_modules", "__pycache__"];
/// Maximum depth of nested folders.
const DEPTH: usize = 12;

/// Result of a rebuild.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rebuilt {
    /// Runs in the catalogue now.
    pub runs: usize,
    /// Number of them without a label; these got a new number.
    pub unlabelled: usize,
}

impl Catalogue {
    /// Replaces the index by a search of the project's folder. Numbers, names, tags and notes come from the labels of the
    /// runs; a copy of a run, or a run without a label, gets a new number.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`](crate::LiveError::Catalogue), [`Error::File`].
    pub fn rebuild(&self) -> Result<Rebuilt, Error> {
        let lock = self.lock()?;
        let mut paths = Vec::new();
        find(&self.root, 0, &mut paths);
        paths.sort();
        let mut runs: Vec<(PathBuf, Facts, Option<Label>)> = paths
            .into_iter()
            .filter_map(|path| Facts::read(&path).map(|facts| (Label::read(&path), facts, path)))
            .map(|(label, facts, path)| (path, facts, label))
            .collect();
        // Runs with a number first, by number; the others by time.
        let begun = |path: &Path, facts: &Facts| facts.begun.unwrap_or_else(|| changed(path));
        runs.sort_by(|(path, facts, label), (other_path, other_facts, other_label)| {
            let key = |label: &Option<Label>| label.as_ref().map_or(i64::MAX, |label| label.number);
            key(label).cmp(&key(other_label)).then(begun(path, facts).total_cmp(&begun(other_path, other_facts)))
        });
        if self.next_number(&lock).is_err() {
            // The counter is damaged; labels and entries have the numbers as well.
            self.give(&lock, 0)?;
        }
        let mut last = self.next_number(&lock)? - 1;
        let (mut numbers, mut identities) = (BTreeSet::new(), BTreeSet::new());
        let mut rebuilt = Rebuilt { runs: 0, unlabelled: 0 };
        last = runs.iter().filter_map(|(.., label)| label.as_ref()).fold(last, |last, label| last.max(label.number));
        for (path, facts, label) in runs {
            let original = label.filter(|label| label.number > 0 && !identities.contains(&label.identity));
            let mut label = original.unwrap_or_else(|| Label::new(identity()));
            if numbers.contains(&label.number) || label.number == 0 {
                let unlabelled = label.number == 0;
                last += 1;
                label.number = last;
                if unlabelled {
                    label.name = facts.name(label.number);
                    label.begun = rfc3339(UNIX_EPOCH + Duration::from_secs_f64(begun(&path, &facts).max(0.0)));
                    (label.duration, label.preset) = (facts.duration, facts.preset.clone());
                    rebuilt.unlabelled += 1;
                }
                label.write(&path)?;
            }
            numbers.insert(label.number);
            identities.insert(label.identity.clone());
            self.put(&lock, &Entry::new(self.relative(&path), label, facts))?;
            rebuilt.runs += 1;
        }
        self.give(&lock, last)?;
        for number in self.numbers()?.into_iter().filter(|number| !numbers.contains(number)) {
            self.forget(&lock, number)?;
        }
        Ok(rebuilt)
    }
}

/// Collects folders and single records that may be runs.
fn find(folder: &Path, depth: usize, to: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let is_run = folder.join("summary.json").is_file() || folder.join(RECORD).is_file();
    if is_run {
        to.push(folder.to_owned());
    }
    for entry in entries.flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        // Links are not followed: they may lead out of the project, or back into it.
        let Ok(kind) = entry.file_type() else { continue };
        if kind.is_dir() && depth < DEPTH && !name.starts_with('.') && !OTHERS.contains(&name.as_str()) {
            find(&path, depth + 1, to);
        } else if kind.is_file() && name.ends_with(".mf4") && !(is_run && name == RECORD) {
            to.push(path);
        }
    }
}

/// Time of the last change of a run [s since 1970].
fn changed(path: &Path) -> f64 {
    let file = [path.join("summary.json"), path.to_owned()].into_iter().find(|file| file.is_file());
    let label = label::file(path);
    let time = std::fs::metadata(file.unwrap_or(label)).and_then(|file| file.modified());
    let since = |time: std::time::SystemTime| time.duration_since(std::time::UNIX_EPOCH).ok();
    time.ok().and_then(since).map_or(0.0, |since| since.as_secs_f64())
}
