//! One cycle of the executive, made of blocks whose durations are measured.

use crate::clock::{Clock, Nanoseconds};

/// Maximum number of blocks of a cycle: a [`Timing`](crate::Timing) has a fixed size.
pub const MAX_BLOCKS: usize = 16;

/// A part of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Name in timing reports.
    pub name: &'static str,
    /// It accesses a device and may wait for it.
    pub io: bool,
}

impl Block {
    /// A block of computations only.
    pub const fn new(name: &'static str) -> Self {
        Block { name, io: false }
    }

    /// A block that accesses a device.
    pub const fn io(name: &'static str) -> Self {
        Block { name, io: true }
    }
}

/// Whether there is a next cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// There is another cycle.
    Continue,
    /// This was the last.
    Stop,
}

/// The work of every cycle.
pub trait Cycle: Send {
    /// Its blocks, at most [`MAX_BLOCKS`]; queried once, before the first cycle.
    fn blocks(&self) -> &[Block];

    /// One cycle. Its number counts periods: cycle k is due k periods after the first. Calls `lap.done(index)` after
    /// each block.
    fn run(&mut self, cycle: u64, lap: &mut Lap) -> Next;

    /// Called instead of `run` for each missed cycle, before the next one runs: the outputs were held. Counts the cycle
    /// where cycles are counted.
    fn hold(&mut self, cycle: u64);

    /// The last call, also after a panic in `run`: sets the outputs to safe values. The state may be that of an
    /// incomplete cycle; use the outputs only.
    fn end(&mut self);
}

/// Stopwatch for the blocks of a cycle.
pub struct Lap<'a> {
    clock: &'a dyn Clock,
    first: Nanoseconds,
    last: Nanoseconds,
    spent: [u32; MAX_BLOCKS],
}

impl<'a> Lap<'a> {
    pub(crate) fn begin(clock: &'a dyn Clock, now: Nanoseconds) -> Self {
        Lap { clock, first: now, last: now, spent: [0; MAX_BLOCKS] }
    }

    /// Assigns the time since the last call, or since the start of the cycle, to block `index`. Repeated calls with one
    /// index add up.
    #[inline]
    pub fn done(&mut self, index: usize) {
        let now = self.clock.now();
        debug_assert!(index < MAX_BLOCKS, "block {index} of at most {MAX_BLOCKS}");
        if let Some(spent) = self.spent.get_mut(index) {
            *spent = spent.saturating_add(short(now - self.last));
        }
        self.last = now;
    }

    /// Duration from the start to the last mark, and of each block.
    pub(crate) fn end(self) -> (Nanoseconds, [u32; MAX_BLOCKS]) {
        (self.last - self.first, self.spent)
    }
}

/// A duration as stored in records, limited to 4.29 s.
pub(crate) fn short(time: Nanoseconds) -> u32 {
    u32::try_from(time).unwrap_or(u32::MAX)
}
