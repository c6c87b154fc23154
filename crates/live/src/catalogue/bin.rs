//! What is deleted lies in a bin for a while.

use crate::LiveError;
use std::fs;
use std::path::{Path, PathBuf};

use rusqlite::{Connection, params};

use super::{Catalogue, State, label};
use stickslip_base::{Error, output};

/// For so many days.
const DAYS: u32 = 30;

impl Catalogue {
    /// Moves a run into the bin.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunGone`] where it lies there already.
    pub fn delete(&self, number: i64) -> Result<(), Error> {
        let run = self.details(number)?.run;
        if run.state == State::Deleted {
            let remedy = "`stickslip runs restore` brings it back.";
            return Err(LiveError::RunGone { number, how: "it is in the bin", remedy }.into());
        }
        let mut connection = self.write()?;
        let transaction = self.begin(&mut connection)?;
        let (mut label, folder) = self.label(&transaction, number)?;
        let from = self.absolute(&folder);
        let holds = self.holds(&folder, &label.identity);
        let (mut to, mut moved) = (folder.clone(), None);
        if holds && run.state == State::Here {
            let name = from.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            let place = self.bin().join(number.to_string());
            output::create_folder(&place)?;
            let target = place.join(name);
            to = self.relative(&target);
            moved = Some(target);
        }
        let now = "strftime('%Y-%m-%dT%H:%M:%SZ', 'now')";
        let deleted: String =
            transaction.query_row(&format!("SELECT {now}"), [], |row| row.get(0)).map_err(self.refused())?;
        (label.deleted, label.origin) = (Some(deleted), Some(folder));
        transaction
            .execute(
                "UPDATE run SET folder = ?2, deleted = ?3, origin = ?4 WHERE number = ?1",
                params![number, to, label.deleted, label.origin],
            )
            .map_err(self.refused())?;
        if let Some(target) = &moved {
            label.write(&from)?;
            shift(&from, target)?;
        }
        transaction.commit().map_err(self.refused())?;
        self.purge(&mut connection)
    }

    /// Brings a run back to where it lay, or beside what lies there now: its folder.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunGone`] where it is not in the bin.
    pub fn restore(&self, number: i64) -> Result<PathBuf, Error> {
        let run = self.details(number)?.run;
        if run.state != State::Deleted {
            let remedy = "Only what was deleted can be restored.";
            return Err(LiveError::RunGone { number, how: "it is not in the bin", remedy }.into());
        }
        let mut connection = self.write()?;
        let transaction = self.begin(&mut connection)?;
        let (mut label, folder) = self.label(&transaction, number)?;
        let from = self.absolute(&folder);
        let origin = label.origin.take().unwrap_or_else(|| folder.clone());
        label.deleted = None;
        let mut to = self.absolute(&origin);
        let moves = from.starts_with(self.bin()) && from.exists();
        if moves && to.exists() {
            to = beside(&to, number);
        }
        transaction
            .execute(
                "UPDATE run SET folder = ?2, deleted = NULL, origin = NULL WHERE number = ?1",
                params![number, self.relative(&to)],
            )
            .map_err(self.refused())?;
        if moves {
            if let Some(above) = to.parent() {
                output::create_folder(above)?;
            }
            label.write(&from)?;
            shift(&from, &to)?;
            // Empty but for what a person put there.
            let _ = from.parent().map(fs::remove_dir);
        }
        transaction.commit().map_err(self.refused())?;
        Ok(to)
    }

    /// What has been in the bin for long goes for good.
    pub(super) fn purge(&self, connection: &mut Connection) -> Result<(), Error> {
        let transaction = self.begin(connection)?;
        let old =
            format!("SELECT number FROM run WHERE deleted < strftime('%Y-%m-%dT%H:%M:%SZ', 'now', '-{DAYS} days')");
        let numbers: Vec<i64> = {
            let mut old = transaction.prepare(&old).map_err(self.refused())?;
            let numbers = old.query_map([], |row| row.get(0));
            numbers.and_then(Iterator::collect).map_err(self.refused())?
        };
        for number in &numbers {
            transaction.execute("DELETE FROM run WHERE number = ?1", [number]).map_err(self.refused())?;
        }
        transaction.commit().map_err(self.refused())?;
        for number in numbers {
            let place = self.bin().join(number.to_string());
            if let Err(source) = fs::remove_dir_all(&place)
                && source.kind() != std::io::ErrorKind::NotFound
            {
                return Err(Error::file(&place, "empty", source));
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
