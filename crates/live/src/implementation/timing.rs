//! Execution times of the cycles.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_rt::{Histograms, Quantiles};

use stickslip_bench::bins::{TimeBin, bars};
use stickslip_bench::overrun_sentence;

/// Bars of a histogram in a decade of time.
const DECADE: f64 = 16.0;
/// Maximum number of listed overruns.
const LISTED: usize = 20;

/// Execution times of the cycles. Times in seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Timing {
    /// Period of the cycles: the available time.
    pub period: f64,
    /// Number of counted cycles.
    pub cycles: u64,
    /// Histogram of the whole cycle, from its wake-up to the end of its work.
    pub bins: Vec<TimeBin>,
    /// Lateness, the whole cycle, and its parts in their order.
    pub parts: Vec<TimedPart>,
    /// Number of missed deadlines.
    pub overruns: u64,
    /// The last cycles that missed their deadline, the newest first.
    pub late: Vec<LateCycle>,
    /// Number of cycles missed because of them.
    pub missed: u64,
}

/// Execution time of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TimedPart {
    /// Name of the part.
    pub name: String,
    /// Median [s].
    pub median: f64,
    /// 99.9th percentile [s].
    pub p999: f64,
    /// Longest time [s].
    pub longest: f64,
}

/// A cycle that missed its deadline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LateCycle {
    /// Number of the cycle.
    pub cycle: u64,
    /// Time after the deadline [s].
    pub by: f64,
    /// Cause, in a sentence.
    pub sentence: String,
}

impl Timing {
    pub(crate) fn of(histograms: &Histograms, rate: f64) -> Self {
        let seconds = |nanoseconds: u64| nanoseconds as f64 * 1e-9;
        let part = |name: &str, times: Quantiles| TimedPart {
            name: name.into(),
            median: seconds(times.p50),
            p999: seconds(times.p999),
            longest: seconds(times.max),
        };
        let total = histograms.total();
        let mut parts = vec![part("lateness", histograms.lateness()), part("whole cycle", total)];
        parts.extend(histograms.blocks().map(|(block, times)| part(block.name, times)));
        let period = 1.0 / rate;
        let edges = edges(histograms.shortest(), total.max.max((period * 1e9) as u64));
        let late = histograms.overruns.iter().rev().take(LISTED);
        Timing {
            period,
            cycles: total.count,
            bins: bars(&edges, histograms.counts(&edges)),
            parts,
            overruns: histograms.overruns.len() as u64,
            late: late
                .map(|one| LateCycle { cycle: one.cycle, by: one.by as f64 * 1e-9, sentence: overrun_sentence(one) })
                .collect(),
            missed: histograms.missed,
        }
    }
}

/// Edges of bars of equal width on a logarithmic scale, over the whole range [ns].
fn edges(shortest: u64, longest: u64) -> Vec<u64> {
    let place = |time: u64| (time.max(1) as f64).log10() * DECADE;
    let (first, last) = (place(shortest).floor() as i64, place(longest).floor() as i64 + 1);
    let edge = |step: i64| 10f64.powf(step as f64 / DECADE) as u64;
    let mut edges: Vec<u64> = (first..=last).map(edge).collect();
    edges.dedup();
    // The ends may be too narrow by rounding.
    edges[0] = edges[0].min(shortest);
    edges.push((longest + 1).max(edge(last + 1)));
    edges.dedup();
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_cover_every_time() {
        let edges = edges(1_234, 987_654);
        assert!(edges[0] <= 1_234 && edges.last().is_some_and(|edge| *edge > 987_654), "{edges:?}");
        assert!(edges.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(super::edges(0, 0).len() >= 2);
    }
}
