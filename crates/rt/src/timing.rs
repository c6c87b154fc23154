//! What is known of each cycle afterwards.

use rtrb::{Consumer, Producer, RingBuffer};

use crate::cause::Overrun;
use crate::clock::Nanoseconds;
use crate::cycle::{Block, MAX_BLOCKS, short};

/// When a cycle ran, and for how long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Its number.
    pub cycle: u64,
    /// From its deadline to its wake-up [ns].
    pub lateness: u32,
    /// From its wake-up to the end of its work [ns]; 0 where it was woken too late to begin.
    pub total: u32,
    /// Time of each block [ns], in their order.
    pub blocks: [u32; MAX_BLOCKS],
    /// Cycles that were held since the last record.
    pub missed: u32,
    /// Records that found no room since the last one that did.
    pub lost: u32,
    /// It missed its deadline, and why.
    pub overrun: Option<Overrun>,
}

impl Timing {
    /// Of a cycle that has just begun.
    pub(crate) fn begun(cycle: u64, late: Nanoseconds) -> Self {
        Timing { cycle, lateness: short(late), total: 0, blocks: [0; MAX_BLOCKS], missed: 0, lost: 0, overrun: None }
    }
}

/// Where the executive leaves its records.
pub(crate) struct Outlet {
    ring: Producer<Timing>,
    /// Not told yet.
    missed: u32,
    lost: u32,
    /// Ever.
    pub(crate) total_lost: u64,
}

/// The records of an executive, oldest first. Whoever takes them too slowly loses some; each loss is counted in the
/// next record.
pub struct Timings {
    ring: Consumer<Timing>,
    blocks: Vec<Block>,
}

/// A ring for so many records.
pub(crate) fn ring(records: usize, blocks: &[Block]) -> (Outlet, Timings) {
    let (producer, consumer) = RingBuffer::new(records);
    (Outlet { ring: producer, missed: 0, lost: 0, total_lost: 0 }, Timings { ring: consumer, blocks: blocks.to_vec() })
}

impl Outlet {
    /// So many cycles are held.
    pub(crate) fn miss(&mut self, cycles: u64) {
        self.missed = self.missed.saturating_add(short(cycles));
    }

    /// Leaves a record, with what was missed and lost before it, or counts it.
    pub(crate) fn push(&mut self, timing: Timing) {
        let timing = Timing { missed: self.missed, lost: self.lost, ..timing };
        if self.ring.push(timing).is_ok() {
            (self.missed, self.lost) = (0, 0);
        } else {
            self.lost = self.lost.saturating_add(1);
            self.total_lost += 1;
        }
    }
}

impl Timings {
    /// The blocks that the records tell of.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Whether the executive that wrote them has gone. What is still there can be taken.
    pub fn is_closed(&self) -> bool {
        self.ring.is_abandoned()
    }
}

/// The records that are there; more may come.
impl Iterator for Timings {
    type Item = Timing;

    fn next(&mut self) -> Option<Timing> {
        self.ring.pop().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lost_is_counted_in_the_next_record_exactly() {
        let (mut outlet, mut timings) = ring(3, &[]);
        for cycle in 0..10 {
            outlet.push(Timing::begun(cycle, 0));
            outlet.miss(u64::from(cycle == 5));
        }
        let kept: Vec<_> = timings.by_ref().map(|timing| (timing.cycle, timing.lost)).collect();
        assert_eq!(kept, [(0, 0), (1, 0), (2, 0)]);
        outlet.miss(2);
        outlet.push(Timing::begun(10, 0));
        outlet.push(Timing::begun(11, 0));
        let kept: Vec<_> = timings.by_ref().map(|timing| (timing.cycle, timing.missed, timing.lost)).collect();
        // What the lost records would have told of missed cycles is not lost with them.
        assert_eq!((kept, outlet.total_lost), (vec![(10, 3, 7), (11, 0, 0)], 7));
        assert!(!timings.is_closed());
        drop(outlet);
        assert!(timings.is_closed());
    }
}
