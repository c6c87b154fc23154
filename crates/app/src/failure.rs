//! What ends a command.

use std::io;
use std::path::PathBuf;

/// Exit code of a command that was cancelled.
pub(crate) const CANCELLED: u8 = 130;

/// Why a command did not do its work.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// The laboratory says what, where and how to mend it.
    #[error(transparent)]
    Lab(#[from] stickslip::Error),
    /// Several files were wrong; one message each.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<stickslip::Error>),
    /// Cancelled, with results so far.
    #[error("cancelled before its end; what was measured until then is in {}", .0.display())]
    Incomplete(PathBuf),
    /// A controller that was brought along ended its run.
    #[error("the bench stopped: {0}")]
    Stopped(String),
    /// A bench that is served, or should be.
    #[error("{0}")]
    Served(String),
    /// Standard output takes no more.
    #[error("standard output: cannot write it ({0}). Send it elsewhere, or make room.")]
    Output(#[from] io::Error),
}

impl Failure {
    /// The exit code: 130, as shells have it for Ctrl-C, where the user cancelled, else 1.
    pub(crate) fn code(&self) -> u8 {
        match self {
            Failure::Incomplete(_) | Failure::Lab(stickslip::Error::Cancelled) => CANCELLED,
            _ => 1,
        }
    }

    /// Whether the reader of a pipe has gone, which is its right.
    pub(crate) fn is_closed_pipe(&self) -> bool {
        matches!(self, Failure::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}
