//! What can go wrong, with what, where and how to mend it as fields; formatted at the edge.

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
    /// The user cancelled; results so far are kept by whoever has them.
    #[error("cancelled")]
    Cancelled,
}

impl Error {
    /// The system refused to `action` ("read", "write", "create") the file or folder.
    pub fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        Error::File { path: path.into(), action, source }
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

fn did_you_mean(nearest: Option<&str>, otherwise: &str) -> String {
    nearest.map_or_else(|| otherwise.into(), |nearest| format!("Did you mean {nearest}?"))
}
