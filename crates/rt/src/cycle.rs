//! What is called in time: one cycle, made of blocks whose time is taken.

use crate::clock::{Clock, Nanoseconds};

/// The most blocks of a cycle: a [`Timing`](crate::Timing) has a fixed size.
pub const MAX_BLOCKS: usize = 16;

/// A part of a cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// What it is called where its time is shown.
    pub name: &'static str,
    /// It talks to a device, which may let it wait.
    pub io: bool,
}

impl Block {
    /// A block that computes.
    pub const fn new(name: &'static str) -> Self {
        Block { name, io: false }
    }

    /// A block that talks to a device.
    pub const fn io(name: &'static str) -> Self {
        Block { name, io: true }
    }
}

/// Whether there is a next cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// There is.
    Continue,
    /// This was the last.
    Stop,
}

/// What runs in every cycle.
pub trait Cycle: Send {
    /// Its blocks, at most [`MAX_BLOCKS`]; asked for once, before the first cycle.
    fn blocks(&self) -> &[Block];

    /// One cycle. The number is time: cycle k is that of k periods after the first. Says `lap.done(index)` after each
    /// block.
    fn run(&mut self, cycle: u64, lap: &mut Lap) -> Next;

    /// Instead of `run` for a cycle that was missed, before the next one runs: the outputs have been held. An
    /// integrator that counts cycles counts it here.
    fn hold(&mut self, cycle: u64);

    /// The last call, however it ends, after a panic in `run` as well: outputs to where they are safe. The state may
    /// be half a cycle's: rely on the outputs alone.
    fn end(&mut self);
}

/// Takes the time of each block.
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

    /// The time since the last call, or since the cycle began, was that of block `index`. Called twice with one index,
    /// the block has both times.
    #[inline]
    pub fn done(&mut self, index: usize) {
        let now = self.clock.now();
        debug_assert!(index < MAX_BLOCKS, "block {index} of at most {MAX_BLOCKS}");
        if let Some(spent) = self.spent.get_mut(index) {
            *spent = spent.saturating_add(short(now - self.last));
        }
        self.last = now;
    }

    /// From the begin to the last mark, and of each block.
    pub(crate) fn end(self) -> (Nanoseconds, [u32; MAX_BLOCKS]) {
        (self.last - self.first, self.spent)
    }
}

/// A time as the records have it: what exceeds 4.29 s is that.
pub(crate) fn short(time: Nanoseconds) -> u32 {
    u32::try_from(time).unwrap_or(u32::MAX)
}
