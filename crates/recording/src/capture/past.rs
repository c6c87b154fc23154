//! History of all signals for the scope: extremes of blocks of cycles, from fine to coarse, in bounded memory.
//!
//! Level k has the smallest and the largest value of each signal in each block of 16·4^k cycles, in a ring. A query
//! reads the finest level with at most the requested number of blocks, so that its time does not depend on the length
//! of the range. Values are rounded outwards to 32 bits: no spike is lost.

use std::ops::Range;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::stream::{Account, Row, Sink};

/// Cycles of the finest blocks.
const FINEST: u64 = 16;
/// Ratio of the lengths of blocks of neighbouring levels.
const RATIO: u64 = 4;
const LEVELS: u32 = 5;
/// A block without a finite value.
const EMPTY: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

/// A part of the history.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Past {
    /// The oldest cycle of the history.
    pub oldest: u64,
    /// The cycle after the newest one.
    pub next: u64,
    /// Number of cycles of the finest blocks.
    pub finest: u64,
    /// Number of cycles of the returned blocks.
    pub block: u64,
    /// The first cycle of the first block.
    pub from: u64,
    /// Smallest value in each block, for each signal; `null` without a finite value.
    pub low: Vec<Vec<Option<f32>>>,
    /// Largest value in each block.
    pub high: Vec<Vec<Option<f32>>>,
}

/// Blocks of one length, in a ring.
struct Level {
    ticks: u64,
    width: usize,
    /// Extremes of all signals, block by block; only blocks that were entered are read.
    extremes: Vec<[f32; 2]>,
    /// The first block and the newest one; `None` before the first.
    entered: Option<[u64; 2]>,
}

/// The history.
pub struct History {
    levels: Vec<Level>,
    width: usize,
    /// The first cycle, and the next expected one.
    first: u64,
    next: u64,
    account: Account,
}

impl History {
    /// A history of `width` signals within this memory [bytes].
    pub fn new(width: usize, memory: usize) -> Self {
        let width = width.max(1);
        // All levels together have less than RATIO / (RATIO − 1) of the blocks of the finest one, and two more each.
        let block = width * size_of::<[f32; 2]>();
        let finest = (memory * (RATIO as usize - 1) / RATIO as usize / block).saturating_sub(2 * LEVELS as usize);
        let level = |k: u32| {
            let blocks = finest / (RATIO as usize).pow(k) + 2;
            // Zeros need no memory until they are written.
            Level { ticks: FINEST * RATIO.pow(k), width, extremes: vec![[0.0; 2]; blocks * width], entered: None }
        };
        History { levels: (0..LEVELS).map(level).collect(), width, first: 0, next: 0, account: Account::default() }
    }

    /// The cycles of the history.
    pub fn cycles(&self) -> Range<u64> {
        let oldest = self.levels.first().and_then(Level::oldest).map_or(0, |block| block * FINEST);
        self.first.max(oldest)..self.next
    }

    /// Extremes of these signals in a range of cycles, in at most `points` blocks if a level has them.
    pub fn query(&self, signals: &[usize], cycles: Range<u64>, points: u64) -> Past {
        let available = self.cycles();
        let (oldest, next) = (available.start, available.end);
        let range = cycles.start.max(oldest)..cycles.end.min(next);
        let empty = Past { oldest, next, finest: FINEST, block: FINEST, from: range.start, ..Past::default() };
        if range.start >= range.end {
            return empty;
        }
        let count = |level: &Level| (range.end - 1) / level.ticks + 1 - range.start / level.ticks;
        let fits = self.levels.iter().find(|level| count(level) <= points.max(1)).or(self.levels.last());
        let Some(level) = fits else { return empty };
        let (begin, end) = (range.start / level.ticks, (range.end - 1) / level.ticks + 1);
        let values = |side: usize| {
            let of_signal =
                |&signal: &usize| (begin..end).map(|block| self.value(level, block, signal, side)).collect();
            signals.iter().map(of_signal).collect()
        };
        Past { block: level.ticks, from: begin * level.ticks, low: values(0), high: values(1), ..empty }
    }
}

