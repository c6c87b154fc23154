//! A run as the catalogue tells it.

use crate::LiveError;
use rusqlite::{OptionalExtension as _, Row, params};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// What of the query was not understood and left out.
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

const COLUMNS: &str = "number, name, kind, begun, duration, preset, controller, law, key_name, key_value, key_unit, tags, \
                       note, command, version, folder, files, record, curve, deleted, replaced";

impl Catalogue {
    /// The runs that a query finds, the newest first, at most so many. Words are looked for in name, kind, tags, note and
    /// the like; `key:value` in one of them or in a parameter; `M_S>0.2` compares a parameter or result, by its symbol or
    /// the end of its path. What stands behind `-` must not be.
    ///
    /// # Errors
    /// [`LiveError::Catalogue`].
    pub fn runs(&self, query: &str, limit: u64) -> Result<Found, Error> {
        let query = Query::parse(query);
        let Some(connection) = self.look()? else {
            return Ok(Found { runs: Vec::new(), of: 0, hints: query.hints });
        };
        let (condition, values) = query.condition();
        let parameters = rusqlite::params_from_iter(values.iter());
        let of = connection
            .query_row(&format!("SELECT count(*) FROM run WHERE {condition}"), parameters, |row| row.get::<_, i64>(0))
            .map_err(self.refused())?;
        let order = "ORDER BY number DESC";
        let text = format!("SELECT {COLUMNS} FROM run WHERE {condition} {order} LIMIT {}", limit.min(i64::MAX as u64));
        let mut statement = connection.prepare(&text).map_err(self.refused())?;
        let rows = statement.query_map(rusqlite::params_from_iter(values.iter()), |row| self.run(row));
        let runs = rows.and_then(Iterator::collect).map_err(self.refused())?;
        Ok(Found { runs, of: of as u64, hints: query.hints })
    }

    /// One run with its parameters and results.
    ///
    /// # Errors
    /// [`LiveError::NoRun`]; [`LiveError::Catalogue`].
    pub fn details(&self, number: i64) -> Result<Details, Error> {
        let connection = self.look()?.ok_or(LiveError::NoRun { number })?;
        let text = format!("SELECT {COLUMNS} FROM run WHERE number = ?1");
        let run = connection.query_row(&text, [number], |row| self.run(row)).optional().map_err(self.refused())?;
        let run = run.ok_or(LiveError::NoRun { number })?;
        let text = "SELECT path, symbol, unit, number, text, result FROM value WHERE run = ?1 ORDER BY rowid";
        let mut statement = connection.prepare(text).map_err(self.refused())?;
        let value = |row: &Row<'_>| {
            Ok(Value {
                path: row.get(0)?,
                symbol: row.get(1)?,
                unit: row.get(2)?,
                number: row.get(3)?,
                text: row.get(4)?,
                result: row.get(5)?,
            })
        };
        let values = statement.query_map(params![number], value).and_then(Iterator::collect).map_err(self.refused())?;
        Ok(Details { run, values })
    }

    /// Where a run lies.
    ///
    /// # Errors
    /// [`LiveError::NoRun`]; [`LiveError::RunGone`] where its files are not there.
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

    fn run(&self, row: &Row<'_>) -> rusqlite::Result<Run> {
        let list = |text: String| serde_json::from_str(&text).unwrap_or_default();
        let key = match (row.get(8)?, row.get(9)?, row.get(10)?) {
            (Some(name), Some(value), Some(unit)) => Some(KeyNumber { name, value, unit }),
            _ => None,
        };
        let curve: String = row.get(18)?;
        let (folder, deleted, replaced): (String, Option<String>, Option<i64>) =
            (row.get(15)?, row.get(19)?, row.get(20)?);
        let state = match (deleted, replaced) {
            (Some(_), _) => State::Deleted,
            (None, Some(_)) => State::Replaced,
            (None, None) if self.absolute(&folder).exists() => State::Here,
            (None, None) => State::Missing,
        };
        Ok(Run {
            number: row.get(0)?,
            name: row.get(1)?,
            kind: row.get(2)?,
            begun: row.get(3)?,
            duration: row.get(4)?,
            preset: row.get(5)?,
            controller: row.get(6)?,
            law: row.get(7)?,
            key,
            tags: row.get::<_, String>(11)?.split_whitespace().map(Into::into).collect(),
            note: row.get(12)?,
            command: row.get(13)?,
            version: row.get(14)?,
            folder,
            files: list(row.get(16)?),
            record: row.get(17)?,
            curve: serde_json::from_str(&curve).unwrap_or_default(),
            state,
        })
    }

    /// Whether the files of a run are this one's and not another's that came to lie there.
    pub(super) fn holds(&self, folder: &str, identity: &str) -> bool {
        label::Label::read(&self.absolute(folder)).is_some_and(|label| label.identity == identity)
    }
}
