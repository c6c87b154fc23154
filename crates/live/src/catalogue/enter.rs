//! A run comes into the catalogue.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use rusqlite::{OptionalExtension as _, Transaction, params};

use super::Catalogue;
use super::facts::Facts;
use super::label::{Label, identity};
use stickslip_base::Error;

/// What whoever made a run knows of it and its files do not.
#[derive(Clone, Debug)]
pub struct Made {
    /// Its folder; or its file, where that is all.
    pub path: PathBuf,
    /// When it began.
    pub begun: SystemTime,
    /// Time on the clock [s], for a run that was on no bench.
    pub duration: f64,
    /// The preset, where it has one.
    pub preset: Option<String>,
    /// The number that was set aside for it.
    pub number: Option<i64>,
    /// What it is called behind its number, instead of its kind.
    pub words: Option<String>,
}

impl Made {
    /// A run that ends now.
    pub fn now(path: &Path, begun: SystemTime, preset: Option<String>) -> Self {
        let duration = begun.elapsed().unwrap_or_default().as_secs_f64();
        // Of a file its name alone.
        let name = |preset: String| preset.strip_suffix(".toml").map(plain).unwrap_or(preset);
        Made { path: path.into(), begun, duration, preset: preset.map(name), number: None, words: None }
    }
}

fn plain(path: &str) -> String {
    path.rsplit(['/', '\\']).next().unwrap_or(path).into()
}

impl Catalogue {
    /// Enters a run that has ended: its number; none where its folder has no results of a run. A run that lay there
    /// before is kept as replaced.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`](crate::LiveError::Catalogue), [`Error::File`]: the run itself is as it was.
    pub fn enter(&self, made: &Made) -> Result<Option<i64>, Error> {
        let Some(facts) = Facts::read(&made.path) else { return Ok(None) };
        let mut connection = self.write()?;
        let transaction = self.begin(&mut connection)?;
        let begun = made.begun.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        let number = match made.number {
            Some(number) if self.is_free(&transaction, number)? => number,
            _ => self.next_number(&transaction)?,
        };
        let label = Label {
            number,
            name: made.words.as_ref().map_or_else(|| facts.name(number), |words| format!("run {number}, {words}")),
            begun: self.time(&transaction, begun)?,
            duration: facts.duration.or(Some(made.duration)),
            preset: made.preset.clone().unwrap_or_else(|| facts.preset.clone()),
            ..Label::new(identity())
        };
        let folder = self.relative(&made.path);
        transaction
            .execute("UPDATE run SET replaced = ?1 WHERE folder = ?2 AND deleted IS NULL", params![number, folder])
            .map_err(self.refused())?;
        self.insert(&transaction, &label, &facts, &folder)?;
        label.write(&made.path)?;
        transaction.commit().map_err(self.refused())?;
        // What was deleted long ago goes when something comes.
        self.purge(&mut connection)?;
        Ok(Some(number))
    }

    /// Sets a number aside for a run to come: no other one gets it.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`](crate::LiveError::Catalogue).
    pub fn set_aside(&self) -> Result<i64, Error> {
        let mut connection = self.write()?;
        let transaction = self.begin(&mut connection)?;
        let number = self.next_number(&transaction)?;
        let counted = transaction.execute("UPDATE sqlite_sequence SET seq = ?1 WHERE name = 'run'", [number]);
        if counted.map_err(self.refused())? == 0 {
            let first = "INSERT INTO sqlite_sequence (name, seq) VALUES ('run', ?1)";
            transaction.execute(first, [number]).map_err(self.refused())?;
        }
        transaction.commit().map_err(self.refused())?;
        Ok(number)
    }

    fn is_free(&self, transaction: &Transaction<'_>, number: i64) -> Result<bool, Error> {
        let text = "SELECT NOT EXISTS (SELECT 1 FROM run WHERE number = ?1)";
        transaction.query_row(text, [number], |row| row.get(0)).map_err(self.refused())
    }

    /// A number that no run has or had.
    pub(super) fn next_number(&self, transaction: &Transaction<'_>) -> Result<i64, Error> {
        let last = "SELECT max(coalesce((SELECT seq FROM sqlite_sequence WHERE name = 'run'), 0), \
                    coalesce((SELECT max(number) FROM run), 0))";
        let last: Option<i64> = transaction.query_row(last, [], |row| row.get(0)).optional().map_err(self.refused())?;
        Ok(last.unwrap_or(0) + 1)
    }

    /// Seconds since 1970 as RFC 3339.
    pub(super) fn time(&self, transaction: &Transaction<'_>, seconds: f64) -> Result<String, Error> {
        let text = "SELECT strftime('%Y-%m-%dT%H:%M:%SZ', ?1, 'unixepoch')";
        transaction.query_row(text, [seconds], |row| row.get(0)).map_err(self.refused())
    }

    /// A row and its values.
    pub(super) fn insert(
        &self,
        transaction: &Transaction<'_>,
        label: &Label,
        facts: &Facts,
        folder: &str,
    ) -> Result<(), Error> {
        let Facts { kind, command, version, controller, law, key, files, record, curve, values, .. } = facts;
        let json = |value: serde_json::Value| value.to_string();
        let key = key.as_ref();
        transaction
            .execute(
                "INSERT INTO run (number, identity, name, kind, begun, duration, preset, controller, law, key_name, \
                 key_value, key_unit, tags, note, command, version, folder, files, record, curve, deleted, origin, words) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, ?20, ?21, \
                 ?22, '')",
                params![
                    label.number,
                    label.identity,
                    label.name,
                    kind,
                    label.begun,
                    label.duration,
                    label.preset,
                    controller,
                    law,
                    key.map(|key| &key.name),
                    key.map(|key| key.value),
                    key.map(|key| &key.unit),
                    label.tags.join(" "),
                    label.note,
                    command,
                    version,
                    folder,
                    json(files.as_slice().into()),
                    record,
                    json(curve.iter().map(|point| serde_json::Value::from(point.to_vec())).collect()),
                    label.deleted,
                    label.origin,
                ],
            )
            .map_err(self.refused())?;
        let insert =
            "INSERT INTO value (run, path, symbol, unit, number, text, result) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)";
        let mut insert = transaction.prepare(insert).map_err(self.refused())?;
        for value in values {
            let row =
                params![label.number, value.path, value.symbol, value.unit, value.number, value.text, value.result];
            insert.execute(row).map_err(self.refused())?;
        }
        self.gather_words(transaction, label.number)
    }

    /// All that a word is looked for in, in small letters.
    pub(super) fn gather_words(&self, transaction: &Transaction<'_>, number: i64) -> Result<(), Error> {
        let text = "SELECT number || ' ' || name || ' ' || kind || ' ' || preset || ' ' || controller || ' ' || law || ' ' || \
                    tags || ' ' || note || ' ' || folder || ' ' || command FROM run WHERE number = ?1";
        let words: String = transaction.query_row(text, [number], |row| row.get(0)).map_err(self.refused())?;
        transaction
            .execute("UPDATE run SET words = ?2 WHERE number = ?1", params![number, words.to_lowercase()])
            .map(drop)
            .map_err(self.refused())
    }
}
