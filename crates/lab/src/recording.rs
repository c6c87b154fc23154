//! A recording of an axis: named columns of numbers, from CSV or gzipped CSV.

use std::io::Read;
use std::path::{Path, PathBuf};

use crate::Error;

/// Columns of equal length, with enough memory of the file to name the line of a fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    path: PathBuf,
    columns: Vec<Column>,
    /// Line of each row in the file, counted from 1.
    lines: Vec<u64>,
}

/// One signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// As in the header, without its unit.
    pub name: String,
    /// From a header like `x [mm]`.
    pub unit: Option<String>,
    /// One a row; what was not a finite number is NaN.
    pub values: Vec<f64>,
    /// The first cell that is not a finite number, and its row. Only who uses the column need care.
    fault: Option<(usize, String)>,
}

/// How evenly a time column is spaced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// Mean step [s].
    pub period: f64,
    /// Largest departure of a time stamp from the even grid, as a share of the period.
    pub jitter: f64,
}

/// A time stamp may be off by this share of the period; differences of noisy time are noise in speed.
const JITTER_LIMIT: f64 = 0.05;

impl Column {
    /// A column without a fault.
    pub fn new(name: &str, values: Vec<f64>) -> Self {
        Column { name: name.to_owned(), unit: None, values, fault: None }
    }
}

impl Recording {
    /// Reads a file; gzip is recognised by its content.
    ///
    /// # Errors
    /// A file that cannot be read, has no rows, or whose rows differ in length.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::File { path: path.to_owned(), action: "read", source };
        let bytes = std::fs::read(path).map_err(failed)?;
        if !bytes.starts_with(&[0x1f, 0x8b]) {
            return Self::parse(path, &bytes);
        }
        let mut text = Vec::new();
        flate2::read::MultiGzDecoder::new(bytes.as_slice()).read_to_end(&mut text).map_err(failed)?;
        Self::parse(path, &text)
    }

    /// From columns in memory; `name` stands in messages where a file's path would.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn from_columns(name: &str, columns: Vec<Column>) -> Self {
        let rows = columns.first().map_or(0, |c| c.values.len());
        assert!(columns.iter().all(|c| c.values.len() == rows), "columns of one recording have one length");
        Recording { path: name.into(), columns, lines: (2..rows as u64 + 2).collect() }
    }

    /// From the text of a file: a header, then rows; separated by comma, semicolon or tab; `#` begins a comment.
    ///
    /// # Errors
    /// No rows, or rows of different lengths.
    pub fn parse(path: &Path, text: &[u8]) -> Result<Self, Error> {
        let header = text.split(|b| *b == b'\n').find(|l| !l.is_empty() && l[0] != b'#').unwrap_or_default();
        let delimiter = [b',', b';', b'\t'].into_iter().max_by_key(|d| header.iter().filter(|b| *b == d).count());
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(delimiter.unwrap_or(b','))
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(text);
        let malformed = |error: csv::Error| malformed(path, &error);
        let mut columns: Vec<Column> = reader.headers().map_err(malformed)?.iter().map(parse_header).collect();
        let mut lines = Vec::new();
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row).map_err(malformed)? {
            // The reader stands behind the row, or behind its line end. (A row's own position lies before blank lines.)
            let (end, line) = (reader.position().byte() as usize, reader.position().line());
            lines.push(if text[end - 1] == b'\n' { line - 1 } else { line });
            for (column, cell) in columns.iter_mut().zip(&row) {
                let value = cell.parse().ok().filter(|v: &f64| v.is_finite());
                if value.is_none() && column.fault.is_none() {
                    column.fault = Some((lines.len() - 1, cell.to_owned()));
                }
                column.values.push(value.unwrap_or(f64::NAN));
            }
        }
        if lines.is_empty() {
            return Err(Error::EmptyRecording { path: path.to_owned() });
        }
        Ok(Recording { path: path.to_owned(), columns, lines })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.lines.len()
    }

    /// Where it came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All columns, in the order of the file.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// A column by name, all of it finite numbers.
    ///
    /// # Errors
    /// No such column, or a cell of it is no finite number.
    pub fn column(&self, name: &str) -> Result<&Column, Error> {
        let Some(column) = self.columns.iter().find(|c| c.name == name) else {
            let likeness = |c: &&Column| (strsim::jaro_winkler(&c.name, name) * 1e6) as u64;
            return Err(Error::MissingColumn {
                path: self.path.clone(),
                name: name.to_owned(),
                columns: self.columns.iter().map(|c| c.name.clone()).collect(),
                nearest: self.columns.iter().max_by_key(likeness).map(|c| c.name.clone()).unwrap_or_default(),
            });
        };
        if let Some((row, text)) = &column.fault {
            return Err(Error::BadCell {
                path: self.path.clone(),
                line: self.lines[*row],
                column: name.to_owned(),
                text: text.clone(),
            });
        }
        Ok(column)
    }

    /// Checks that time stamps [s] lie on an even grid.
    ///
    /// # Errors
    /// Fewer than two rows, a step backwards or of nothing, a gap, or jitter beyond 5 % of the period.
    pub fn spacing(&self, time: &[f64]) -> Result<Spacing, Error> {
        let last = time.len().saturating_sub(1);
        if last == 0 {
            let remedy = "Record longer.";
            return Err(Error::TooFew { what: "rows in the recording", found: time.len(), needed: 2, remedy });
        }
        let period = (time[last] - time[0]) / last as f64;
        let uneven = |row: usize, fault, remedy| Error::UnevenTime {
            path: self.path.clone(),
            line: self.lines[row],
            fault,
            step: time[row] - time[row - 1],
            period,
            remedy,
        };
        // The median step: a gap widens the mean, and would hide behind it.
        let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
        let median = *steps.select_nth_unstable_by(last / 2, f64::total_cmp).1;
        for row in 1..=last {
            let step = time[row] - time[row - 1];
            if step <= 0.0 {
                return Err(uneven(row, "time does not advance", "Sort the rows and remove repeated ones."));
            }
            if step > 1.5 * median {
                return Err(uneven(row, "a gap", "Cut the recording there, or record without losses."));
            }
        }
        let departure = |row: usize| (time[row] - time[0] - row as f64 * period).abs() / period;
        let worst = (0..=last).max_by(|a, b| departure(*a).total_cmp(&departure(*b))).unwrap_or(0);
        if departure(worst) > JITTER_LIMIT {
            return Err(uneven(worst.max(1), "jitter", "Resample the recording on an even grid first."));
        }
        Ok(Spacing { period, jitter: departure(worst) })
    }
}

fn parse_header(text: &str) -> Column {
    // A byte-order mark belongs to the file, not to the first name.
    let text = text.trim_start_matches('\u{feff}');
    let (name, unit) = match text.strip_suffix(']').and_then(|t| t.split_once('[')) {
        Some((name, unit)) => (name.trim(), Some(unit.trim().to_owned())),
        None => (text, None),
    };
    Column { name: name.to_owned(), unit, values: Vec::new(), fault: None }
}

fn malformed(path: &Path, error: &csv::Error) -> Error {
    let line = error.position().map_or(0, csv::Position::line);
    let fault = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("{len} cells, the header has {expected_len}")
        }
        csv::ErrorKind::Utf8 { .. } => "text that is not UTF-8".to_owned(),
        _ => error.to_string(),
    };
    Error::BadRow { path: path.to_owned(), line, fault }
}

#[cfg(test)]
mod tests;
