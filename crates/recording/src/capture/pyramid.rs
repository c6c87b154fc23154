//! A history with zoom: samples, and extremes over 8, 16, 32 … ticks.
//!
//! It stores the samples, and the extremes of each block of 2^k ticks that begins at a multiple of 2^k, for k ≥ 3; for
//! smaller blocks the samples are as fast. A span is composed of the smallest number of complete blocks, at most two of
//! each size, so that the time of a query depends on its points, not on the length of the span.

use std::ops::Range;

use super::admit;
use super::extremes::Extremes;
use super::stream::{Account, Row, Sink};
use stickslip_base::Error;

/// Blocks of fewer than 2^FINEST ticks are not stored.
const FINEST: u32 = 3;

/// A part of a span.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Its cycles.
    pub cycles: Range<u64>,
    /// Number of cycles with a row; the others are lost.
    pub rows: u64,
    /// Extremes of each signal.
    pub extremes: Vec<Extremes>,
}

/// Blocks of one size, in a ring.
#[derive(Clone, Debug)]
struct Level {
    /// Extremes of all signals, block by block.
    extremes: Vec<Extremes>,
    /// Rows in each block.
    rows: Vec<u64>,
}

/// The newest cycles of some signals.
#[derive(Clone, Debug)]
pub struct Pyramid {
    signals: Vec<usize>,
    /// Values of all signals, cycle by cycle, in a ring.
    samples: Vec<f64>,
    /// Whether each cycle has a row.
    present: Vec<bool>,
    /// Levels of 2^FINEST ticks, of twice as many, … of the whole ring.
    levels: Vec<Level>,
    /// First cycle of the history.
    first: u64,
    /// The next expected cycle.
    next: u64,
    /// Buffer of a block, so that rows do not allocate.
    scratch: Block,
    account: Account,
}

impl Pyramid {
    /// A history of these signals, by index, over the newest `ticks`, rounded up to a power of two, at least 8.
    ///
    /// # Errors
    /// No signal, or more than `limit` bytes.
    pub fn new(signals: Vec<usize>, ticks: u64, limit: usize) -> Result<Self, Error> {
        if signals.is_empty() {
            let (what, remedy) = ("signals of a history", "Choose at least one.");
            return Err(Error::TooFew { what, found: 0, needed: 1, remedy });
        }
        let width = signals.len();
        let ticks = u128::from(ticks).next_power_of_two().max(1 << FINEST);
        let bytes = Self::bytes(width, ticks);
        admit("the history", bytes, limit, "Choose fewer signals or a shorter history, or raise the limit.")?;
        let ticks = ticks as usize;
        let level = |k: u32| Level { extremes: vec![Extremes::NONE; (ticks >> k) * width], rows: vec![0; ticks >> k] };
        let scratch = Block { cycles: 0..0, rows: 0, extremes: vec![Extremes::NONE; width] };
        Ok(Pyramid {
            signals,
            samples: vec![0.0; ticks * width],
            present: vec![false; ticks],
            levels: (FINEST..=ticks.ilog2()).map(level).collect(),
            first: 0,
            next: 0,
            scratch,
            account: Account::default(),
        })
    }

    /// Memory for `width` signals over 2^n ticks [bytes].
    fn bytes(width: usize, ticks: u128) -> u128 {
        let width = width as u128;
        let sample = width * size_of::<f64>() as u128 + size_of::<bool>() as u128;
        let block = width * size_of::<Extremes>() as u128 + size_of::<u64>() as u128;
        ticks * sample + ((ticks >> (FINEST - 1)) - 1) * block
    }

    /// The cycles of the history.
    pub fn cycles(&self) -> Range<u64> {
        self.first.max(self.next.saturating_sub(self.present.len() as u64))..self.next
    }

    /// The available part of these cycles in at most `points` blocks of equal length, except at the ends. For a plot,
    /// use twice as many points as pixels. The time grows with the points, not with the span.
    pub fn query(&self, cycles: Range<u64>, points: usize) -> Vec<Block> {
        let available = self.cycles();
        let (from, to) = (cycles.start.max(available.start), cycles.end.min(available.end));
        if from >= to || points == 0 {
            return Vec::new();
        }
        // The smallest blocks whose number is not too large.
        let few = |k: &u32| ((to - 1) >> k) - (from >> k) < points as u64;
        let k = (0..u64::BITS - 1).find(few).unwrap_or(u64::BITS - 1);
        let block = |index: u64| self.block((index << k).max(from)..((index + 1) << k).min(to));
        ((from >> k)..=((to - 1) >> k)).map(block).collect()
    }

