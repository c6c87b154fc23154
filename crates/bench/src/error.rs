//! Errors of a bench.

use std::path::PathBuf;

use stickslip_software::supervise::Fault;

/// Errors of a bench, in addition to the common errors.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The first state of a record does not match the bench of its preset.
    #[error("the initial state of the record does not fit its preset. Use the unmodified record.")]
    RecordState,
    /// No step to undo or redo.
    #[error("there is nothing to {what}.")]
    NothingToUndo {
        /// The requested action.
        what: &'static str,
    },
    /// A parameter that cannot be changed while the bench runs.
    #[error("{path} cannot be changed while the bench runs. {remedy}")]
    NotWhileRunning {
        /// The parameter.
        path: String,
        /// Remedy.
        remedy: String,
    },
    /// A file that cannot be loaded as external controller, friction or law.
    #[error("{}: {problem}.", path.display())]
    External {
        /// The file.
        path: PathBuf,
        /// Problem and remedy.
        problem: String,
    },
    /// A value outside the range of an external parameter.
    #[error("{name} = {value} {unit} is outside {minimum} … {maximum} {unit}. Choose a value within.")]
    ForeignValue {
        /// Name of the parameter.
        name: String,
        /// The value.
        value: f64,
        /// Unit of the parameter.
        unit: String,
        /// Smallest value.
        minimum: f64,
        /// Largest value.
        maximum: f64,
    },
    /// A sampling time too short for an external controller in a separate process.
    #[error(
        "the position controller runs in every tick of {tick_rate} Hz. In real time, the torque of a controller in a \
         separate process is read one tick before it becomes active. Increase bench.control_divider to 2 or more, or run \
         the controller in this process (--trust)."
    )]
    ForeignRate {
        /// Ticks a second [Hz].
        tick_rate: f64,
    },
    /// The external controller, friction or law does not start.
    #[error("{0}")]
    ExternalNotStarted(Fault),
    /// A law that compensates the external friction.
    #[error(
        "the admittance law cannot be used with an external friction: its reference load is not subject to that \
         friction. Choose another law (bench.law.kind = \"residual\")."
    )]
    FollowsNoFriction,
    /// An unknown or invalid injected fault.
    #[error("invalid fault \"{fault}\". {remedy}")]
    Injection {
        /// The requested fault.
        fault: String,
        /// Available faults.
        remedy: String,
    },
    /// Servo drives, with a bench for an amplifier that takes a voltage.
    #[error(
        "servo drives take a torque, but bench.torque_amplifier is not set. Use --set bench.torque_amplifier=true: the \
         drive's own current control then replaces that of the bench."
    )]
    VoltageAmplifier,
    /// A machine on EtherCAT, in a program or for a command without a main device.
    #[error("ethercat:{interface}: {reason}")]
    Fieldbus {
        /// The interface.
        interface: String,
        /// Cause and remedy.
        reason: String,
    },
    /// A cycle that cannot run in real time.
    #[error(transparent)]
    RealTime(#[from] stickslip_rt::PlanError),
}

impl BenchError {
    /// The program has no main device for this interface.
    pub fn without_main_device(interface: &str) -> Self {
        let reason = "this program was built without the EtherCAT main device. Install it with \
            `cargo install --path crates/app --features ethercat`, on Linux.";
        BenchError::Fieldbus { interface: interface.into(), reason: reason.into() }
    }
}

impl From<BenchError> for stickslip_base::Error {
    fn from(error: BenchError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
