//! What ends a run over a link.

use super::{Address, WAIT};

/// What happened to the link between software and machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LinkFault {
    /// A frame or its answer was lost.
    #[error(
        "no answer to frame {sequence} from {address} within {} s. Is `stickslip plant --io {address}` running there?",
        WAIT.as_secs()
    )]
    NoAnswer {
        /// Which.
        sequence: u64,
        /// The machine's.
        address: Address,
    },
    /// An answer came a second time.
    #[error("the answer to frame {sequence} came twice. A link that doubles frames controls nothing; use another.")]
    Doubled {
        /// Which.
        sequence: u64,
    },
    /// An answer came for another frame.
    #[error("the answer to frame {sequence} came where {due} was due: it is late, or one was lost.")]
    OutOfOrder {
        /// Whose answer.
        sequence: u64,
        /// Whose was due.
        due: u64,
    },
    /// An answer cannot be read.
    #[error("an answer from {address} is garbled: {reason}. Does something else talk there?")]
    FrameError {
        /// The machine's.
        address: Address,
        /// What is wrong with it.
        reason: String,
    },
    /// The machine does not do it.
    #[error("the machine refuses: {reason}.")]
    Refused {
        /// Why.
        reason: String,
    },
    /// The operating system refuses.
    #[error("{address}: {reason}. Is `stickslip plant --io {address}` running there?")]
    System {
        /// The machine's.
        address: Address,
        /// What it says.
        reason: String,
    },
}
