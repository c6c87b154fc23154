//! A run comes into the catalogue.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::Catalogue;
use super::entry::Entry;
use super::facts::Facts;
use super::label::{Label, identity};
use super::store::rfc3339;
use stickslip_base::Error;

/// What whoever made a run knows of it and its files do not.
#[derive(Clone, Debug)]
pub struct RunOrigin {
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

impl RunOrigin {
    /// A run that ends now.
    pub fn now(path: &Path, begun: SystemTime, preset: Option<String>) -> Self {
        let duration = begun.elapsed().unwrap_or_default().as_secs_f64();
        // Of a file its name alone.
        let name = |preset: String| preset.strip_suffix(".toml").map(plain).unwrap_or(preset);
        RunOrigin { path: path.into(), begun, duration, preset: preset.map(name), number: None, words: None }
    }
}

fn plain(path: &str) -> String {
    path.rsplit(['/', '\\']).next().unwrap_or(path).into()
}

impl Catalogue {
    /// Enters a run that has ended. Returns its number; `None` if its folder has no results of a run. A run that was in
    /// the folder before is then listed as replaced.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`](crate::LiveError::Catalogue), [`Error::File`]: the run itself is as it was.
    pub fn enter(&self, made: &RunOrigin) -> Result<Option<i64>, Error> {
        let Some(facts) = Facts::read(&made.path) else { return Ok(None) };
        let lock = self.lock()?;
        let number = match made.number {
            Some(number) if !self.numbers()?.contains(&number) => number,
            _ => self.next_number(&lock)?,
        };
        let label = Label {
            number,
            name: made.words.as_ref().map_or_else(|| facts.name(number), |words| format!("run {number}, {words}")),
            begun: rfc3339(made.begun),
            duration: facts.duration.or(Some(made.duration)),
            preset: made.preset.clone().unwrap_or_else(|| facts.preset.clone()),
            ..Label::new(identity())
        };
        label.write(&made.path)?;
        self.put(&lock, &Entry::new(self.relative(&made.path), label, facts))?;
        self.purge(&lock)?;
        Ok(Some(number))
    }

    /// Sets a number aside for a run to come: no other one gets it.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`](crate::LiveError::Catalogue), [`Error::File`].
    pub fn set_aside(&self) -> Result<i64, Error> {
        let lock = self.lock()?;
        let number = self.next_number(&lock)?;
        self.give(&lock, number)?;
        Ok(number)
    }
}
