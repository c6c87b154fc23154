//! Errors of recordings and captures.

use std::path::PathBuf;

use stickslip_base::excerpt::{excerpt, list, message};

/// An error of a recording or a capture, in addition to those of every crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A recording without rows.
    #[error("{}: no row of numbers. A recording is a header and one row per sample.", path.display())]
    EmptyRecording {
        /// The file.
        path: PathBuf,
    },
    /// A row that does not match its header.
    #[error("{}:{line}: {}", path.display(), message(fault))]
    BadRow {
        /// The file.
        path: PathBuf,
        /// Position, from 1.
        line: u64,
        /// The fault and its remedy, in sentences.
        fault: String,
    },
    /// A cell that is not a usable number.
    #[error("{}:{line}: column `{}` holds \"{}\", {fault}", path.display(), excerpt(column), text)]
    BadCell {
        /// The file.
        path: PathBuf,
        /// Position, from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// Text of the cell, cut.
        text: String,
        /// The fault and its remedy.
        fault: &'static str,
    },
    /// A column that the recording does not have.
    #[error("{}: unknown column `{}`. Columns: {}. Did you mean `{}`? Set its name under [columns] in the machine file.",
        path.display(), excerpt(name), list(columns), excerpt(nearest))]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The requested name.
        name: String,
        /// The columns of the recording.
        columns: Vec<String>,
        /// The most similar column.
        nearest: String,
    },
    /// A group that the file does not have.
    #[error("{}: unknown group \"{name}\". Groups: {}. Select one with --group NAME.", path.display(), groups.join(", "))]
    MissingGroup {
        /// The file.
        path: PathBuf,
        /// The requested name.
        name: String,
        /// The groups of the file.
        groups: Vec<String>,
    },
    /// Time stamps that are not on an even grid.
    #[error("{}:{line}: {fault}: step {step:.3e} s, period {period:.3e} s. {remedy}", path.display())]
    UnevenTime {
        /// The file.
        path: PathBuf,
        /// Position, from 1.
        line: u64,
        /// The fault.
        fault: &'static str,
        /// The step that ends at this row [s].
        step: f64,
        /// Mean period [s].
        period: f64,
        /// The remedy.
        remedy: &'static str,
    },
    /// An invalid trigger.
    #[error("trigger \"{}\", column {column}: {}. {}", excerpt(text), message(fault), message(remedy))]
    Trigger {
        /// The trigger in words.
        text: String,
        /// Position, from 1.
        column: usize,
        /// The fault.
        fault: String,
        /// The remedy.
        remedy: String,
    },
    /// A row of a stream that is not after the previous one.
    #[error("row of cycle {cycle}{}: cycles must increase and be below 2^63. Start a new stream after a restart of \
        the bench.",
        last.map_or(String::new(), |last| format!(" after cycle {last}")))]
    RowOrder {
        /// Cycle of the row.
        cycle: u64,
        /// Cycle of the previous row.
        last: Option<u64>,
    },
    /// A memory requirement above its limit.
    #[error("{what} requires {bytes} bytes; the limit is {limit} bytes. {remedy}")]
    TooMuchMemory {
        /// Name of the sink.
        what: &'static str,
        /// Required memory [bytes].
        bytes: u128,
        /// Limit [bytes].
        limit: usize,
        /// The remedy.
        remedy: &'static str,
    },
}

impl From<RecordingError> for stickslip_base::Error {
    fn from(error: RecordingError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
