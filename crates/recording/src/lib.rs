//! A recording of an axis: named columns of numbers, from any kind of file. [`decode`] lists the formats.
//!
//! ```
//! use std::path::Path;
//! use stickslip_recording::Recording;
//!
//! let text = b"time [s],angle [rad]\n0.0,1.0\n0.1,1.5\n";
//! let recording = Recording::parse(Path::new("axis.csv"), text)?;
//! assert_eq!(recording.column("angle")?.values, [1.0, 1.5]);
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

pub mod capture;
mod column;
pub mod decode;
mod error;
pub mod export;
pub mod mdf;
pub mod samples;
pub mod table;
mod time;
pub mod understand;

use std::path::{Path, PathBuf};

pub use column::Column;
pub use decode::Wanted;
pub use error::RecordingError;
pub use time::{Spacing, resample};

use stickslip_base::{Error, excerpt::excerpt};

/// Columns of equal length, with their lines in the file for messages.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    path: PathBuf,
    columns: Vec<Column>,
    /// Line of each row in a text, or its number in a table; counted from 1.
    lines: Vec<u64>,
    notes: Vec<String>,
}

impl Recording {
    /// Reads a file; its kind and gzip are recognised by content. Of several groups the fastest one is the grid.
    ///
    /// # Errors
    /// A file that cannot be read, is of another kind, has no rows, or has rows of different length.
    pub fn read(path: &Path) -> Result<Self, Error> {
        decode::read(path, &Wanted::default())
    }

    /// Reads one group of a file, by name; without a name as [`read`](Self::read).
    ///
    /// # Errors
    /// As [`read`](Self::read), and an unknown group.
    pub fn read_group(path: &Path, group: Option<&str>) -> Result<Self, Error> {
        decode::read(path, &Wanted { group: group.map(str::to_owned), columns: Vec::new() })
    }

    /// Reads the groups of a file that hold what is wanted.
    ///
    /// # Errors
    /// As [`read_group`](Self::read_group).
    pub fn read_wanted(path: &Path, wanted: &Wanted) -> Result<Self, Error> {
        decode::read(path, wanted)
    }

    /// Parses the contents of a file of any format except Parquet.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        decode::parse(path, bytes, &Wanted::default())
    }

    /// A recording from columns in memory; messages use `name` as its path.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn from_columns(name: &str, columns: Vec<Column>) -> Self {
        let rows = columns.first().map_or(0, |c| c.values.len());
        assert!(columns.iter().all(|c| c.values.len() == rows), "columns of a recording have equal lengths");
        Recording { path: name.into(), columns, lines: (2..rows as u64 + 2).collect(), notes: Vec::new() }
    }

    /// The rows of a range.
    ///
    /// # Panics
    /// If the range ends beyond the last row.
    pub fn rows_of(&self, range: std::ops::Range<usize>) -> Self {
        let rows: Vec<usize> = range.clone().collect();
        let columns = self.columns.iter().map(|column| column.keep(&rows)).collect();
        Recording { columns, lines: self.lines[range].to_vec(), path: self.path.clone(), notes: self.notes.clone() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What was done to the file and chosen when it was read, in whole sentences.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// All columns, in the order of the file.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// A column by name, with finite numbers only.
    ///
    /// # Errors
    /// An unknown column, two columns of this name, or a cell that is not a finite number.
    pub fn column(&self, name: &str) -> Result<&Column, Error> {
        let mut matches = self.columns.iter().filter(|c| c.name == name);
        let Some(column) = matches.next() else {
            // The comparison takes time with the product of the lengths.
            let short = |text: &str| text.chars().take(100).collect::<String>();
            let likeness = |c: &&Column| (strsim::jaro_winkler(&short(&c.name), &short(name)) * 1e6) as u64;
            return Err(RecordingError::MissingColumn {
                path: self.path.clone(),
                name: name.to_owned(),
                columns: self.columns.iter().map(|c| c.name.clone()).collect(),
                nearest: self.columns.iter().max_by_key(likeness).map(|c| c.name.clone()).unwrap_or_default(),
            }
            .into());
        };
        if matches.next().is_some() {
            return Err(self.doubtful(name, "is not unique", "Rename one of them."));
        }
        if let Some(fault) = &column.fault {
            return Err(RecordingError::BadCell {
                path: self.path.clone(),
                line: self.lines[fault.row],
                column: name.to_owned(),
                text: fault.text.clone(),
                fault: fault.cause.unwrap_or(decode::NOT_A_NUMBER),
            }
            .into());
        }
        Ok(column)
    }

    /// Line of a row in a text, or its number in a table; counted from 1.
    ///
    /// # Panics
    /// For a row that the recording does not have.
    pub fn line(&self, row: usize) -> u64 {
        self.lines[row]
    }

    /// The error of a column that is implausible from a row on.
    pub fn refuse(&self, column: &str, refusal: &understand::Refusal) -> Error {
        let line = self.lines.get(refusal.row).copied().unwrap_or_default();
        unreadable(&self.path, &format!("line {line}: column `{column}`: {}", refusal.fault), &refusal.remedy)
    }

    /// The error of a column with implausible numbers.
    pub fn doubtful(&self, column: &str, fault: &str, remedy: &str) -> Error {
        unreadable(&self.path, &format!("column `{}` {fault}", excerpt(column)), remedy)
    }
}

/// The error of a file that is not a readable recording: cause and remedy.
pub fn unreadable(path: &Path, fault: &str, remedy: &str) -> Error {
    Error::Recording { path: path.to_owned(), fault: fault.to_owned(), remedy: remedy.to_owned() }
}

#[cfg(test)]
mod tests;
