//! Distributions of lateness and block durations, computed outside the deadline.

use hdrhistogram::Histogram;

use crate::cause::Overrun;
use crate::cycle::Block;
use crate::timing::{Timing, Timings};

/// Longest time that is resolved [ns].
const LONGEST: u64 = u32::MAX as u64;

/// Distributions of lateness, total and block durations; missed cycles and overruns.
#[derive(Clone, Debug)]
pub struct Histograms {
    blocks: Vec<Block>,
    lateness: Histogram<u64>,
    total: Histogram<u64>,
    spent: Vec<Histogram<u64>>,
    /// Overruns in the received records.
    pub overruns: Vec<Overrun>,
    /// Missed cycles according to the received records.
    pub missed: u64,
    /// Lost records according to the received records.
    pub lost: u64,
}

/// Quantiles of a distribution [ns], to three digits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// Number of values.
    pub count: u64,
    /// Median.
    pub p50: u64,
    /// 99 % of the values are at most this.
    pub p99: u64,
    /// 99.9 % of the values are at most this.
    pub p999: u64,
    /// Largest value.
    pub max: u64,
}

/// Distribution of one duration, to three digits, in fixed memory.
#[derive(Clone, Debug)]
pub struct Durations(Histogram<u64>);

impl Default for Durations {
    fn default() -> Self {
        Durations(empty())
    }
}

impl Durations {
    /// Adds a duration [ns].
    pub fn add(&mut self, nanoseconds: u64) {
        self.0.saturating_record(nanoseconds);
    }

    /// Quantiles of the durations.
    pub fn quantiles(&self) -> Quantiles {
        Quantiles::of(&self.0)
    }

    /// Number of durations between each two adjacent edges [ns], in ascending order.
    pub fn counts(&self, edges: &[u64]) -> Vec<u64> {
        counts(&self.0, edges)
    }
}

/// Number of values between each two adjacent edges, in ascending order.
fn counts(histogram: &Histogram<u64>, edges: &[u64]) -> Vec<u64> {
    let mut counts = vec![0; edges.len().saturating_sub(1)];
    // Value by value: ranges of the library are rounded to its resolution.
    for value in histogram.iter_recorded() {
        let above = edges.partition_point(|edge| *edge <= value.value_iterated_to());
        if let Some(count) = above.checked_sub(1).and_then(|bin| counts.get_mut(bin)) {
            *count += value.count_at_value();
        }
    }
    counts
}

fn empty() -> Histogram<u64> {
    Histogram::new_with_bounds(1, LONGEST, 3).expect("bounds and digits that the library has")
}

impl Histograms {
    /// Empty histograms for these blocks.
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

    /// Takes all available records.
    pub fn take(&mut self, timings: &mut Timings) {
        timings.for_each(|timing| self.add(&timing));
    }

    fn add(&mut self, timing: &Timing) {
        self.lateness.saturating_record(timing.lateness.into());
        self.missed += u64::from(timing.missed);
        self.lost += u64::from(timing.lost);
        self.overruns.extend(timing.overrun);
        // A cycle that did not run has no durations.
        if timing.total > 0 {
            self.total.saturating_record(timing.total.into());
            self.spent.iter_mut().zip(timing.blocks).for_each(|(spent, time)| spent.saturating_record(time.into()));
        }
    }

    /// Lateness: from the deadline to the wake-up.
    pub fn lateness(&self) -> Quantiles {
        Quantiles::of(&self.lateness)
    }

    /// Duration of a cycle: from the wake-up to the end of the work.
    pub fn total(&self) -> Quantiles {
        Quantiles::of(&self.total)
    }

    /// Duration of each block.
    pub fn blocks(&self) -> impl Iterator<Item = (Block, Quantiles)> {
        self.blocks.iter().copied().zip(self.spent.iter().map(Quantiles::of))
    }

    /// The shortest cycle [ns], to three digits; 0 without cycles.
    pub fn shortest(&self) -> u64 {
        if self.total.is_empty() { 0 } else { self.total.min() }
    }

    /// Number of cycles with a duration between each two adjacent edges [ns], in ascending order.
    pub fn counts(&self, edges: &[u64]) -> Vec<u64> {
        counts(&self.total, edges)
    }

    /// Number of cycles with a lateness between each two adjacent edges [ns], in ascending order.
    pub fn lateness_counts(&self, edges: &[u64]) -> Vec<u64> {
        counts(&self.lateness, edges)
    }

    /// Fraction of the cycles that were later than `lateness` [ns].
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
            // Lateness 0 … 99.99 µs, each once, in mixed order.
            let mut timing =
                Timing { total: 500, ..Timing::start(cycle.into(), u64::from(cycle * 7919 % 10_000) * 10) };
            timing.blocks[0] = if cycle == 17 { 2_000_000 } else { 400 };
            histograms.add(&timing);
        }
        let near = |value: u64, expected: f64| assert!((value as f64 / expected - 1.0).abs() < 2e-3, "{value}");
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
    fn empty_histograms_give_zeros() {
        assert_eq!(Histograms::new(&[]).lateness(), Quantiles::default());
        assert_eq!(Histograms::new(&[]).later_than(0), 0.0);
    }
}
