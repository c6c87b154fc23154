//! Why a cycle missed its deadline.
//!
//! The cause is the part that exceeds its typical time most: the wake-up or a block. For a block, the counters of the
//! system since a moment shortly before ([`Evidence`]) distinguish computation, waiting, preemption and page faults.

use std::fmt;

use crate::clock::Nanoseconds;
use crate::cycle::{Block, MAX_BLOCKS};

/// Assumed upper limit of the duration of a page fault without disk access [ns]. Page faults are the cause if they
/// explain half of the excess; a few stray ones are not. The limit is many times the duration for a page of 4 KiB and
/// less than that for 2 MiB: with automatic huge pages, page faults may be reported as a slow block.
const FAULT: Nanoseconds = 10_000;

/// A missed deadline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overrun {
    /// Number of the cycle.
    pub cycle: u64,
    /// From its deadline to its wake-up [ns].
    pub late: Nanoseconds,
    /// From the next deadline to the end of its work [ns]; for a cycle that woke too late to begin, from its own
    /// deadline to its wake-up.
    pub by: Nanoseconds,
    /// Cause.
    pub cause: Cause,
    /// Counters of the system; `None` on systems without them.
    pub evidence: Option<Evidence>,
}

/// Cause of a missed deadline. Blocks by their index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Cause {
    /// The thread woke up late: a thread of higher priority ran, the timer was late, or the machine paused.
    LateWakeUp,
    /// The block computed longer than usual. A pause of the machine below the operating system looks the same.
    Block(usize),
    /// The block waited for a lock, a sleep or a device, which is not permitted.
    Wait(usize),
    /// The block waited for its device.
    Io(usize),
    /// The block touched memory that was not resident.
    PageFault {
        /// Pages provided without disk access.
        minor: u32,
        /// Pages read from disk.
        major: u32,
        /// The block.
        block: usize,
    },
    /// Another thread took the CPU.
    Preempted {
        /// The block.
        block: usize,
    },
}

/// Counters of the system from a moment shortly before the overrun to its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Evidence {
    /// Number of sleeps between the start of the count and the cycle.
    pub cycles: u32,
    /// Pages provided without disk access.
    pub minor_faults: u32,
    /// Pages read from disk.
    pub major_faults: u32,
    /// Number of preemptions by other threads.
    pub preemptions: u32,
    /// Lower bound of the number of waits other than for the next cycle.
    pub waits: u32,
    /// Time during the cycle in which the thread was not on a CPU [ns].
    pub off_cpu: u32,
}

/// Times of a cycle: lateness of its wake-up, duration of its blocks [ns].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Parts {
    pub(crate) lateness: u32,
    pub(crate) blocks: [u32; MAX_BLOCKS],
}

/// Duration of the parts of a cycle that met its deadline: a moving average.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TypicalCycle(Option<Parts>);

impl TypicalCycle {
    /// Includes a cycle that met its deadline.
    pub(crate) fn learn(&mut self, parts: &Parts) {
        let mean = self.0.get_or_insert(*parts);
        let follow = |mean: &mut u32, value: u32| {
            *mean = (i64::from(*mean) + (i64::from(value) - i64::from(*mean)) / 16) as u32;
        };
        follow(&mut mean.lateness, parts.lateness);
        mean.blocks.iter_mut().zip(parts.blocks).for_each(|(mean, value)| follow(mean, value));
    }

    /// The cause of a missed deadline.
    pub(crate) fn cause(&self, parts: &Parts, blocks: &[bool; MAX_BLOCKS], evidence: Option<Evidence>) -> Cause {
        let typical = self.0.unwrap_or_default();
        let late = parts.lateness.saturating_sub(typical.lateness);
        let (mut block, mut excess) = (0, 0);
        for index in 0..MAX_BLOCKS {
            let more = parts.blocks[index].saturating_sub(typical.blocks[index]);
            if more > excess {
                (block, excess) = (index, more);
            }
        }
        if late > excess {
            return Cause::LateWakeUp;
        }
        let io = blocks[block];
        let computed = if io { Cause::Io(block) } else { Cause::Block(block) };
        let Some(counts) = evidence else { return computed };
        let page_fault = Cause::PageFault { minor: counts.minor_faults, major: counts.major_faults, block };
        let off_cpu = counts.off_cpu > excess / 2;
        match counts {
            _ if off_cpu && counts.major_faults > 0 => page_fault,
            _ if off_cpu && counts.waits > 0 => {
                if io {
                    Cause::Io(block)
                } else {
                    Cause::Wait(block)
                }
            }
            _ if off_cpu && counts.preemptions > 0 => Cause::Preempted { block },
            _ if u64::from(counts.minor_faults) * FAULT >= u64::from(excess / 2).max(1) => page_fault,
            _ => computed,
        }
    }
}

