//! Bin: deleted runs are kept for 30 days.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::store::{Lock, rfc3339};
use super::{Catalogue, label};
use crate::LiveError;
use stickslip_base::{Error, output};

/// Time for which deleted runs are kept.
const RETENTION: Duration = Duration::from_hours(30 * 24);

impl Catalogue {
    /// Moves a run into the bin.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunGone`] if it is in the bin.
    pub fn delete(&self, number: i64) -> Result<(), Error> {
        self.existing(number)?;
        let lock = self.lock()?;
        let mut entry = self.existing(number)?;
        if entry.label.deleted.is_some() {
            let remedy = "Restore it with `stickslip runs restore`.";
            return Err(LiveError::RunGone { number, how: "it is in the bin", remedy }.into());
        }
        let from = self.absolute(&entry.folder);
        let holds = self.holds(&entry.folder, &entry.label.identity);
        let origin = entry.folder.clone();
        (entry.label.deleted, entry.label.origin) = (Some(rfc3339(SystemTime::now())), Some(origin));
        // Also for a run without files: `purge` looks for these folders.
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

    /// Restores a run to its former place, or next to it if the place is taken. Returns its folder.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunGone`] if it is not in the bin.
    pub fn restore(&self, number: i64) -> Result<PathBuf, Error> {
        self.existing(number)?;
        let lock = self.lock()?;
        let mut entry = self.existing(number)?;
        if entry.label.deleted.take().is_none() {
            let remedy = "Only deleted runs can be restored.";
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
        // Fails if a user put files into it.
        let _ = fs::remove_dir(self.bin().join(number.to_string()));
        Ok(to)
    }

    /// Removes runs whose time in the bin is over.
    pub(super) fn purge(&self, lock: &Lock) -> Result<(), Error> {
        let Ok(places) = fs::read_dir(self.bin()) else { return Ok(()) };
        let oldest = rfc3339(SystemTime::now() - RETENTION);
        for place in places.flatten() {
            let Some(number) = place.file_name().to_str().and_then(|name| name.parse().ok()) else { continue };
            // The files of a damaged entry are kept; the next search reports it.
            let deleted = self.entry(number).ok().flatten().and_then(|entry| entry.label.deleted);
            // These texts sort like their times.
            if deleted.is_some_and(|deleted| deleted < oldest) {
                let place = place.path();
                fs::remove_dir_all(&place).map_err(|source| Error::file(&place, "empty", source))?;
                self.forget(lock, number)?;
            }
        }
        Ok(())
    }
}

/// Moves a run: its folder, or its file with its label.
fn shift(from: &Path, to: &Path) -> Result<(), Error> {
    let label = (!from.is_dir()).then(|| label::file(from));
    fs::rename(from, to).map_err(|source| Error::file(from, "move", source))?;
    match label.filter(|label| label.exists()) {
        Some(label) => fs::rename(&label, label::file(to)).map_err(|source| Error::file(&label, "move", source)),
        None => Ok(()),
    }
}

/// A free path next to a taken one.
fn beside(path: &Path, number: i64) -> PathBuf {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = path.extension().map_or(String::new(), |ending| format!(".{}", ending.to_string_lossy()));
    let name = |count: u32| match count {
        0 => path.with_file_name(format!("{stem}-{number}{ending}")),
        count => path.with_file_name(format!("{stem}-{number}-{count}{ending}")),
    };
    (0..).map(name).find(|path| !path.exists()).expect("infinitely many names")
}
