//! Records that the bench makes automatically: their limit, and runs that the end of the program interrupted.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::entry::Entry;
use super::facts::{CAPTURE, Facts, RECORD};
use super::label::Label;
use super::{Catalogue, RunOrigin};
use stickslip_base::{Error, Summary};

/// Cause of a run that has a record but no label.
const INTERRUPTED: &str = "the program ended during the run";

/// The records of measurements in a project.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Records {
    /// Their limit [bytes]; 0: measurements are not recorded.
    pub limit: u64,
    /// Their size [bytes].
    pub used: u64,
    /// Number of runs with such a record.
    pub count: u64,
    /// Number of runs whose record was removed for newer ones.
    pub removed: u64,
}

impl Catalogue {
    /// Size and number of the automatic records.
    ///
    /// # Errors
    /// [`Error::File`] if the index cannot be read.
    pub fn records(&self, limit: u64) -> Result<Records, Error> {
        let mut records = Records { limit, ..Records::default() };
        for number in self.numbers()? {
            let Ok(Some(entry)) = self.entry(number) else { continue };
            records.removed += u64::from(entry.label.record_removed);
            if let Some(size) = self.automatic_record(&entry).and_then(|path| size(&path)) {
                (records.used, records.count) = (records.used + size, records.count + 1);
            }
        }
        Ok(records)
    }

    /// Removes automatic records, the oldest first, until those of the project are within a limit [bytes]; the newest
    /// stays. Results, labels and entries stay.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`](crate::LiveError::Catalogue), [`Error::File`].
    pub fn limit_records(&self, limit: u64) -> Result<(), Error> {
        let lock = self.lock()?;
        let mut records: Vec<(Entry, PathBuf, u64)> = Vec::new();
        for number in self.numbers()? {
            let Ok(Some(entry)) = self.entry(number) else { continue };
            if let Some(path) = self.automatic_record(&entry)
                && let Some(size) = size(&path)
            {
                records.push((entry, path, size));
            }
        }
        records.sort_by(|(one, ..), (other, ..)| one.label.begun.cmp(&other.label.begun));
        let mut used: u64 = records.iter().map(|(.., size)| size).sum();
        records.pop();
        for (mut entry, path, size) in records {
            if used <= limit {
                break;
            }
            fs::remove_file(&path).map_err(|source| Error::file(&path, "remove", source))?;
            used -= size;
            (entry.label.record_removed, entry.facts.record) = (true, None);
            entry.facts.files.retain(|file| !path.ends_with(file));
            entry.label.write(&self.absolute(&entry.folder))?;
            self.put(&lock, &entry)?;
        }
        Ok(())
    }

    /// Path of the record or capture of a run, if it was made automatically and is there.
    fn automatic_record(&self, entry: &Entry) -> Option<PathBuf> {
        let Entry { folder, label, facts, .. } = entry;
        let file = [RECORD, CAPTURE].into_iter().find(|name| facts.files.iter().any(|file| file == name))?;
        let is_automatic = label.automatic && label.deleted.is_none();
        (is_automatic && self.holds(folder, &label.identity)).then(|| self.absolute(folder).join(file))
    }

    /// Enters the runs of a folder that the end of the program interrupted: they have a record, but no label.
    ///
    /// # Errors
    /// As [`enter`](Self::enter).
    pub fn enter_interrupted(&self, runs: &Path) -> Result<(), Error> {
        let mut folders: Vec<_> =
            fs::read_dir(runs).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
        folders.sort();
        for folder in folders {
            let record = folder.join(RECORD);
            if !record.is_file() || Label::read(&folder).is_some() {
                continue;
            }
            let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let Some((number, kind)) = name.split_once('-') else { continue };
            let kind = kind.replace('-', " ");
            let measured = kind.starts_with("measure ") || kind == "render";
            // An unreadable record cannot be listed.
            let Some(facts) = Facts::read(&folder) else { continue };
            if measured {
                write_incomplete(&folder, &kind)?;
            }
            let begun = UNIX_EPOCH + Duration::from_secs_f64(facts.begun.unwrap_or_default().max(0.0));
            let (words, incomplete) = ((!measured).then_some(kind), Some(INTERRUPTED.to_owned()));
            let origin =
                RunOrigin { number: number.parse().ok(), words, incomplete, ..RunOrigin::now(&folder, begun, None) };
            let origin = RunOrigin { duration: facts.duration.unwrap_or_default(), ..origin };
            self.enter(&RunOrigin { automatic: measured, ..origin })?;
        }
        Ok(())
    }
}

fn size(path: &Path) -> Option<u64> {
    path.symlink_metadata().ok().filter(|about| about.is_file()).map(|about| about.len())
}

/// Writes the summary of a measurement that ended before its first result, unless there is one.
///
/// # Errors
/// [`Error::File`].
pub fn write_incomplete(folder: &Path, kind: &str) -> Result<(), Error> {
    if folder.join("summary.json").exists() {
        return Ok(());
    }
    let mut summary = Summary::new(kind);
    let quantity = kind.split(' ').next().unwrap_or_default();
    summary.result(&format!("{quantity}.complete"), 0.0, "1");
    summary.write(folder)
}

/// A note on the run of a folder if it was not completed.
pub(crate) fn incomplete(folder: &Path) -> Option<String> {
    let cause = Label::read(folder)?.incomplete?;
    Some(format!("Incomplete: {cause}. The results are those measured until then."))
}
