//! What only a bench can fail of.

use std::path::PathBuf;

use stickslip_core::supervise::Fault;

/// A failure of a bench, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// A record whose first state is not one of the bench of its preset.
    #[error("the state that the record begins with does not fit its preset. Take the record as it was made.")]
    RecordState,
    /// No step back, or none forward.
    #[error("there is nothing to {what}.")]
    NothingToUndo {
        /// What was asked for.
        what: &'static str,
    },
    /// A parameter that a bench cannot change while it runs.
    #[error("{path} cannot be changed while the bench runs. {remedy}")]
    NotWhileRunning {
        /// The parameter.
        path: String,
        /// What to do.
        remedy: String,
    },
    /// A file that is nothing for the loop.
    #[error("{}: {problem}.", path.display())]
    External {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        problem: String,
    },
    /// A value that what was brought along does not admit.
    #[error("{name} = {value} {unit} is outside {minimum} … {maximum} {unit}. Choose a value within.")]
    ForeignValue {
        /// Its parameter.
        name: String,
        /// As given.
        value: f64,
        /// Its unit.
        unit: String,
        /// Smallest value.
        minimum: f64,
        /// Largest value.
        maximum: f64,
    },
    /// Samples that leave a controller which was brought along no time.
    #[error(
        "the position controller runs in every tick of {tick_rate} Hz, and by the clock the torque of one in a process of \
         its own is taken a tick before it comes into force. Let a sample have two ticks or more (bench.control_divider), \
         or trust it (--trust)."
    )]
    ForeignRate {
        /// Ticks a second [Hz].
        tick_rate: f64,
    },
    /// What was brought along does not begin.
    #[error("{0}")]
    ExternalTorques(Fault),
    /// A law that renders the friction of a file away.
    #[error(
        "the admittance law makes the load follow one that does not feel the friction of a file. Choose another law beside \
         it (bench.law.kind = \"residual\")."
    )]
    FollowsNoFriction,
    /// A fault on purpose that there is not.
    #[error("no fault \"{fault}\". {remedy}")]
    Injection {
        /// What was asked for.
        fault: String,
        /// What can be injected, and where.
        remedy: String,
    },
    /// A cycle that cannot run in real time.
    #[error(transparent)]
    RealTime(#[from] stickslip_rt::PlanError),
}

impl From<BenchError> for stickslip_base::Error {
    fn from(error: BenchError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
