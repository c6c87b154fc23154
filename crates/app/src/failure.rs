//! What ends a command.

use std::io;

/// Why a command did not do its work.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Failure {
    /// The laboratory says what, where and how to mend it.
    #[error(transparent)]
    Lab(#[from] stickslip::Error),
    /// Several files were wrong; one message each.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<stickslip::Error>),
    /// Standard output takes no more.
    #[error("standard output: cannot write it ({0}). Send it elsewhere, or make room.")]
    Output(#[from] io::Error),
}

impl Failure {
    /// Whether the reader of a pipe has gone, which is its right.
    pub(crate) fn is_closed_pipe(&self) -> bool {
        matches!(self, Failure::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}