    /// Any available span in the smallest number of parts.
    fn block(&self, cycles: Range<u64>) -> Block {
        let mut block = Block { cycles: cycles.clone(), rows: 0, extremes: vec![Extremes::NONE; self.signals.len()] };
        let mut cycle = cycles.start;
        while cycle < cycles.end {
            let longest = (cycles.end - cycle).ilog2().min(cycle.trailing_zeros());
            if longest < FINEST {
                self.add_sample(cycle, &mut block);
                cycle += 1;
            } else {
                self.add_level(longest, cycle, &mut block);
                cycle += 1 << longest;
            }
        }
        block
    }

    /// Size of the largest blocks: the whole ring.
    fn top(&self) -> u32 {
        self.present.len().ilog2()
    }

    fn add_sample(&self, cycle: u64, to: &mut Block) {
        let slot = self.slot(cycle, 0);
        if self.present[slot] {
            to.rows += 1;
            let samples = &self.samples[slot * self.signals.len()..];
            for (extremes, &sample) in to.extremes.iter_mut().zip(samples) {
                extremes.include(sample);
            }
        }
    }

    /// Adds the block of 2^k ticks that begins at `cycle`.
    fn add_level(&self, k: u32, cycle: u64, to: &mut Block) {
        let level = &self.levels[(k - FINEST) as usize];
        let slot = self.slot(cycle, k);
        to.rows += level.rows[slot];
        for (extremes, &other) in to.extremes.iter_mut().zip(&level.extremes[slot * self.signals.len()..]) {
            extremes.merge(other);
        }
    }

    /// Place in the ring of the blocks of 2^k ticks.
    fn slot(&self, cycle: u64, k: u32) -> usize {
        (cycle as usize & (self.present.len() - 1)) >> k
    }
}

impl Pyramid {
    /// The next cycle, with its row if it has one.
    fn put(&mut self, row: Option<&[f64]>) {
        let slot = self.slot(self.next, 0);
        if std::mem::replace(&mut self.present[slot], row.is_some()) {
            self.account.stored -= 1;
            self.account.discarded += 1;
        }
        if let Some(values) = row {
            self.account.stored += 1;
            let samples = &mut self.samples[slot * self.signals.len()..];
            for (sample, &signal) in samples.iter_mut().zip(&self.signals) {
                *sample = values[signal];
            }
        }
        self.next += 1;
        self.close();
    }

    /// Fills the blocks that end before the next cycle, small ones first: the larger ones are computed from them.
    fn close(&mut self) {
        let mut block = std::mem::replace(&mut self.scratch, Block { cycles: 0..0, rows: 0, extremes: Vec::new() });
        for k in FINEST..=self.top().min(self.next.trailing_zeros()) {
            let begin = self.next - (1 << k);
            block.rows = 0;
            block.extremes.fill(Extremes::NONE);
            if k == FINEST {
                (begin..self.next).for_each(|cycle| self.add_sample(cycle, &mut block));
            } else {
                self.add_level(k - 1, begin, &mut block);
                self.add_level(k - 1, begin + (1 << (k - 1)), &mut block);
            }
            let slot = self.slot(begin, k);
            let level = &mut self.levels[(k - FINEST) as usize];
            level.rows[slot] = block.rows;
            level.extremes[slot * block.extremes.len()..][..block.extremes.len()].copy_from_slice(&block.extremes);
        }
        self.scratch = block;
    }

    /// All previous cycles are out of the ring. Blocks stay: those that begin before the next row are not read.
    fn forget(&mut self) {
        self.account.discarded += std::mem::take(&mut self.account.stored);
        self.present.fill(false);
    }
}

impl Sink for Pyramid {
    fn width(&self) -> usize {
        self.signals.iter().map(|signal| signal + 1).max().unwrap_or(0)
    }

    fn push(&mut self, row: Row<'_>) {
        let begins = self.account.produced == 0;
        self.account.arrive(&row);
        if begins || row.lost() >= self.present.len() as u64 {
            self.forget();
            (self.first, self.next) = (row.cycle(), row.cycle());
        }
        while self.next < row.cycle() {
            self.put(None);
        }
        self.put(Some(row.values()));
    }

    fn account(&self) -> Account {
        self.account
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_as_stated() {
        for (ticks, signals) in [(1, 1), (8, 2), (100, 3), (4096, 32)] {
            let pyramid = Pyramid::new((0..signals).collect(), ticks, usize::MAX).unwrap();
            let levels: usize = pyramid
                .levels
                .iter()
                .map(|level| size_of_val(&level.extremes[..]) + size_of_val(&level.rows[..]))
                .sum();
            let bytes = levels + size_of_val(&pyramid.samples[..]) + size_of_val(&pyramid.present[..]);
            assert_eq!(Pyramid::bytes(signals, u128::from(ticks.next_power_of_two().max(8))), bytes as u128);
            assert!(Pyramid::new((0..signals).collect(), ticks, bytes).is_ok());
            assert!(Pyramid::new((0..signals).collect(), ticks, bytes - 1).is_err());
        }
    }
}
