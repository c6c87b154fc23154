//! Errors of a running bench.

use std::path::PathBuf;

use stickslip_software::supervise::Role;

/// An error of a running bench, in addition to those of `stickslip_base`.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LiveError {
    /// Another client is the operator.
    #[error(
        "{by} is the operator. Wait until {by} has been silent for 10 s, or become the operator: `stickslip bench operate`."
    )]
    Operated {
        /// Name of the operator.
        by: String,
    },
    /// A running activity excludes the requested one.
    #[error("{what} is running. {remedy}")]
    Busy {
        /// The running activity.
        what: String,
        /// How to wait for it or end it.
        remedy: &'static str,
    },
    /// The axis has no torque.
    #[error("the axis has no torque. Home it, or switch the torque on.")]
    NoTorque,
    /// A jog that cannot start or continue.
    #[error("{reason}: the axis comes to rest. Release all buttons and press one again.")]
    Jog {
        /// The reason.
        reason: &'static str,
    },
    /// No activity of that kind runs.
    #[error("no {what} is running: nothing to end.")]
    NothingToEnd {
        /// The kind of activity.
        what: &'static str,
    },
    /// The catalogue of runs cannot be read or changed. The runs themselves are unchanged.
    #[error("{}: {fault}. {remedy}", path.display())]
    Catalogue {
        /// File of the catalogue.
        path: PathBuf,
        /// The fault.
        fault: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// A file of the project's state cannot be used. The bench runs with the preset.
    #[error(
        "{}: {fault}. The bench was started with the preset. Correct the file or delete it; the next change of a parameter \
         preserves it as target-before.json.",
        path.display()
    )]
    State {
        /// The file.
        path: PathBuf,
        /// The fault.
        fault: String,
    },
    /// The catalogue has no run of this number.
    #[error("there is no run {number}. `stickslip runs` lists them.")]
    NoRun {
        /// The requested number.
        number: i64,
    },
    /// The files of a run are not available.
    #[error("run {number}: {how}. {remedy}")]
    RunGone {
        /// Its number.
        number: i64,
        /// Why.
        how: &'static str,
        /// Remedy.
        remedy: &'static str,
    },
    /// An invalid name or tag of a run.
    #[error("{text:?} is not a valid name or tag of a run. {remedy}")]
    RunText {
        /// The rejected text.
        text: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// No external file is loaded.
    #[error(
        "no external file is loaded. Start the bench with one: stickslip serve --controller FILE, --friction FILE or --law FILE."
    )]
    NothingLoaded,
    /// A loaded external rejects values of its parameters.
    #[error(
        "{name} rejects these parameter values (return code {code}) and keeps the previous ones. Choose other values; see \
         the documentation of {name}."
    )]
    ForeignRefuses {
        /// Name of the external.
        name: String,
        /// Return code of its function.
        code: i32,
    },
    /// A loaded friction or law renders instead of the desired friction of the parameters.
    #[error(
        "the loaded {role} is active: it does not render the desired friction of the parameters. Measure it with \
         stickslip load FILE --as {role}, or select the preset's ({selector} = preset)."
    )]
    RendersItself {
        /// Role of the file.
        role: Role,
        /// The parameter that selects it.
        selector: &'static str,
    },
}

impl From<LiveError> for stickslip_base::Error {
    fn from(error: LiveError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