impl History {
    /// One extreme; `None` for a block without a finite value. The newest finest block is not in the coarser levels yet.
    fn value(&self, level: &Level, block: u64, signal: usize, side: usize) -> Option<f32> {
        let stored = level.value(block, signal, side);
        let finest = self.levels.first()?;
        let newest = finest.entered?[1];
        if level.ticks == FINEST || newest * FINEST / level.ticks != block {
            return stored;
        }
        let more = finest.value(newest, signal, side);
        stored.into_iter().chain(more).reduce(if side == 0 { f32::min } else { f32::max })
    }
}

impl Level {
    /// Number of blocks in the ring.
    fn blocks(&self) -> u64 {
        (self.extremes.len() / self.width) as u64
    }

    /// The oldest block that is not overwritten.
    fn oldest(&self) -> Option<u64> {
        self.entered.map(|[first, newest]| first.max((newest + 1).saturating_sub(self.blocks())))
    }

    /// Extremes of all signals in a block.
    fn block(&mut self, block: u64) -> &mut [[f32; 2]] {
        let slot = (block % self.blocks()) as usize * self.width;
        &mut self.extremes[slot..slot + self.width]
    }

    /// One extreme; `None` for a block without a finite value.
    fn value(&self, block: u64, signal: usize, side: usize) -> Option<f32> {
        let [_, newest] = self.entered?;
        if block > newest || block < self.oldest()? {
            return None;
        }
        let extremes = self.extremes[(block % self.blocks()) as usize * self.width + signal];
        (extremes[0] <= extremes[1]).then_some(extremes[side])
    }

    /// Makes a block the newest one, and empties those before it. Returns the block that was the newest.
    fn enter(&mut self, block: u64) -> Option<u64> {
        let before = self.entered.map(|[_, newest]| newest);
        if before == Some(block) {
            return None;
        }
        let from = before.map_or(block, |newest| newest + 1).max((block + 1).saturating_sub(self.blocks()));
        (from..=block).for_each(|block| self.block(block).fill(EMPTY));
        self.entered = Some([self.entered.map_or(block, |[first, _]| first), block]);
        before
    }
}

impl Sink for History {
    fn width(&self) -> usize {
        self.width
    }

    fn push(&mut self, row: Row<'_>) {
        self.account.arrive(&row);
        let cycle = row.cycle();
        if self.next == 0 {
            self.first = cycle;
        }
        self.next = cycle + 1;
        let Some((finest, coarse)) = self.levels.split_first_mut() else { return };
        // A complete block is added to the coarser levels.
        if let Some(complete) = finest.enter(cycle / FINEST) {
            let from = finest.block(complete);
            for level in coarse {
                let block = complete * FINEST / level.ticks;
                level.enter(block);
                for (to, [low, high]) in level.block(block).iter_mut().zip(&*from) {
                    *to = [to[0].min(*low), to[1].max(*high)];
                }
            }
        }
        for (extremes, &value) in finest.block(cycle / FINEST).iter_mut().zip(row.values()) {
            if value.is_finite() {
                *extremes = [extremes[0].min(below(value)), extremes[1].max(above(value))];
            }
        }
        self.account.stored += 1;
    }

    fn account(&self) -> Account {
        self.account
    }
}

/// The largest 32-bit number that is not above a value.
fn below(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) > value { near.next_down() } else { near }
}

