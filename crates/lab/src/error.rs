//! What can go wrong, with what, where and how to mend it as fields; formatted at the edge.

use std::path::PathBuf;

/// Any failure of the laboratory.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused a file.
    #[error("{}: cannot {action} it ({source})", path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What was tried: "read", "write".
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The user cancelled; results so far are kept by whoever has them.
    #[error("cancelled")]
    Cancelled,
}
