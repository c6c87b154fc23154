//! Errors that every crate can return: cause, place and remedy as fields; formatted at the edge.
//!
//! Each crate above has an enum of what only it can fail of. It converts into [`Error::Of`]; [`Error::of`] finds it again.

use std::io;
use std::path::{Path, PathBuf};

use crate::parameters::ParameterProblems;

/// Any failure of the laboratory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused a file.
    #[error("{}: cannot {action} it ({source}). {}", path.display(), remedy(source))]
    File {
        /// Which file.
        path: PathBuf,
        /// What was tried: "read", "write".
        action: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// Something is wrong with a parameter file.
    #[error(transparent)]
    Parameters(#[from] ParameterProblems),
    /// There is no parameter at this path.
    #[error("{path} is no parameter. {}", did_you_mean(nearest.as_deref(), "`stickslip params describe` lists them all."))]
    UnknownParameter {
        /// The path asked for.
        path: String,
        /// The known path most like it.
        nearest: Option<String>,
    },
    /// There is no preset of this name, and it is no file.
    #[error("{name} is no preset. {} A path to a file will do, too.",
        did_you_mean(*nearest, &format!("There are: {}.", known.join(", "))))]
    UnknownPreset {
        /// The name asked for.
        name: String,
        /// The known name most like it.
        nearest: Option<&'static str>,
        /// All names.
        known: Vec<&'static str>,
    },
    /// A point that no curve can be fitted through.
    #[error("point {index} of the friction curve: {field} = {value}. {remedy}")]
    CurvePoint {
        /// Counted from 0.
        index: usize,
        /// `velocity`, `torque` or `standard_error`.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// Not enough of something for what was asked.
    #[error("{found} {what}, {needed} are needed. {remedy}")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        needed: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// A low-pass that the sampling rate does not allow.
    #[error(
        "a low-pass at {cutoff} Hz needs a sampling rate above twice that, and there are {rate} Hz. Lower the cut-off."
    )]
    Cutoff {
        /// Asked for [Hz].
        cutoff: f64,
        /// Sampling rate [Hz].
        rate: f64,
    },
    /// A number that a design starts from makes no sense.
    #[error("{name} = {value} {unit} is outside {minimum} … {maximum} {unit}. {remedy}")]
    OutOfRange {
        /// What the number is, in words.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its SI unit.
        unit: &'static str,
        /// Smallest allowed value.
        minimum: f64,
        /// Largest allowed value.
        maximum: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// Matrices or lists that do not fit each other.
    #[error("{what} has {found} where {expected} belong. {remedy}")]
    Dimension {
        /// Which one.
        what: &'static str,
        /// Its size.
        found: usize,
        /// The size that the others ask for.
        expected: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// A matrix with NaN or infinity.
    #[error("{what} contains {value}. Look where the number comes from: a parameter that was divided by zero?")]
    NotFinite {
        /// Which matrix.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A computation on a linear system that has no answer.
    #[error("{what} cannot be computed. {remedy}")]
    NotSolvable {
        /// What was asked for.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A unit that is unknown or measures something else.
    #[error("{place}: unit \"{unit}\" does not fit. Use one of {known}.")]
    Unit {
        /// Whose unit.
        place: String,
        /// As given.
        unit: String,
        /// What would do.
        known: String,
    },
    /// Supervision has taken the torque away.
    #[error("fault in cycle {cycle}: {reason}")]
    BenchFault {
        /// In which tick.
        cycle: u64,
        /// What was measured, what is allowed, what to do.
        reason: String,
    },
    /// Supervision does not admit what was asked for.
    #[error(transparent)]
    Refused(#[from] stickslip_core::supervise::Refusal),
    /// An experiment that needs the screw's zero.
    #[error("the bench is not homed: the screw's zero is unknown. Home it first.")]
    NotHomed,
    /// The user cancelled; results so far are kept by whoever has them.
    #[error("cancelled")]
    Cancelled,
    /// A recording, or a column of it, that cannot be what it is taken for.
    #[error("{}: {fault}. {remedy}", path.display())]
    Recording {
        /// Which file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
        /// What to do.
        remedy: String,
    },
    /// A file that would be overwritten.
    #[error("{}: it exists already. Add --force to replace it, or give another name with --out.", path.display())]
    Exists {
        /// Which file.
        path: PathBuf,
    },
    /// An answer that is none.
    #[error("{question}: \"{answer}\" is no answer. {remedy}")]
    Answer {
        /// What was asked.
        question: String,
        /// What was said.
        answer: String,
        /// What can be said.
        remedy: String,
    },
    /// A saved document that is not one, or not of a kind that is understood here.
    #[error("{}{}: {reason}. {remedy}", path.display(), place.map(|[line, column]| format!(":{line}:{column}")).unwrap_or_default())]
    Document {
        /// Which file.
        path: PathBuf,
        /// Line and column, counted from 1, where the text breaks off.
        place: Option<[usize; 2]>,
        /// What is wrong.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A bench that cannot render.
    #[error(
        "{preset} has no load motor, so that nothing can be rendered. Take a preset whose plant.load_motor has a torque constant."
    )]
    NothingToRender {
        /// The preset.
        preset: String,
    },
    /// A part of a benchmark that there is not.
    #[error("{name} is no {what}. There are: {}.", known.join(", "))]
    NothingToCompare {
        /// What it should be.
        what: &'static str,
        /// The name asked for.
        name: String,
        /// Those that there are.
        known: Vec<&'static str>,
    },
    /// There is nothing of this name.
    #[error("there is no {what} {name}. {remedy}")]
    Unknown {
        /// Of what kind.
        what: &'static str,
        /// The name asked for.
        name: String,
        /// What there is.
        remedy: String,
    },
    /// A failure of one subject; [`of`](Self::of) gives its own enum.
    #[error(transparent)]
    Of(Box<dyn std::error::Error + Send + Sync>),
}

impl Error {
    /// The system refused to `action` ("read", "write", "create") the file or folder.
    pub fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        Error::File { path: path.into(), action, source }
    }

    /// The failure as one of a subject, such as `DesignError`; `None` if it is another.
    pub fn of<E: std::error::Error + 'static>(&self) -> Option<&E> {
        match self {
            Error::Of(error) => error.downcast_ref(),
            _ => None,
        }
    }
}

/// What to do about a refusal of the system.
fn remedy(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "Check the path: a part of it does not exist.",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "Choose another place, or get the right."
        }
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => "A part of the path is a file; choose another.",
        io::ErrorKind::IsADirectory | io::ErrorKind::DirectoryNotEmpty => "It is a folder; choose another name.",
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "The disk is full: make room, or choose another.",
        io::ErrorKind::InvalidData => "It is no text in UTF-8; is it the right file?",
        _ => "Choose another place, or mend what the system says.",
    }
}

/// The nearest known name as a question, or another sentence where none is near.
pub fn did_you_mean(nearest: Option<&str>, otherwise: &str) -> String {
    nearest.map_or_else(|| otherwise.into(), |nearest| format!("Did you mean {nearest}?"))
}
