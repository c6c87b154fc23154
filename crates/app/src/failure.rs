//! Errors of a command and their exit codes.

use std::io;
use std::path::PathBuf;

/// Exit code of a command that was cancelled.
pub(crate) const CANCELLED: u8 = 130;

/// Error of a command.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// An error of the library: cause, place and remedy.
    #[error(transparent)]
    Lab(#[from] stickslip::Error),
    /// Errors in several files, one message each.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<stickslip::Error>),
    /// Cancelled; the folder has partial results.
    #[error("cancelled; partial results are in {}", .0.display())]
    Incomplete(PathBuf),
    /// An external controller, friction or law stopped the bench.
    #[error("the bench stopped: {0}")]
    Stopped(String),
    /// An error of the running bench or of the server.
    #[error("{0}")]
    Served(String),
    /// Standard output cannot be written.
    #[error("standard output: cannot write it ({0}). Redirect it, or free disk space.")]
    Output(#[from] io::Error),
}

impl Failure {
    /// The exit code: 130 if the user cancelled, as shells report Ctrl-C; otherwise 1.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Failure::Incomplete(_) | Failure::Lab(stickslip::Error::Cancelled) => CANCELLED,
            _ => 1,
        }
    }

    /// Whether the reader of a pipe has closed it. This is not reported as an error.
    pub(crate) fn is_closed_pipe(&self) -> bool {
        matches!(self, Failure::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}
