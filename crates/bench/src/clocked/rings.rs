//! The rings between the experiment and the loop: entries go in, replies come back, in order and without a lock.

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_core::cycle::Change;

use super::cycle::{Entry, Reply};
use crate::external::ExternalInLoop;

/// Changes that may wait for their tick.
const CHANGES: usize = 32;

/// The ends of the experiment.
pub(super) struct BenchRings {
    pub(super) entries: Producer<Entry>,
    pub(super) changes: Producer<Change>,
    /// Guests on their way in, and those that come back.
    pub(super) guests: Producer<Box<ExternalInLoop>>,
    pub(super) gone: Consumer<Box<ExternalInLoop>>,
    pub(super) replies: Consumer<Reply>,
}

/// The ends of the loop.
pub(super) struct LoopRings {
    pub(super) entries: Consumer<Entry>,
    pub(super) changes: Consumer<Change>,
    /// The next guest, and the way back: what a guest has is freed by the experiment.
    pub(super) guests: Consumer<Box<ExternalInLoop>>,
    pub(super) gone: Producer<Box<ExternalInLoop>>,
    pub(super) replies: Producer<Reply>,
}

/// Both ends, with room for a lead of `lead` commands.
pub(super) fn rings(lead: usize) -> (BenchRings, LoopRings) {
    // Two leads, and all that may be kept behind them.
    let most = 2 * lead + 2 * CHANGES;
    let (entries, entries_out) = RingBuffer::new(most);
    let (changes, changes_out) = RingBuffer::new(CHANGES);
    let (guests, guests_out) = RingBuffer::new(1);
    let (gone_in, gone) = RingBuffer::new(2);
    // Each entry has one reply at most, and one more tells of a fault or of starving.
    let (replies_in, replies) = RingBuffer::new(2 * most);
    (
        BenchRings { entries, changes, guests, gone, replies },
        LoopRings {
            entries: entries_out,
            changes: changes_out,
            guests: guests_out,
            gone: gone_in,
            replies: replies_in,
        },
    )
}
