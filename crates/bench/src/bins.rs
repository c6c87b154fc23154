//! Histograms of times with the same logarithmic edges in each run, so that counts can be compared and added.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use stickslip_base::Summary;

/// Edges in a decade.
const DECADE: [u64; 3] = [1, 2, 5];
/// Decades from 1 µs on [ns]; the last edge, 5 s, is above the longest time that is resolved.
const DECADES: [u64; 7] = [1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000];

/// A bar of a histogram.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TimeBin {
    /// Lower edge [s].
    pub from: f64,
    /// Upper edge, exclusive [s].
    pub to: f64,
    /// Number of values.
    pub count: u64,
}

/// The bars between adjacent edges [ns].
pub fn bars(edges: &[u64], counts: impl IntoIterator<Item = u64>) -> Vec<TimeBin> {
    let seconds = |nanoseconds: u64| nanoseconds as f64 * 1e-9;
    let pairs = edges.windows(2).zip(counts);
    pairs.map(|(edge, count)| TimeBin { from: seconds(edge[0]), to: seconds(edge[1]), count }).collect()
}

/// The bars with the edges 1, 2, 5, 10 µs … , from the first to the last that is not empty. `counts` counts the values
/// between edges [ns].
pub(crate) fn logarithmic(counts: impl FnOnce(&[u64]) -> Vec<u64>) -> Vec<TimeBin> {
    let edges: Vec<u64> = [0].into_iter().chain(DECADES.iter().flat_map(|&unit| DECADE.map(|n| n * unit))).collect();
    let bars = bars(&edges, counts(&edges));
    let filled = |bin: &TimeBin| bin.count > 0;
    let (Some(first), Some(last)) = (bars.iter().position(filled), bars.iter().rposition(filled)) else {
        return Vec::new();
    };
    bars[first..=last].to_vec()
}

/// Adds the bars of a histogram as rows.
pub(crate) fn add_rows(summary: &mut Summary, name: &str, bins: &[TimeBin]) {
    for TimeBin { from, to, count } in bins {
        let cells: [(&str, Value); 4] =
            [("histogram", name.into()), ("from", (*from).into()), ("to", (*to).into()), ("count", (*count).into())];
        summary.row(cells);
    }
}

/// The bars in a line: `12 up to 2 µs, 30 up to 5 µs`.
pub(crate) fn line(bins: &[TimeBin]) -> String {
    let words = bins.iter().map(|bin| format!("{} up to {:.0} µs", bin.count, 1e6 * bin.to));
    words.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use stickslip_rt::Durations;

    use super::*;

    #[test]
    fn each_value_is_in_the_bar_between_its_edges() {
        let mut durations = Durations::default();
        for nanoseconds in [0, 999, 1_500, 3_000, 4_000, 250_000, u64::MAX] {
            durations.add(nanoseconds);
        }
        let bins = logarithmic(|edges| durations.counts(edges));
        let of = |to: f64| bins.iter().find(|bin| (bin.to - to).abs() < 1e-12).map(|bin| bin.count);
        assert_eq!([of(1e-6), of(2e-6), of(5e-6), of(1e-5), of(5e-4)], [2, 1, 2, 0, 1].map(Some));
        assert_eq!(bins.iter().map(|bin| bin.count).sum::<u64>(), 7);
        assert_eq!(bins.last().map(|bin| bin.to), Some(5.0));
        assert!(line(&bins).starts_with("2 up to 1 µs, 1 up to 2 µs, 2 up to 5 µs, 0 up to 10 µs"), "{}", line(&bins));
        assert!(logarithmic(|edges| Durations::default().counts(edges)).is_empty());
    }
}
