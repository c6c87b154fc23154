//! Entry of runs into the catalogue.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::Catalogue;
use super::entry::Entry;
use super::facts::Facts;
use super::label::{Label, identity};
use super::store::rfc3339;
use stickslip_base::Error;

/// Origin of a run: data that are not in its files.
#[derive(Clone, Debug)]
pub struct RunOrigin {
    /// Its folder, or its file for a record alone.
    pub path: PathBuf,
    /// Start time.
    pub begun: SystemTime,
    /// Elapsed time [s], for a run without a bench.
    pub duration: f64,
    /// The preset, if any.
    pub preset: Option<String>,
    /// The number that was reserved for it.
    pub number: Option<i64>,
    /// Text after the number in its name, instead of its kind.
    pub words: Option<String>,
    /// Why it was not completed.
    pub incomplete: Option<String>,
    /// Whether its record was made automatically.
    pub automatic: bool,
}

impl RunOrigin {
    /// A run that ends now.
    pub fn now(path: &Path, begun: SystemTime, preset: Option<String>) -> Self {
        let duration = begun.elapsed().unwrap_or_default().as_secs_f64();
        // For a file, only its name.
        let name = |preset: String| preset.strip_suffix(".toml").map(file_name).unwrap_or(preset);
        let preset = preset.map(name);
        RunOrigin {
            path: path.into(),
            begun,
            duration,
            preset,
            number: None,
            words: None,
            incomplete: None,
            automatic: false,
        }
    }
}

fn file_name(path: &str) -> String {
    path.rsplit(['/', '\\']).next().unwrap_or(path).into()
}

impl Catalogue {
    /// Enters a finished run. Returns its number; `None` if its folder has no results of a run. An earlier run of the same
    /// folder is then listed as replaced.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`](crate::LiveError::Catalogue), [`Error::File`]; the run itself is unchanged.
    pub fn enter(&self, origin: &RunOrigin) -> Result<Option<i64>, Error> {
        let Some(facts) = Facts::read(&origin.path) else { return Ok(None) };
        let lock = self.lock()?;
        let number = match origin.number {
            Some(number) if !self.numbers()?.contains(&number) => number,
            _ => self.next_number(&lock)?,
        };
        let label = Label {
            number,
            name: origin.words.as_ref().map_or_else(|| facts.name(number), |words| format!("run {number}, {words}")),
            begun: rfc3339(origin.begun),
            duration: facts.duration.or(Some(origin.duration)),
            preset: origin.preset.clone().unwrap_or_else(|| facts.preset.clone()),
            incomplete: origin.incomplete.clone(),
            automatic: origin.automatic,
            ..Label::new(identity())
        };
        label.write(&origin.path)?;
        self.put(&lock, &Entry::new(self.relative(&origin.path), label, facts))?;
        self.purge(&lock)?;
        Ok(Some(number))
    }

    /// Reserves a number for a future run.
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
