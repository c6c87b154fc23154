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
    /// A step that an integrator cannot take without becoming wrong.
    #[error("a {scheme} step of {step:?} s is beyond the bound of {largest:.2e} s. {remedy}")]
    StepTooLarge {
        /// Which scheme.
        scheme: &'static str,
        /// Asked for [s].
        step: f64,
        /// The bound [s].
        largest: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// The user cancelled; results so far are kept by whoever has them.
    #[error("cancelled")]
    Cancelled,
}