/// The smallest 32-bit number that is not below a value.
fn above(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

#[cfg(test)]
mod tests {
    use super::super::{Stream, Tap};

    use super::*;

    fn signal(cycle: u64, k: usize) -> f64 {
        let spike = if cycle == 1_234_567 && k == 3 { 500.0 } else { 0.0 };
        (cycle as f64 * 1e-3 * (k + 1) as f64).sin() + spike
    }

    fn history(stream: &Stream, tap: &Tap<History>) -> Past {
        stream.get(tap).unwrap().query(&[3], 0..u64::MAX, 2000)
    }

    #[test]
    fn ten_minutes_of_sixteen_signals_at_4_khz_fit_into_32_mb_and_no_spike_is_lost() {
        let mut stream = Stream::new(16);
        let tap = stream.add(History::new(16, 32 << 20)).unwrap();
        // 15 minutes: the oldest are overwritten.
        for cycle in 0..4000 * 900 {
            stream.push(cycle, &std::array::from_fn::<f64, 16, _>(|k| signal(cycle, k))).unwrap();
        }
        let store = stream.get(&tap).unwrap();
        let bytes: usize = store.levels.iter().map(|level| size_of_val(&level.extremes[..])).sum();
        assert!(bytes <= 32 << 20, "{bytes}");
        let cycles = store.cycles();
        assert!(cycles.end - cycles.start >= 4000 * 600, "{cycles:?}");
        // The whole history, and ever smaller parts of it around the spike, with at most 2000 blocks each.
        let mut span = cycles.end - cycles.start;
        while span > 100 {
            let range = 1_234_567_u64.saturating_sub(span / 2)..1_234_567 + span / 2 + 1;
            let past = store.query(&[3, 0], range.clone(), 2000);
            let largest = past.high[0].iter().flatten().fold(f32::MIN, |a, b| a.max(*b));
            assert!((499.0..502.0).contains(&largest), "{span}: {largest}");
            assert!(past.high[0].len() <= 2000 && past.block <= FINEST.max(span / 400), "{span}: {}", past.block);
            assert!(past.from <= range.start.max(past.oldest) && past.low.len() == 2);
            span /= 3;
        }
        // The extremes are those of the samples.
        let past = store.query(&[5], 3_000_000..3_000_160, 20);
        assert_eq!((past.block, past.from, past.low[0].len()), (16, 3_000_000, 10));
        for (block, (low, high)) in past.low[0].iter().zip(&past.high[0]).enumerate() {
            let from = 3_000_000 + 16 * block as u64;
            let values: Vec<f64> = (from..from + 16).map(|cycle| signal(cycle, 5)).collect();
            let [least, largest] =
                [values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(f64::MIN, f64::max)];
            let (low, high) = (f64::from(low.unwrap()), f64::from(high.unwrap()));
            assert!(low <= least && least - low < 1e-6 && high >= largest && high - largest < 1e-6);
        }
    }

    #[test]
    fn lost_cycles_and_non_finite_values_are_gaps() {
        let mut stream = Stream::new(4);
        let tap = stream.add(History::new(4, 1 << 20)).unwrap();
        assert_eq!(history(&stream, &tap), Past { finest: 16, block: 16, ..Past::default() });
        // A history that begins within a block, with 64 lost cycles.
        for cycle in (1003..1100).chain(1164..1200) {
            let value = if (1184..1200).contains(&cycle) { f64::NAN } else { cycle as f64 };
            stream.push(cycle, &[0.0, 0.0, 0.0, value]).unwrap();
        }
        let past = history(&stream, &tap);
        assert_eq!((past.oldest, past.next, past.from, past.block), (1003, 1200, 992, 16));
        let expected = [
            Some((1003.0, 1007.0)),
            Some((1008.0, 1023.0)),
            Some((1024.0, 1039.0)),
            Some((1040.0, 1055.0)),
            Some((1056.0, 1071.0)),
            Some((1072.0, 1087.0)),
            Some((1088.0, 1099.0)),
            None,
            None,
            None,
            Some((1164.0, 1167.0)),
            Some((1168.0, 1183.0)),
            None,
        ];
        let found: Vec<_> = past.low[0].iter().zip(&past.high[0]).map(|(low, high)| low.zip(*high)).collect();
        assert_eq!(found, expected);
        // After a gap that is longer than the ring, nothing old is left.
        stream.push(100_000_000, &[0.0, 0.0, 0.0, 7.0]).unwrap();
        let past = history(&stream, &tap);
        let values: Vec<_> = past.high[0].iter().flatten().collect();
        assert_eq!(values, [&7.0]);
        assert_eq!(stream.get(&tap).unwrap().query(&[3], 5..5, 9).high, Vec::<Vec<_>>::new());
    }
}
