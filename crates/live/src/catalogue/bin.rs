//! Deleted runs are kept in a bin for a while.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::store::{Lock, rfc3339};
use super::{Catalogue, label};
use crate::LiveError;
use stickslip_base::{Error, output};

/// How long.
const KEPT: Duration = Duration::from_hours(30 * 24);

impl Catalogue {
    /// Moves a run into the bin.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunGone`] if it is in the bin.
    pub fn delete(&self, number: i64) -> Result<(), Error> {
        self.known(number)?;
        let lock = self.lock()?;
        let mut entry = self.known(number)?;
        if entry.label.deleted.is_some() {
            let remedy = "`stickslip runs restore` brings it back.";
            return Err(LiveError::RunGone { number, how: "it is in the bin", remedy }.into());
        }
        let from = self.absolute(&entry.folder);
        let holds = self.holds(&entry.folder, &entry.label.identity);
        let origin = entry.folder.clone();
        (entry.label.deleted, entry.label.origin) = (Some(rfc3339(SystemTime::now())), Some(origin));
        // Also for a run without files: by it the run is found when its time is over.
        let place = self.bin().join(number.to_string());
        output::create_folder(&place)?;
        if holds && let Some(name) = from.file_name() {
            let to = place.join(name);
            shift(&from, &to)?;
            entry.folder = self.relative(&to);
            entry.label.write(&to)?;
        }
        self.put(&lock, &entry)?;
        self.purge(&lock)
    }

    /// Brings a run back to where it was, or beside what is there now. Returns its folder.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunGone`] if it is not in the bin.
    pub fn restore(&self, number: i64) -> Result<PathBuf, Error> {
        self.known(number)?;
        let lock = self.lock()?;
        let mut entry = self.known(number)?;
        if entry.label.deleted.take().is_none() {
            let remedy = "Only what was deleted can be restored.";
            return Err(LiveError::RunGone { number, how: "it is not in the bin", remedy }.into());
        }
        let from = self.absolute(&entry.folder);
        let origin = entry.label.origin.take().unwrap_or_else(|| entry.folder.clone());
        let mut to = self.absolute(&origin);
        if from.starts_with(self.bin()) && from.exists() {
            if to.exists() {
                to = beside(&to, number);
            }
            if let Some(above) = to.parent() {
                output::create_folder(above)?;
            }
            shift(&from, &to)?;
            entry.label.write(&to)?;
        }
        entry.folder = self.relative(&to);
        self.put(&lock, &entry)?;
        // Empty but for what a person put there.
        let _ = fs::remove_dir(self.bin().join(number.to_string()));
        Ok(to)
    }

    /// Removes for good what has been in the bin for long.
    pub(super) fn purge(&self, lock: &Lock) -> Result<(), Error> {
        let Ok(places) = fs::read_dir(self.bin()) else { return Ok(()) };
        let oldest = rfc3339(SystemTime::now() - KEPT);
        for place in places.flatten() {
            let Some(number) = place.file_name().to_str().and_then(|name| name.parse().ok()) else { continue };
            // A damaged entry keeps its files, and is named by the next search.
            let deleted = self.entry(number).ok().flatten().and_then(|entry| entry.label.deleted);
            // Texts of this form have the order of their times.
            if deleted.is_some_and(|deleted| deleted < oldest) {
                let place = place.path();
                fs::remove_dir_all(&place).map_err(|source| Error::file(&place, "empty", source))?;
                self.forget(lock, number)?;
            }
        }
        Ok(())
    }
}

/// Moves a run: its folder, or its file with the label beside.
fn shift(from: &Path, to: &Path) -> Result<(), Error> {
    let label = (!from.is_dir()).then(|| label::file(from));
    fs::rename(from, to).map_err(|source| Error::file(from, "move", source))?;
    match label.filter(|label| label.exists()) {
        Some(label) => fs::rename(&label, label::file(to)).map_err(|source| Error::file(&label, "move", source)),
        None => Ok(()),
    }
}

/// A name that is free, for something that cannot have its own.
fn beside(path: &Path, number: i64) -> PathBuf {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = path.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
    let name = |count: u32| match count {
        0 => path.with_file_name(format!("{stem}-{number}{ending}")),
        count => path.with_file_name(format!("{stem}-{number}-{count}{ending}")),
    };
    (0..).map(name).find(|path| !path.exists()).expect("there is no end of numbers")
}
