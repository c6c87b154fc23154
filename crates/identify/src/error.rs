//! What only an identification can fail of.

use std::path::PathBuf;

/// A failure of an identification, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// A machine file that is not one.
    #[error("{}: {message}", path.display())]
    MachineFile {
        /// Which file.
        path: PathBuf,
        /// Place and reason.
        message: String,
    },
    /// A number of the machine file that cannot be.
    #[error("{}: {field} = {value} {remedy}", path.display())]
    MachineValue {
        /// Which file.
        path: PathBuf,
        /// Where in it.
        field: &'static str,
        /// As given.
        value: f64,
        /// What it should be.
        remedy: &'static str,
    },
    /// A recording that was not sampled as the machine file says.
    #[error("{}: its period is {found:.6e} s, the machine file says {expected:.6e} s. Correct `sampling_period`, or resample.", path.display())]
    OtherPeriod {
        /// The recording.
        path: PathBuf,
        /// Its period [s].
        found: f64,
        /// The machine's [s].
        expected: f64,
    },
    /// A column whose unit is given twice, and differently.
    #[error("{place}: the machine file says [{told}], the header says [{header}]. Correct one of them.")]
    TwoUnits {
        /// Whose unit.
        place: String,
        /// In the machine file.
        told: String,
        /// In the recording.
        header: String,
    },
    /// A result that no machine has.
    #[error("{what} is {value:.4e}. {remedy}")]
    Implausible {
        /// Of what.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What to do.
        remedy: &'static str,
    },
}

impl From<IdentifyError> for stickslip_base::Error {
    fn from(error: IdentifyError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
