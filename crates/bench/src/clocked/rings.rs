//! Lock-free rings between the experiment and the loop: entries go in and replies come back, both in order.

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_software::cycle::Change;

use super::cycle::{Entry, Reply};
use crate::external::ExternalInLoop;

/// Capacity of the ring of changes.
const CHANGES: usize = 32;

/// Ends of the experiment.
pub(super) struct BenchRings {
    pub(super) entries: Producer<Entry>,
    pub(super) changes: Producer<Change>,
    /// External controllers for the loop, and removed ones.
    pub(super) externals: Producer<Box<ExternalInLoop>>,
    pub(super) returned: Consumer<Box<ExternalInLoop>>,
    pub(super) replies: Consumer<Reply>,
}

/// Ends of the loop.
pub(super) struct LoopRings {
    pub(super) entries: Consumer<Entry>,
    pub(super) changes: Consumer<Change>,
    /// The next external controller, and the removed one, which the experiment frees.
    pub(super) externals: Consumer<Box<ExternalInLoop>>,
    pub(super) returned: Producer<Box<ExternalInLoop>>,
    pub(super) replies: Producer<Reply>,
}

/// Both ends, with room for a lead of `lead` commands.
pub(super) fn rings(lead: usize) -> (BenchRings, LoopRings) {
    // Two leads and the staged entries after them.
    let most = 2 * lead + 2 * CHANGES;
    let (entries, entries_out) = RingBuffer::new(most);
    let (changes, changes_out) = RingBuffer::new(CHANGES);
    let (externals, externals_out) = RingBuffer::new(1);
    let (returned_in, returned) = RingBuffer::new(2);
    // Each entry has at most one reply, plus one for a fault or a missing command.
    let (replies_in, replies) = RingBuffer::new(2 * most);
    (
        BenchRings { entries, changes, externals, returned, replies },
        LoopRings {
            entries: entries_out,
            changes: changes_out,
            externals: externals_out,
            returned: returned_in,
            replies: replies_in,
        },
    )
}
