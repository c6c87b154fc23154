//! Why a cycle missed its deadline.
//!
//! The part that exceeds its usual time most is guilty: the wake-up or a block. If a block, what the system has counted
//! since a moment shortly before ([`Evidence`]) says whether it computed, waited, was interrupted, or met pages that
//! were not there.

use std::fmt;

use crate::clock::Nanoseconds;
use crate::cycle::{Block, MAX_BLOCKS};

/// So much a page fault without a disk is believed to take at most [ns]: enough of them to explain half of the excess
/// are its cause, a few stray ones are not. Many times what a page of 4 KiB takes, and less than one of 2 MiB does: where
/// the system gives huge pages unasked, faults may pass for a slow block.
const FAULT: Nanoseconds = 10_000;

/// A missed deadline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overrun {
    /// The cycle.
    pub cycle: u64,
    /// From its deadline to its wake-up [ns].
    pub late: Nanoseconds,
    /// From the next deadline to the end of its work, or, where it woke too late to begin, from its own to its wake-up
    /// [ns].
    pub by: Nanoseconds,
    /// Why.
    pub cause: Cause,
    /// What the system had counted; `None` where it does not.
    pub evidence: Option<Evidence>,
}

/// Why a cycle missed its deadline. Blocks by their index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Cause {
    /// The thread was woken late: something above it ran, the timer came late, or the machine stood still.
    LateWakeUp,
    /// The block computed longer than usual. A machine that stood still below the system looks the same.
    Block(usize),
    /// The block waited, for a lock, a sleep or a device, though it should not.
    Wait(usize),
    /// The block's device let it wait.
    Io(usize),
    /// The block touched memory that was not there.
    PageFault {
        /// Pages found without a disk.
        minor: u32,
        /// Pages read from a disk.
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

/// What the system counted from a moment shortly before the overrun to its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Evidence {
    /// How many sleeps before the cycle the count began.
    pub cycles: u32,
    /// Pages found without a disk.
    pub minor_faults: u32,
    /// Pages read from a disk.
    pub major_faults: u32,
    /// How often another thread took the CPU.
    pub preemptions: u32,
    /// How often the thread waited, besides for its next cycle: at least.
    pub waits: u32,
    /// Time that the cycle took and that the thread was not on a CPU [ns].
    pub off_cpu: u32,
}

/// Times of a cycle: to its wake-up, of its blocks [ns].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Parts {
    pub(crate) lateness: u32,
    pub(crate) blocks: [u32; MAX_BLOCKS],
}

/// What the parts of a good cycle take: a mean that forgets.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TypicalCycle(Option<Parts>);

impl TypicalCycle {
    /// A cycle that met its deadline.
    pub(crate) fn learn(&mut self, parts: &Parts) {
        let mean = self.0.get_or_insert(*parts);
        let follow = |mean: &mut u32, value: u32| {
            *mean = (i64::from(*mean) + (i64::from(value) - i64::from(*mean)) / 16) as u32;
        };
        follow(&mut mean.lateness, parts.lateness);
        mean.blocks.iter_mut().zip(parts.blocks).for_each(|(mean, value)| follow(mean, value));
    }

    /// What is guilty.
    pub(crate) fn cause(&self, parts: &Parts, blocks: &[bool; MAX_BLOCKS], evidence: Option<Evidence>) -> Cause {
        let usual = self.0.unwrap_or_default();
        let late = parts.lateness.saturating_sub(usual.lateness);
        let (mut block, mut excess) = (0, 0);
        for index in 0..MAX_BLOCKS {
            let more = parts.blocks[index].saturating_sub(usual.blocks[index]);
            if more > excess {
                (block, excess) = (index, more);
            }
        }
        if late > excess {
            return Cause::LateWakeUp;
        }
        let io = blocks[block];
        let computed = if io { Cause::Io(block) } else { Cause::Block(block) };
        let Some(seen) = evidence else { return computed };
        let page_fault = Cause::PageFault { minor: seen.minor_faults, major: seen.major_faults, block };
        let off_cpu = seen.off_cpu > excess / 2;
        match seen {
            _ if off_cpu && seen.major_faults > 0 => page_fault,
            _ if off_cpu && seen.waits > 0 => {
                if io {
                    Cause::Io(block)
                } else {
                    Cause::Wait(block)
                }
            }
            _ if off_cpu && seen.preemptions > 0 => Cause::Preempted { block },
            _ if u64::from(seen.minor_faults) * FAULT >= u64::from(excess / 2).max(1) => page_fault,
            _ => computed,
        }
    }
}

