//! A run as the catalogue lists it.

use crate::LiveError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::entry::Entry;
use super::query::Query;
use super::{Catalogue, label};
use stickslip_base::Error;

/// A run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Run {
    /// Counted through the project; no other run ever gets it.
    pub number: i64,
    /// In words.
    pub name: String,
    /// The command that made it: `demo`, `measure friction`; `recording`.
    pub kind: String,
    /// When it began, RFC 3339, UTC.
    pub begun: String,
    /// Time on the bench, or on the clock where there was no bench [s].
    pub duration: Option<f64>,
    /// The preset, where its command names one.
    pub preset: String,
    /// The position controller under test.
    pub controller: String,
    /// The rendering law.
    pub law: String,
    /// The number that one looks for first.
    pub key: Option<KeyNumber>,
    /// Tags, sorted.
    pub tags: Vec<String>,
    /// What a person wrote.
    pub note: String,
    /// The command line.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Where it lies, from the project's folder on.
    pub folder: String,
    /// Its files.
    pub files: Vec<String>,
    /// The one of them that can be replayed.
    pub record: Option<String>,
    /// Its friction curve in a few points: velocity [rad/s], torque [N m].
    pub curve: Vec<[f64; 2]>,
    /// Whether its files are there.
    pub state: State,
}

/// A number with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KeyNumber {
    /// As in the summary.
    pub name: String,
    /// SI.
    pub value: f64,
    /// Its unit; `1` for a pure number.
    pub unit: String,
}

/// Whether a run's files are there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// They are.
    Here,
    /// They were moved or removed by hand.
    Missing,
    /// A later run lies in the same folder.
    Replaced,
    /// They are in the bin.
    Deleted,
}

/// A parameter or a result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Value {
    /// Dotted.
    pub path: String,
    /// As in an equation; may be empty.
    pub symbol: String,
    /// SI unit.
    pub unit: String,
    /// Where it is one.
    pub number: Option<f64>,
    /// As text.
    pub text: String,
    /// Whether it is a result; else a parameter.
    pub result: bool,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The newest first.
    pub runs: Vec<Run>,
    /// How many there are, these among them.
    pub of: u64,
    /// What was left out: terms of the query that were not understood, damaged entries.
    pub hints: Vec<String>,
}

/// A run with all that is searched in.
#[derive(Clone, Debug, PartialEq)]
pub struct Details {
    /// The run.
    pub run: Run,
    /// Parameters and results.
    pub values: Vec<Value>,
}

impl Catalogue {
    /// The runs that a query finds, the newest first, at most `limit`. Words are looked for in name, kind, tags, note and
    /// the like; `key:value` in one of them or in a parameter; `M_S>0.2` compares a parameter or result, by its symbol or
    /// the end of its path. `-` excludes what a term finds. Damaged entries are named in the hints.
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
                Err(error) => found.hints.push(format!("run {number} is left out: {error}")),
            }
        }
        Ok(found)
    }

    /// One run with its parameters and results.
    ///
    /// # Errors
    /// [`LiveError::NoRun`]; [`LiveError::Catalogue`].
    pub fn details(&self, number: i64) -> Result<Details, Error> {
        self.known(number).map(|entry| self.run(entry))
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
            State::Missing => gone("its files were moved or removed", "`stickslip runs --rebuild` looks for them."),
            State::Replaced => gone("a later run lies in its folder", "Run it again, with another --out."),
            State::Deleted => gone("it is in the bin", "`stickslip runs restore` brings it back."),
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

    /// Whether the files in a folder are those of the run of this identity.
    pub(super) fn holds(&self, folder: &str, identity: &str) -> bool {
        let path = self.absolute(folder);
        path.exists() && label::Label::read(&path).is_some_and(|label| label.identity == identity)
    }
}
