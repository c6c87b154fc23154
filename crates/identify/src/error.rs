//! Errors of an identification.

use std::path::PathBuf;

/// A failure of an identification, besides the common ones.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// An invalid machine file.
    #[error("{}: {message}", path.display())]
    MachineFile {
        /// The file.
        path: PathBuf,
        /// Place and reason.
        message: String,
    },
    /// An invalid number of the machine file.
    #[error("{}: {field} = {value} {remedy}", path.display())]
    MachineValue {
        /// The file.
        path: PathBuf,
        /// Its key.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Allowed values.
        remedy: &'static str,
    },
    /// A recording with another sampling period than the machine file.
    #[error("{}: its period is {found:.6e} s, but {expected:.6e} s in the machine file. Correct `sampling_period`, or resample.", path.display())]
    OtherPeriod {
        /// The recording.
        path: PathBuf,
        /// Its period [s].
        found: f64,
        /// The machine's [s].
        expected: f64,
    },
    /// A column with two different units.
    #[error("{place}: the unit is [{told}] in the machine file, but [{header}] in the header. Correct one of them.")]
    TwoUnits {
        /// The column.
        place: String,
        /// Unit in the machine file.
        told: String,
        /// Unit in the recording.
        header: String,
    },
    /// An implausible result.
    #[error("{what} is {value:.4e}. {remedy}")]
    Implausible {
        /// The quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The remedy.
        remedy: &'static str,
    },
}

impl From<IdentifyError> for stickslip_base::Error {
    fn from(error: IdentifyError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
