//! Name, tags and note of a run.

use crate::LiveError;

use super::Catalogue;
use super::label::Label;
use stickslip_base::Error;

impl Catalogue {
    /// Renames a run. Its record is then exempt from the limit of automatic records.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunText`] for an empty name.
    pub fn rename(&self, number: i64, name: &str) -> Result<(), Error> {
        let name = name.trim();
        if name.is_empty() {
            return Err(LiveError::RunText { text: name.into(), remedy: "A name has at least one letter." }.into());
        }
        // A named run keeps its record.
        self.edit(number, |label| (label.name, label.automatic) = (name.into(), false))
    }

    /// Adds and removes tags.
    ///
    /// # Errors
    /// As [`rename`](Self::rename); [`LiveError::RunText`] for an invalid tag.
    pub fn tag(&self, number: i64, add: &[String], remove: &[String]) -> Result<(), Error> {
        for tag in add {
            let is_allowed = |letter: char| letter.is_alphanumeric() || "-_.".contains(letter);
            if tag.is_empty() || tag.starts_with('-') || !tag.chars().all(is_allowed) {
                let remedy = "A tag has letters, digits, -, _ and dots; its first character is not -.";
                return Err(LiveError::RunText { text: tag.clone(), remedy }.into());
            }
        }
        self.edit(number, |label| {
            label.tags.retain(|tag| !remove.contains(tag));
            label.tags.extend(add.iter().cloned());
            label.tags.sort();
            label.tags.dedup();
        })
    }

    /// Writes a note; an empty one removes it.
    ///
    /// # Errors
    /// As [`rename`](Self::rename).
    pub fn note(&self, number: i64, note: &str) -> Result<(), Error> {
        self.edit(number, |label| label.note = note.trim().into())
    }

    /// Changes the label in the run's folder, if its files are there, and in the index.
    fn edit(&self, number: i64, edit: impl FnOnce(&mut Label)) -> Result<(), Error> {
        // Before the lock, because the lock creates the folder of the index.
        self.existing(number)?;
        let lock = self.lock()?;
        let mut entry = self.existing(number)?;
        edit(&mut entry.label);
        if self.holds(&entry.folder, &entry.label.identity) {
            entry.label.write(&self.absolute(&entry.folder))?;
        }
        self.put(&lock, &entry)
    }
}
