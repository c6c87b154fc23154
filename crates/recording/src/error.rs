//! What only a recording or a capture can fail of.

use std::path::PathBuf;

/// A failure of a recording or a capture, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A recording without a row.
    #[error("{}: there is no row of numbers in it. A recording is a header and one row a sample.", path.display())]
    EmptyRecording {
        /// Which file.
        path: PathBuf,
    },
    /// A row that is not as its header says.
    #[error("{}:{line}: {fault}. Mend or remove the row.", path.display())]
    BadRow {
        /// Which file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong with it.
        fault: String,
    },
    /// A cell that is not a finite number.
    #[error("{}:{line}: column `{column}` holds \"{text}\", not a finite number. Write numbers with a decimal point, or cut the rows without a value.", path.display())]
    BadCell {
        /// Which file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// Which column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// A column that the recording does not have.
    #[error("{}: there is no column `{name}` among {}. Is it `{nearest}`? Name it in the machine file under [columns].", path.display(), columns.join(", "))]
    MissingColumn {
        /// Which file.
        path: PathBuf,
        /// Asked for.
        name: String,
        /// What there is.
        columns: Vec<String>,
        /// The one most alike.
        nearest: String,
    },
    /// Time stamps that are not on an even grid.
    #[error("{}:{line}: {fault}: a step of {step:.3e} s where the period is {period:.3e} s. {remedy}", path.display())]
    UnevenTime {
        /// Which file.
        path: PathBuf,
        /// Counted from 1.
        line: u64,
        /// What is wrong.
        fault: &'static str,
        /// The step that ends there [s].
        step: f64,
        /// Mean period [s].
        period: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A trigger that makes no sense.
    #[error("trigger \"{text}\", column {column}: {fault}. {remedy}")]
    Trigger {
        /// The trigger in words.
        text: String,
        /// Counted from 1.
        column: usize,
        /// What is wrong there.
        fault: String,
        /// What to do.
        remedy: String,
    },
    /// A row of a stream that is not after the one before it.
    #[error("a row of cycle {cycle}{}: cycles increase, below 2^63. A bench that was started anew needs a new stream.",
        last.map_or(String::new(), |last| format!(" after one of cycle {last}")))]
    RowOrder {
        /// Its cycle.
        cycle: u64,
        /// That of the row before.
        last: Option<u64>,
    },
    /// More memory than is allowed.
    #[error("{what} would take {bytes} bytes, {limit} are allowed. {remedy}")]
    TooMuchMemory {
        /// What.
        what: &'static str,
        /// At most.
        bytes: u128,
        /// Allowed.
        limit: usize,
        /// What to do.
        remedy: &'static str,
    },
}

impl From<RecordingError> for stickslip_base::Error {
    fn from(error: RecordingError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
