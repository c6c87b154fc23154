//! Errors of an identification.

use std::path::{Path, PathBuf};

use stickslip_base::excerpt;

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
    #[error(
        "{}: the unit is [{}] in the machine file, but [{}] in the header. Correct one of them.",
        excerpt::message(place),
        excerpt::excerpt(told),
        excerpt::excerpt(header)
    )]
    TwoUnits {
        /// The column.
        place: String,
        /// Unit in the machine file.
        told: String,
        /// Unit in the recording.
        header: String,
    },
    /// Exchanged columns.
    #[error(
        "columns `{}` (command) and `{}` ({kind}) seem to be exchanged: as stated, inertia and friction miss {stated:.0} % of \
         the drive force, and {exchanged:.1} % with the two exchanged. Exchange their names in the machine file.",
        excerpt::excerpt(command),
        excerpt::excerpt(name)
    )]
    Exchanged {
        /// The column stated for the command.
        command: String,
        /// The other signal: position or reference.
        kind: &'static str,
        /// Its column.
        name: String,
        /// Error of the force as stated, RMS over RMS [%].
        stated: f64,
        /// Error of the force with both exchanged [%].
        exchanged: f64,
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

impl IdentifyError {
    /// The error of a parser, with its place and without the line, which may be long.
    pub(crate) fn of_toml(path: &Path, text: &str, error: &toml::de::Error) -> Self {
        let place = error.span().map(|span| excerpt::place(text, span.start));
        let place = place.map(|[line, column]| format!("line {line}, column {column}: ")).unwrap_or_default();
        let message = format!("{place}{}", excerpt::parser_message(error.message()));
        IdentifyError::MachineFile { path: path.to_owned(), message }
    }
}

impl From<IdentifyError> for stickslip_base::Error {
    fn from(error: IdentifyError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
