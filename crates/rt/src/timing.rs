//! Timing records of the cycles.

use rtrb::{Consumer, Producer, RingBuffer};

use crate::cause::Overrun;
use crate::clock::Nanoseconds;
use crate::cycle::{Block, MAX_BLOCKS, short};

/// Timing of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Number of the cycle.
    pub cycle: u64,
    /// From its deadline to its wake-up [ns].
    pub lateness: u32,
    /// From its wake-up to the end of its work [ns]; 0 if it woke too late to begin.
    pub total: u32,
    /// Duration of each block [ns], in their order.
    pub blocks: [u32; MAX_BLOCKS],
    /// Missed cycles since the last record.
    pub missed: u32,
    /// Records lost since the last stored one.
    pub lost: u32,
    /// Missed deadline with its cause.
    pub overrun: Option<Overrun>,
}

impl Timing {
    /// Timing of a cycle at its start.
    pub(crate) fn start(cycle: u64, late: Nanoseconds) -> Self {
        Timing { cycle, lateness: short(late), total: 0, blocks: [0; MAX_BLOCKS], missed: 0, lost: 0, overrun: None }
    }
}

/// Writing end of the ring of records.
pub(crate) struct Outlet {
    ring: Producer<Timing>,
    /// Not reported in a record yet.
    missed: u32,
    lost: u32,
    /// Since the start.
    pub(crate) total_lost: u64,
}

/// The records of an executive, oldest first. A slow reader loses records; the loss is counted in the next record.
pub struct Timings {
    ring: Consumer<Timing>,
    blocks: Vec<Block>,
}

/// A ring for `records` records.
pub(crate) fn ring(records: usize, blocks: &[Block]) -> (Outlet, Timings) {
    let (producer, consumer) = RingBuffer::new(records);
    (Outlet { ring: producer, missed: 0, lost: 0, total_lost: 0 }, Timings { ring: consumer, blocks: blocks.to_vec() })
}

impl Outlet {
    /// Counts missed cycles.
    pub(crate) fn miss(&mut self, cycles: u64) {
        self.missed = self.missed.saturating_add(short(cycles));
    }

    /// Stores a record with the numbers missed and lost before it, or counts it as lost.
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
    /// Blocks of the records.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Whether the executive has ended. Remaining records can still be taken.
    pub fn is_closed(&self) -> bool {
        self.ring.is_abandoned()
    }
}

/// The available records; more may follow.
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
    fn lost_records_are_counted_exactly_in_the_next_record() {
        let (mut outlet, mut timings) = ring(3, &[]);
        for cycle in 0..10 {
            outlet.push(Timing::start(cycle, 0));
            outlet.miss(u64::from(cycle == 5));
        }
        let records: Vec<_> = timings.by_ref().map(|timing| (timing.cycle, timing.lost)).collect();
        assert_eq!(records, [(0, 0), (1, 0), (2, 0)]);
        outlet.miss(2);
        outlet.push(Timing::start(10, 0));
        outlet.push(Timing::start(11, 0));
        let records: Vec<_> = timings.by_ref().map(|timing| (timing.cycle, timing.missed, timing.lost)).collect();
        // Missed cycles counted in lost records are not lost.
        assert_eq!((records, outlet.total_lost), (vec![(10, 3, 7), (11, 0, 0)], 7));
        assert!(!timings.is_closed());
        drop(outlet);
        assert!(timings.is_closed());
    }
}