impl Overrun {
    /// Description of the overrun in one sentence, with the names of the blocks.
    pub fn sentence(&self, blocks: &[Block]) -> String {
        let by = Time(self.by);
        let name = |index: usize| blocks.get(index).map_or("cycle", |block| block.name);
        let start = format!("Cycle {} was {by} too late: ", self.cycle);
        let why = match self.cause {
            Cause::LateWakeUp => format!(
                "its thread was woken {} after the deadline. Possible causes: a thread of higher priority, a late \
                 timer, a paused machine.",
                Time(self.late)
            ),
            Cause::Block(block) => format!("the block \"{}\" computed longer than usual.", name(block)),
            Cause::Wait(block) => {
                format!(
                    "the block \"{}\" waited for a lock, a sleep or a device that is not marked as I/O.",
                    name(block)
                )
            }
            Cause::Io(block) => format!("the block \"{}\" waited for its device.", name(block)),
            Cause::PageFault { minor, major, block } => format!(
                "the block \"{}\" touched memory that was not resident ({minor} pages, {major} more from disk). \
                 Allocate and touch it before the start, and lock the memory.",
                name(block)
            ),
            Cause::Preempted { block } => {
                format!(
                    "another thread took the CPU during the block \"{}\". Raise the priority, or move the other \
                     thread to another CPU.",
                    name(block)
                )
            }
        };
        start + &why
    }
}

/// A duration in µs or ms.
struct Time(Nanoseconds);

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let micros = self.0 as f64 * 1e-3;
        if micros < 1e4 { write!(f, "{micros:.1} µs") } else { write!(f, "{:.1} ms", micros * 1e-3) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u32 = 1_000_000;
    const IO: [bool; MAX_BLOCKS] = {
        let mut io = [false; MAX_BLOCKS];
        io[2] = true;
        io
    };

    fn parts(lateness: u32, blocks: [u32; 3]) -> Parts {
        let mut parts = Parts { lateness, ..Parts::default() };
        parts.blocks[..3].copy_from_slice(&blocks);
        parts
    }

    fn cause(bad: Parts, evidence: Option<Evidence>) -> Cause {
        let mut typical = TypicalCycle::default();
        typical.learn(&parts(5000, [20_000, 150_000, 30_000]));
        typical.cause(&bad, &IO, evidence)
    }

    #[test]
    fn the_cause_is_the_part_that_exceeds_its_typical_time_most() {
        assert_eq!(cause(parts(3 * MS, [20_000, 160_000, 30_000]), None), Cause::LateWakeUp);
        // The second block is the longest, as always.
        assert_eq!(cause(parts(5000, [90_000, 155_000, 30_000]), None), Cause::Block(0));
        assert_eq!(cause(parts(5000, [20_000, 150_000, 230_000]), None), Cause::Io(2));
    }

    #[test]
    fn the_counters_of_the_system_distinguish_the_causes_of_a_slow_block() {
        let slow = |block: usize| {
            let mut times = [20_000, 150_000, 30_000];
            times[block] = 30 * MS;
            parts(5000, times)
        };
        let on = Evidence { cycles: 40, ..Evidence::default() };
        let off = Evidence { off_cpu: 29 * MS, ..on };
        for (block, evidence, expected) in [
            (0, on, Cause::Block(0)),
            (2, on, Cause::Io(2)),
            (0, Evidence { waits: 1, preemptions: 1, ..off }, Cause::Wait(0)),
            (2, Evidence { waits: 1, preemptions: 1, ..off }, Cause::Io(2)),
            (2, Evidence { preemptions: 1, ..off }, Cause::Preempted { block: 2 }),
            (1, Evidence { preemptions: 1, ..off }, Cause::Preempted { block: 1 }),
            // One short preemption.
            (1, Evidence { preemptions: 1, off_cpu: MS, ..on }, Cause::Block(1)),
            (1, Evidence { minor_faults: 9000, ..on }, Cause::PageFault { minor: 9000, major: 0, block: 1 }),
            (1, Evidence { major_faults: 2, waits: 2, ..off }, Cause::PageFault { minor: 0, major: 2, block: 1 }),
            // A few pages do not take 30 ms.
            (1, Evidence { minor_faults: 3, ..on }, Cause::Block(1)),
        ] {
            assert_eq!(cause(slow(block), Some(evidence)), expected, "{evidence:?}");
        }
    }

    #[test]
    fn the_typical_cycle_follows_the_cycles_that_met_their_deadlines() {
        let mut typical = TypicalCycle::default();
        for _ in 0..200 {
            typical.learn(&parts(0, [0, 80_000, 0]));
        }
        // Now the second block is short and the first one long.
        for _ in 0..200 {
            typical.learn(&parts(0, [80_000, 0, 0]));
        }
        assert_eq!(typical.cause(&parts(0, [90_000, 60_000, 0]), &IO, None), Cause::Block(1));
    }

    #[test]
    fn the_sentence_names_block_cause_and_remedy() {
        let overrun = |cause| Overrun { cycle: 812, late: 6000, by: 1_250_000, cause, evidence: None };
        let blocks = [Block::io("read"), Block::new("law")];
        assert_eq!(
            overrun(Cause::Block(1)).sentence(&blocks),
            "Cycle 812 was 1250.0 µs too late: the block \"law\" computed longer than usual."
        );
        let sentence = overrun(Cause::PageFault { minor: 7, major: 0, block: 0 }).sentence(&blocks);
        assert!(sentence.contains("\"read\" touched memory that was not resident (7 pages"), "{sentence}");
    }
}
