//! How often a cycle was how late, and how long each block took: outside the deadline.

use hdrhistogram::Histogram;

use crate::cause::Overrun;
use crate::cycle::Block;
use crate::timing::{Timing, Timings};

/// The longest time that is told from longer ones [ns].
const LONGEST: u64 = u32::MAX as u64;

/// The distribution of lateness, total and blocks, and what was missed.
#[derive(Clone, Debug)]
pub struct Histograms {
    blocks: Vec<Block>,
    lateness: Histogram<u64>,
    total: Histogram<u64>,
    spent: Vec<Histogram<u64>>,
    /// The overruns whose records arrived.
    pub overruns: Vec<Overrun>,
    /// Cycles that were held, as far as records tell.
    pub missed: u64,
    /// Records that found no room, as far as others tell.
    pub lost: u64,
}

/// What is said of a distribution [ns], to three digits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// Values.
    pub count: u64,
    /// Half of them are at most this.
    pub p50: u64,
    /// 99 % of them.
    pub p99: u64,
    /// 99.9 % of them.
    pub p999: u64,
    /// All of them.
    pub max: u64,
}

/// The distribution of one duration, to three digits in fixed memory.
#[derive(Clone, Debug)]
pub struct Durations(Histogram<u64>);

impl Default for Durations {
    fn default() -> Self {
        Durations(empty())
    }
}

impl Durations {
    /// Takes one [ns].
    pub fn add(&mut self, nanoseconds: u64) {
        self.0.saturating_record(nanoseconds);
    }

    /// What is said of them.
    pub fn quantiles(&self) -> Quantiles {
        Quantiles::of(&self.0)
    }
}

fn empty() -> Histogram<u64> {
    Histogram::new_with_bounds(1, LONGEST, 3).expect("bounds and digits that the library has")
}

impl Histograms {
    /// Of these blocks; empty.
    pub fn new(blocks: &[Block]) -> Self {
        Histograms {
            blocks: blocks.to_vec(),
            lateness: empty(),
            total: empty(),
            spent: blocks.iter().map(|_| empty()).collect(),
            overruns: Vec::new(),
            missed: 0,
            lost: 0,
        }
    }

    /// Takes the records that are there.
    pub fn take(&mut self, timings: &mut Timings) {
        timings.for_each(|timing| self.add(&timing));
    }

    fn add(&mut self, timing: &Timing) {
        self.lateness.saturating_record(timing.lateness.into());
        self.missed += u64::from(timing.missed);
        self.lost += u64::from(timing.lost);
        self.overruns.extend(timing.overrun);
        // A cycle that did not begin has no durations.
        if timing.total > 0 {
            self.total.saturating_record(timing.total.into());
            self.spent.iter_mut().zip(timing.blocks).for_each(|(spent, time)| spent.saturating_record(time.into()));
        }
    }

    /// From the deadline to the wake-up.
    pub fn lateness(&self) -> Quantiles {
        Quantiles::of(&self.lateness)
    }

    /// From the wake-up to the end of the work.
    pub fn total(&self) -> Quantiles {
        Quantiles::of(&self.total)
    }

    /// Of each block.
    pub fn blocks(&self) -> impl Iterator<Item = (Block, Quantiles)> {
        self.blocks.iter().copied().zip(self.spent.iter().map(Quantiles::of))
    }

    /// The shortest cycle [ns], to three digits; 0 where there is none.
    pub fn shortest(&self) -> u64 {
        if self.total.is_empty() { 0 } else { self.total.min() }
    }

    /// How many cycles took from each of these times, which go up, to the next one [ns].
    pub fn counts(&self, edges: &[u64]) -> Vec<u64> {
        let mut counts = vec![0; edges.len().saturating_sub(1)];
        // Value by value: a range of the library's begins and ends with whole steps of its resolution.
        for value in self.total.iter_recorded() {
            let above = edges.partition_point(|edge| *edge <= value.value_iterated_to());
            if let Some(count) = above.checked_sub(1).and_then(|bin| counts.get_mut(bin)) {
                *count += value.count_at_value();
            }
        }
        counts
    }

    /// What part of the cycles were later than `lateness` [ns].
    pub fn later_than(&self, lateness: u64) -> f64 {
        let within = self.lateness.count_between(0, lateness.min(LONGEST));
        (self.lateness.len() - within) as f64 / self.lateness.len().max(1) as f64
    }
}

impl Quantiles {
    fn of(histogram: &Histogram<u64>) -> Self {
        let at = |part| histogram.value_at_quantile(part);
        Quantiles { count: histogram.len(), p50: at(0.5), p99: at(0.99), p999: at(0.999), max: histogram.max() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_to_three_digits() {
        let mut histograms = Histograms::new(&[Block::new("law")]);
        for cycle in 0..10_000u32 {
            // Lateness 0 … 99.99 µs, each once, in some order.
            let mut timing =
                Timing { total: 500, ..Timing::begun(cycle.into(), u64::from(cycle * 7919 % 10_000) * 10) };
            timing.blocks[0] = if cycle == 17 { 2_000_000 } else { 400 };
            histograms.add(&timing);
        }
        let near = |found: u64, expected: f64| assert!((found as f64 / expected - 1.0).abs() < 2e-3, "{found}");
        let Quantiles { count, p50, p99, p999, max } = histograms.lateness();
        assert_eq!(count, 10_000);
        near(p50, 50e3);
        near(p99, 99e3);
        near(p999, 99.9e3);
        near(max, 99.99e3);
        assert_eq!((histograms.shortest(), histograms.counts(&[100, 500, 1000])), (500, vec![0, 10_000]));
        assert!((histograms.later_than(90_000) - 0.1).abs() < 1e-3);
        let (block, law) = histograms.blocks().next().unwrap();
        assert_eq!((block.name, law.p999), ("law", 400));
        near(law.max, 2e6);
    }

    #[test]
    fn nothing_is_known_of_nothing() {
        assert_eq!(Histograms::new(&[]).lateness(), Quantiles::default());
        assert_eq!(Histograms::new(&[]).later_than(0), 0.0);
    }
}