impl Overrun {
    /// What happened, for an engineer: blocks by their names.
    pub fn sentence(&self, blocks: &[Block]) -> String {
        let by = Time(self.by);
        let name = |index: usize| blocks.get(index).map_or("cycle", |block| block.name);
        let begin = format!("Cycle {} was {by} too late: ", self.cycle);
        let why = match self.cause {
            Cause::LateWakeUp => format!(
                "its thread was woken {} after the deadline, by a thread above it, a late timer or a machine that stood \
                 still.",
                Time(self.late)
            ),
            Cause::Block(block) => format!("the block \"{}\" computed longer than usual.", name(block)),
            Cause::Wait(block) => {
                format!(
                    "the block \"{}\" waited, for a lock, a sleep or a device that is not flagged as one.",
                    name(block)
                )
            }
            Cause::Io(block) => format!("the device of \"{}\" let it wait.", name(block)),
            Cause::PageFault { minor, major, block } => format!(
                "the block \"{}\" touched memory that was not there ({minor} pages, {major} more from a disk). Allocate and \
                 touch it before the start, and let the memory be locked.",
                name(block)
            ),
            Cause::Preempted { block } => {
                format!(
                    "another thread took the CPU during the block \"{}\". Raise the priority or pin the other.",
                    name(block)
                )
            }
        };
        begin + &why
    }
}

/// A duration as people read it.
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
        let mut usual = TypicalCycle::default();
        usual.learn(&parts(5000, [20_000, 150_000, 30_000]));
        usual.cause(&bad, &IO, evidence)
    }

    #[test]
    fn the_part_that_exceeds_its_usual_time_most_is_guilty() {
        assert_eq!(cause(parts(3 * MS, [20_000, 160_000, 30_000]), None), Cause::LateWakeUp);
        // The second block is the longest, as always.
        assert_eq!(cause(parts(5000, [90_000, 155_000, 30_000]), None), Cause::Block(0));
        assert_eq!(cause(parts(5000, [20_000, 150_000, 230_000]), None), Cause::Io(2));
    }

    #[test]
    fn what_the_system_counted_says_why_a_block_was_slow() {
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
            // Interrupted once, but not for long.
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
    fn the_usual_follows_the_good_cycles() {
        let mut usual = TypicalCycle::default();
        for _ in 0..200 {
            usual.learn(&parts(0, [0, 80_000, 0]));
        }
        // From here on the second block is short and the first one long.
        for _ in 0..200 {
            usual.learn(&parts(0, [80_000, 0, 0]));
        }
        assert_eq!(usual.cause(&parts(0, [90_000, 60_000, 0]), &IO, None), Cause::Block(1));
    }

    #[test]
    fn an_engineer_understands_the_sentence() {
        let overrun = |cause| Overrun { cycle: 812, late: 6000, by: 1_250_000, cause, evidence: None };
        let blocks = [Block::io("read"), Block::new("law")];
        assert_eq!(
            overrun(Cause::Block(1)).sentence(&blocks),
            "Cycle 812 was 1250.0 µs too late: the block \"law\" computed longer than usual."
        );
        let sentence = overrun(Cause::PageFault { minor: 7, major: 0, block: 0 }).sentence(&blocks);
        assert!(sentence.contains("\"read\" touched memory that was not there (7 pages"), "{sentence}");
    }
}
