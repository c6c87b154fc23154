//! What a person says of a run.

use crate::LiveError;
use rusqlite::{OptionalExtension as _, Row, params};

use super::Catalogue;
use super::label::Label;
use stickslip_base::Error;

impl Catalogue {
    /// Gives a run another name.
    ///
    /// # Errors
    /// [`LiveError::NoRun`], [`LiveError::Catalogue`], [`Error::File`]; [`LiveError::RunText`] for no name.
    pub fn rename(&self, number: i64, name: &str) -> Result<(), Error> {
        let name = name.trim();
        if name.is_empty() {
            return Err(LiveError::RunText { text: name.into(), remedy: "A name has at least a letter." }.into());
        }
        self.edit(number, |label| label.name = name.into())
    }

    /// Adds tags and takes others away.
    ///
    /// # Errors
    /// As [`rename`](Self::rename); [`LiveError::RunText`] for what is no tag.
    pub fn tag(&self, number: i64, add: &[String], remove: &[String]) -> Result<(), Error> {
        for tag in add {
            let fits = |letter: char| letter.is_alphanumeric() || "-_.".contains(letter);
            if tag.is_empty() || tag.starts_with('-') || !tag.chars().all(fits) {
                let remedy = "A tag is a word of letters, digits, - _ and dots.";
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

    /// Writes a note; an empty one takes it away.
    ///
    /// # Errors
    /// As [`rename`](Self::rename).
    pub fn note(&self, number: i64, note: &str) -> Result<(), Error> {
        self.edit(number, |label| label.note = note.trim().into())
    }

    /// In the index, and in the run's folder where that is there.
    fn edit(&self, number: i64, edit: impl FnOnce(&mut Label)) -> Result<(), Error> {
        self.look()?.ok_or(LiveError::NoRun { number })?;
        let mut connection = self.write()?;
        let transaction = self.begin(&mut connection)?;
        let (mut label, folder) = self.label(&transaction, number)?;
        edit(&mut label);
        transaction
            .execute(
                "UPDATE run SET name = ?2, tags = ?3, note = ?4, deleted = ?5, origin = ?6 WHERE number = ?1",
                params![number, label.name, label.tags.join(" "), label.note, label.deleted, label.origin],
            )
            .map_err(self.refused())?;
        self.gather_words(&transaction, number)?;
        if self.holds(&folder, &label.identity) {
            label.write(&self.absolute(&folder))?;
        }
        transaction.commit().map_err(self.refused())
    }

    /// What is kept beside a run, and where it lies.
    pub(super) fn label(&self, connection: &rusqlite::Connection, number: i64) -> Result<(Label, String), Error> {
        let text = "SELECT identity, name, begun, duration, preset, tags, note, deleted, origin, folder FROM run \
                    WHERE number = ?1";
        let label = |row: &Row<'_>| {
            let label = Label {
                number,
                name: row.get(1)?,
                begun: row.get(2)?,
                duration: row.get(3)?,
                preset: row.get(4)?,
                tags: row.get::<_, String>(5)?.split_whitespace().map(Into::into).collect(),
                note: row.get(6)?,
                deleted: row.get(7)?,
                origin: row.get(8)?,
                ..Label::new(row.get(0)?)
            };
            Ok((label, row.get(9)?))
        };
        let found = connection.query_row(text, [number], label).optional().map_err(self.refused())?;
        found.ok_or(LiveError::NoRun { number }.into())
    }
}
