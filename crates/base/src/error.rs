//! Errors that every crate can return: cause, place and remedy as fields; formatted at the edge.
//!
//! Each crate above has an enum of its specific errors. It converts into [`Error::Of`]; [`Error::of`] returns it.

use std::io;
use std::path::{Path, PathBuf};

use crate::excerpt::{excerpt, message};
use crate::parameters::ParameterProblems;

/// An error of the laboratory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file operation that failed.
    #[error("{}: cannot {action} it ({source}). {}", path.display(), remedy(source))]
    File {
        /// The file.
        path: PathBuf,
        /// The operation: "read", "write".
        action: &'static str,
        /// The error of the operating system.
        source: io::Error,
    },
    /// An invalid parameter file.
    #[error(transparent)]
    Parameters(#[from] ParameterProblems),
    /// An unknown parameter.
    #[error("unknown parameter {}. {}", excerpt(path), did_you_mean(nearest.as_deref(), "`stickslip params describe` lists all \
        parameters."))]
    UnknownParameter {
        /// The requested path.
        path: String,
        /// The most similar known path.
        nearest: Option<String>,
    },
    /// An unknown preset, which is not the path of a file either.
    #[error("unknown preset {}. {} A path to a file is accepted, too.", excerpt(name),
        did_you_mean(*nearest, &format!("Presets: {}.", known.join(", "))))]
    UnknownPreset {
        /// The requested name.
        name: String,
        /// The most similar known name.
        nearest: Option<&'static str>,
        /// All names.
        known: Vec<&'static str>,
    },
    /// A point that is not valid for a fit.
    #[error("point {} of the friction curve: {field} = {value:?}. {remedy}", index + 1)]
    CurvePoint {
        /// Index, from 0.
        index: usize,
        /// `velocity`, `torque` or `standard_error`.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The remedy.
        remedy: &'static str,
    },
    /// Too few values for a computation.
    #[error("too few {what}: {found}; at least {needed} required. {remedy}")]
    TooFew {
        /// Name of the values, plural.
        what: &'static str,
        /// Available number.
        found: usize,
        /// Required number.
        needed: usize,
        /// The remedy.
        remedy: &'static str,
    },
    /// A low-pass above half the sampling rate.
    #[error(
        "a low-pass at {cutoff} Hz requires a sampling rate above twice that; the rate is {rate} Hz. Lower the cut-off."
    )]
    Cutoff {
        /// Cut-off frequency [Hz].
        cutoff: f64,
        /// Sampling rate [Hz].
        rate: f64,
    },
    /// An input of a design that is out of range.
    #[error("{name} = {value} {unit} is outside {minimum} … {maximum} {unit}. {remedy}")]
    OutOfRange {
        /// Name of the number, in words.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its SI unit.
        unit: &'static str,
        /// Smallest allowed value.
        minimum: f64,
        /// Largest allowed value.
        maximum: f64,
        /// The remedy.
        remedy: &'static str,
    },
    /// Matrices or lists of incompatible sizes.
    #[error("{what}: size {found}, expected {expected}. {remedy}")]
    Dimension {
        /// Name of the matrix or list.
        what: &'static str,
        /// Its size.
        found: usize,
        /// The size that matches the others.
        expected: usize,
        /// The remedy.
        remedy: &'static str,
    },
    /// A matrix or number with NaN or infinity.
    #[error(
        "{what} is not finite ({value}). Check the parameters that it is computed from, for example for a \
        division by zero."
    )]
    NotFinite {
        /// Name of the matrix or number.
        what: &'static str,
        /// The non-finite number.
        value: f64,
    },
    /// A computation on a linear system that has no solution.
    #[error("{what} cannot be computed. {remedy}")]
    NotSolvable {
        /// The requested result.
        what: &'static str,
        /// The remedy.
        remedy: &'static str,
    },
    /// A unit that is unknown or of another quantity.
    #[error("{}: unit \"{}\" is unknown or of another quantity. Use one of {known}.", excerpt(place), excerpt(unit))]
    Unit {
        /// Place of the unit.
        place: String,
        /// The unit.
        unit: String,
        /// The valid units.
        known: String,
    },
    /// A fault: the supervision has removed the torque.
    #[error("fault in cycle {cycle}: {reason}")]
    BenchFault {
        /// Number of the tick.
        cycle: u64,
        /// Measured value, limit and remedy.
        reason: String,
    },
    /// A request that the supervision refuses.
    #[error(transparent)]
    Refused(#[from] stickslip_software::supervise::Refusal),
    /// An experiment that requires the screw's zero.
    #[error("the bench is not homed: the screw's zero is unknown. Home it first.")]
    NotHomed,
    /// The user cancelled; the caller keeps the results up to then.
    #[error("cancelled")]
    Cancelled,
    /// An invalid recording, or an invalid column of it.
    #[error("{}: {}. {}", path.display(), message(fault), message(remedy))]
    Recording {
        /// The file.
        path: PathBuf,
        /// The cause.
        fault: String,
        /// The remedy.
        remedy: String,
    },
    /// A file that would be overwritten.
    #[error("{}: file exists. Add --force to replace it, or state another name with --out.", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// An invalid answer or value.
    #[error("{}: \"{}\" is not valid. {}", message(question), excerpt(answer), message(remedy))]
    Answer {
        /// The question, or the name of the value.
        question: String,
        /// The answer, or the value.
        answer: String,
        /// Valid answers.
        remedy: String,
    },
    /// A saved document with an error, or of an unknown kind.
    #[error("{}{}: {}. {remedy}", path.display(), place.map(|[line, column]| format!(":{line}:{column}")).unwrap_or_default(),
        message(reason))]
    Document {
        /// The file.
        path: PathBuf,
        /// Line and column of the error, from 1.
        place: Option<[usize; 2]>,
        /// The cause.
        reason: String,
        /// The remedy.
        remedy: &'static str,
    },
    /// A bench that cannot render.
    #[error(
        "{preset} has no load motor; rendering is not possible. Choose a preset with a torque constant in \
         plant.load_motor."
    )]
    NothingToRender {
        /// The preset.
        preset: String,
    },
    /// An unknown part of a benchmark.
    #[error("unknown {what} {}. Available: {}.", excerpt(name), known.join(", "))]
    NothingToCompare {
        /// Kind of the part.
        what: &'static str,
        /// The requested name.
        name: String,
        /// Available names.
        known: Vec<&'static str>,
    },
    /// An unknown name.
    #[error("there is no {what} {}. {}", excerpt(name), message(remedy))]
    Unknown {
        /// Kind of the name.
        what: &'static str,
        /// The requested name.
        name: String,
        /// Available names, or another remedy.
        remedy: String,
    },
    /// An error of one crate; [`of`](Self::of) returns its enum.
    #[error(transparent)]
    Of(Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// A failure to `action` ("read", "write", "create") a file or folder.
    pub fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        Error::File { path: path.into(), action, source }
    }

    /// The error of one crate, such as `DesignError`; `None` for all others.
    pub fn of<E: std::error::Error + 'static>(&self) -> Option<&E> {
        match self {
            Error::Of(error) => error.downcast_ref(),
            _ => None,
        }
    }
}

/// Remedy for an error of the operating system.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "Check the path: a part of it does not exist.",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "Choose another folder, or change its permissions."
        }
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => "A part of the path is a file; choose another.",
        io::ErrorKind::IsADirectory | io::ErrorKind::DirectoryNotEmpty => "It is a folder; choose another name.",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "The disk is full: make room, or choose another.",
        io::ErrorKind::InvalidData => "The file is not UTF-8 text; check that it is the right one.",
        _ => "Choose another folder, or remove the cause stated above.",
    }
}

/// The nearest known name as a question, or else the sentence `otherwise`.
pub fn did_you_mean(nearest: Option<&str>, otherwise: &str) -> String {
    nearest.map_or_else(|| otherwise.into(), |nearest| format!("Did you mean {nearest}?"))
}
