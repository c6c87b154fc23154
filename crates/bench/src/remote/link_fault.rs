//! Faults of a link that end a run.

use super::{Address, WAIT};

/// A fault of the link between software and machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LinkFault {
    /// A frame or its answer was lost.
    #[error(
        "no answer to frame {sequence} from {address} within {} s. Is `stickslip plant --io {address}` running there?",
        WAIT.as_secs()
    )]
    NoAnswer {
        /// Number of the frame.
        sequence: u64,
        /// Address of the machine.
        address: Address,
    },
    /// An answer arrived twice.
    #[error(
        "the answer to frame {sequence} arrived twice. A link that duplicates frames is not usable for control; \
        use another link."
    )]
    Doubled {
        /// Number of the frame.
        sequence: u64,
    },
    /// An answer to another frame arrived.
    #[error(
        "the answer to frame {sequence} arrived instead of that to frame {due}: it is late, or an answer was \
        lost."
    )]
    OutOfOrder {
        /// Number of the answered frame.
        sequence: u64,
        /// Expected number.
        due: u64,
    },
    /// An answer cannot be read.
    #[error("an answer from {address} is damaged: {reason}. Check whether another program uses this address.")]
    FrameError {
        /// Address of the machine.
        address: Address,
        /// The problem.
        reason: String,
    },
    /// The machine refuses a request.
    #[error("the machine refuses: {reason}.")]
    Refused {
        /// Reason.
        reason: String,
    },
    /// Drives on a fieldbus, which the calling command does not support.
    #[error("{address}: drives on EtherCAT need a bench in real time, `ClockedBench::connect`.")]
    Fieldbus {
        /// Address of the drives.
        address: Address,
    },
    /// The operating system refuses.
    #[error("{address}: {reason}. Is `stickslip plant --io {address}` running there?")]
    System {
        /// Address of the machine.
        address: Address,
        /// Message of the system.
        reason: String,
    },
}
