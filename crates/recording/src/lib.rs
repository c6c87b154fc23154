//! A recording of an axis: named columns of numbers, from any kind of file.
//!
//! | file | read as | units |
//! |-|-|-|
//! | text | comma, semicolon or tab; decimal point or comma; `#` comments; UTF-8, UTF-16 or Latin-1; may be gzipped | `x [mm]`, `x (mm)` or a row below the header |
//! | MAT, level 5 | vectors and columns of matrices, compressed or not | none |
//! | Parquet | flat columns of numbers, not compressed or with Snappy | metadata `unit.NAME`, or JSON under `units` |
//! | MDF 4 | numbers of the group with the most signals; see [`mdf`] | of channel or conversion |
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
mod error;
pub mod export;
mod mat;
pub mod mdf;
mod parquet;
pub mod table;
mod text;
mod time;
pub mod understand;

use std::io::Read;
use std::path::{Path, PathBuf};

pub use error::RecordingError;
pub use time::{Spacing, resample};

use stickslip_base::{Error, excerpt::excerpt, input};

/// Columns of equal length, with their lines in the file for messages.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    path: PathBuf,
    columns: Vec<Column>,
    /// Line of each row in a text, or its number in a table; counted from 1.
    lines: Vec<u64>,
}

/// One signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name in the header, without the unit.
    pub name: String,
    /// Unit in the file.
    pub unit: Option<String>,
    /// One value per row, relative to `origin`; cells that are not finite numbers are NaN.
    pub values: Vec<f64>,
    /// Added to all values: 0, but for whole numbers beyond 2⁵³, whose differences would be rounded.
    pub origin: f64,
    /// The first cell that is not a finite number, and its row. It matters only if the column is used.
    fault: Option<(usize, String)>,
}

impl Column {
    /// A column without a unit.
    pub fn new(name: &str, values: Vec<f64>) -> Self {
        let fault = values.iter().position(|v| !v.is_finite()).map(|row| (row, values[row].to_string()));
        Column { name: name.to_owned(), unit: None, values, origin: 0.0, fault }
    }

    /// The column with this unit.
    pub fn with_unit(self, unit: Option<String>) -> Self {
        Column { unit, ..self }
    }
}

impl Recording {
    /// Reads a file; its kind and gzip are recognised by content.
    ///
    /// # Errors
    /// A file that cannot be read, is of another kind, has no rows, or has rows of different length.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::file(path, "read", source);
        let bytes = input::read(path, input::RECORDING)?;
        if bytes.starts_with(b"PAR1") {
            if input::is_standard_input(path) {
                return Err(unreadable(path, "Parquet from standard input is not supported", "Save it as a file."));
            }
            return parquet::read(path);
        }
        if !bytes.starts_with(&[0x1f, 0x8b]) {
            return Self::parse(path, &bytes);
        }
        let mut inner = Vec::new();
        let most = input::RECORDING.bytes();
        let unpacked = flate2::read::MultiGzDecoder::new(bytes.as_slice());
        unpacked.take(most + 1).read_to_end(&mut inner).map_err(failed)?;
        if inner.len() as u64 > most {
            return Err(input::RECORDING.exceeded(path, None));
        }
        Self::parse(path, &inner)
    }

    /// Parses the contents of a text, MAT or MDF file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, Error> {
        let refuse = |fault: &str, remedy: &str| Err(unreadable(path, fault, remedy));
        if bytes.starts_with(b"MATLAB 5.0") {
            return mat::read(path, bytes);
        }
        if bytes.starts_with(b"MATLAB 7.3") || bytes.starts_with(b"\x89HDF") {
            return refuse(
                "unsupported HDF5 file, as MATLAB writes with -v7.3",
                "Save it again with save(…, '-v7'), or as CSV.",
            );
        }
        if mdf::recognises(bytes) {
            return mdf::table(path, bytes);
        }
        text::read(path, bytes)
    }

    /// A recording from columns in memory; messages use `name` as its path.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn from_columns(name: &str, columns: Vec<Column>) -> Self {
        let rows = columns.first().map_or(0, |c| c.values.len());
        assert!(columns.iter().all(|c| c.values.len() == rows), "columns of a recording have equal lengths");
        Recording { path: name.into(), columns, lines: (2..rows as u64 + 2).collect() }
    }

    /// A recording from a table whose rows have numbers instead of lines.
    fn from_table(path: &Path, columns: Vec<Column>) -> Result<Self, Error> {
        let rows = columns.first().map_or(0, |c| c.values.len());
        if rows == 0 {
            return Err(RecordingError::EmptyRecording { path: path.to_owned() }.into());
        }
        Ok(Recording { path: path.to_owned(), columns, lines: (1..=rows as u64).collect() })
    }

    /// The rows of a range.
    ///
    /// # Panics
    /// If the range ends beyond the last row.
    pub fn rows_of(&self, range: std::ops::Range<usize>) -> Self {
        let cut = |c: &Column| {
            let cut = Column::new(&c.name, c.values[range.clone()].to_vec()).with_unit(c.unit.clone());
            Column { origin: c.origin, ..cut }
        };
        let columns = self.columns.iter().map(cut).collect();
        Recording { path: self.path.clone(), columns, lines: self.lines[range.clone()].to_vec() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
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
        if let Some((row, text)) = &column.fault {
            return Err(RecordingError::BadCell {
                path: self.path.clone(),
                line: self.lines[*row],
                column: name.to_owned(),
                text: text.clone(),
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
