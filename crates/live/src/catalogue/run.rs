//! A run as the catalogue lists it.

use crate::LiveError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::entry::Entry;
use super::query::Query;
use super::{Catalogue, label};
use stickslip_base::Error;

/// A run of the catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Run {
    /// Number, unique in the project.
    pub number: i64,
    /// Name.
    pub name: String,
    /// Its command: `demo`, `measure friction`; or `recording`.
    pub kind: String,
    /// Start time, RFC 3339, UTC.
    pub begun: String,
    /// Bench time, or elapsed time of a run without a bench [s].
    pub duration: Option<f64>,
    /// The preset in its command; may be empty.
    pub preset: String,
    /// The position controller under test.
    pub controller: String,
    /// The rendering law.
    pub law: String,
    /// The key number.
    pub key: Option<KeyNumber>,
    /// Tags, sorted.
    pub tags: Vec<String>,
    /// Note of the user.
    pub note: String,
    /// The command line.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Folder, relative to the project's folder.
    pub folder: String,
    /// Its files.
    pub files: Vec<String>,
    /// The file that can be replayed.
    pub record: Option<String>,
    /// Why it was not completed; `null` if it was.
    #[serde(default)]
    pub incomplete: Option<String>,
    /// Whether its record was removed, because the records of the project reached their limit.
    #[serde(default)]
    pub record_removed: bool,
    /// Its friction curve in at most 64 points: velocity [rad/s], torque [N m].
    pub curve: Vec<[f64; 2]>,
    /// Availability of its files.
    pub state: State,
}

/// A number with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KeyNumber {
    /// Name in the summary.
    pub name: String,
    /// Value in SI units.
    pub value: f64,
    /// Its unit; `1` for a pure number.
    pub unit: String,
}

/// Availability of a run's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Available.
    Here,
    /// Moved or removed by hand.
    Missing,
    /// Replaced by a later run in the same folder.
    Replaced,
    /// In the bin.
    Deleted,
}

/// A parameter or a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Value {
    /// Dotted path.
    pub path: String,
    /// Symbol in equations; may be empty.
    pub symbol: String,
    /// SI unit.
    pub unit: String,
    /// Numeric value; `null` for a text.
    pub number: Option<f64>,
    /// Value as text.
    pub text: String,
    /// Whether it is a result; otherwise it is a parameter.
    pub result: bool,
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The newest first.
    pub runs: Vec<Run>,
    /// Number of all runs that match.
    pub of: u64,
    /// Ignored terms of the query, and damaged entries.
    pub hints: Vec<String>,
}

/// A run with its parameters and results.
#[derive(Clone, Debug, PartialEq)]
pub struct Details {
    /// The run.
    pub run: Run,
    /// Parameters and results.
    pub values: Vec<Value>,
}

impl Catalogue {
    /// The runs that match a query, the newest first, at most `limit`. A word matches name, kind, tags, note and similar
    /// texts; `key:value` matches one of them or a parameter; `M_S>0.2` compares a parameter or result, given by its symbol
    /// or the end of its path. `-` excludes the runs that match a term. Damaged entries are reported in the hints.
    ///
    /// # Errors
    /// [`Error::File`] if the index cannot be read.
    pub fn runs(&self, query: &str, limit: u64) -> Result<Found, Error> {
        let mut query = Query::parse(query);
        let mut found = Found { runs: Vec::new(), of: 0, hints: std::mem::take(&mut query.hints) };
        for number in self.numbers()?.into_iter().rev() {
            match self.entry(number) {
                Ok(Some(entry)) if query.finds(&entry) => {
                    found.of += 1;
                    if found.of <= limit {
                        found.runs.push(self.run(entry).run);
                    }
                }
                // Another process may have removed it meanwhile.
                Ok(_) => {}
                Err(error) => found.hints.push(format!("run {number} is not listed: {error}")),
            }
        }
        Ok(found)
    }

    /// One run with its parameters and results.
    ///
    /// # Errors
    /// [`LiveError::NoRun`]; [`LiveError::Catalogue`].
    pub fn details(&self, number: i64) -> Result<Details, Error> {
        self.existing(number).map(|entry| self.run(entry))
    }

    /// Folder or file of a run.
    ///
    /// # Errors
    /// [`LiveError::NoRun`]; [`LiveError::RunGone`] if its files are not there.
    pub fn folder(&self, number: i64) -> Result<std::path::PathBuf, Error> {
        let run = self.details(number)?.run;
        let gone = |how, remedy| Err(LiveError::RunGone { number, how, remedy }.into());
        match run.state {
            State::Here => Ok(self.absolute(&run.folder)),
            State::Missing => {
                gone("its files were moved or removed", "Search for them with `stickslip runs --rebuild`.")
            }
            State::Replaced => gone("a later run in its folder has replaced it", "Repeat it with another --out."),
            State::Deleted => gone("it is in the bin", "Restore it with `stickslip runs restore`."),
        }
    }

    fn run(&self, Entry { folder, label, facts, .. }: Entry) -> Details {
        let state = if label.deleted.is_some() { State::Deleted } else { self.state(&folder, &label.identity) };
        let run = Run {
            number: label.number,
            name: label.name,
            kind: facts.kind,
            begun: label.begun,
            duration: label.duration,
            preset: label.preset,
            controller: facts.controller,
            law: facts.law,
            key: facts.key,
            tags: label.tags,
            note: label.note,
            command: facts.command,
            version: facts.version,
            folder,
            files: facts.files,
            record: facts.record,
            incomplete: label.incomplete,
            record_removed: label.record_removed,
            curve: facts.curve,
            state,
        };
        Details { run, values: facts.values }
    }

    fn state(&self, folder: &str, identity: &str) -> State {
        let path = self.absolute(folder);
        match label::Label::read(&path) {
            _ if !path.exists() => State::Missing,
            Some(label) if label.identity != identity => State::Replaced,
            _ => State::Here,
        }
    }

    /// Whether the files in a folder belong to the run of this identity.
    pub(super) fn holds(&self, folder: &str, identity: &str) -> bool {
        let path = self.absolute(folder);
        path.exists() && label::Label::read(&path).is_some_and(|label| label.identity == identity)
    }
}
