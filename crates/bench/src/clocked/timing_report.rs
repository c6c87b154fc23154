//! Timing report of a real-time run.

use stickslip_rt::{Granted, Histograms, Overrun, Quantiles, Summary as Executed};

use super::cycle::BLOCKS;
use crate::bins::{self, TimeBin, logarithmic};
use crate::segment::SegmentStatus;
use stickslip_base::Summary;
use stickslip_base::report::{Cell, Table};

/// Timing report of a real-time run.
#[derive(Clone, Debug)]
pub struct TimingReport {
    /// Summary of the executive.
    pub summary: Executed,
    /// Distributions of lateness and block durations.
    pub histograms: Histograms,
    /// Number of ticks that a virtual machine waited for late commands.
    pub waited: u64,
    /// Granted and refused thread settings.
    pub granted: Granted,
    /// State of the segment at the end, if the machine is on a fieldbus.
    pub segment: Option<SegmentStatus>,
}

const QUANTILES: [&str; 4] = ["p50", "p99", "p999", "max"];

impl TimingReport {
    /// Name, label, and p50, p99, p99.9 and maximum [s] of lateness, whole cycle, blocks and frames.
    fn distributions(&self) -> Vec<(String, String, [f64; 4])> {
        let seconds = |q: Quantiles| [q.p50, q.p99, q.p999, q.max].map(|nanoseconds| nanoseconds as f64 * 1e-9);
        let mut all = vec![
            ("lateness".into(), "from the deadline to the start".into(), seconds(self.histograms.lateness())),
            ("cycle".into(), "from the start to the end".into(), seconds(self.histograms.total())),
        ];
        let blocks = self.histograms.blocks();
        all.extend(
            blocks.map(|(block, spent)| (block.name.into(), format!("of which {}", block.name), seconds(spent))),
        );
        if let Some(segment) = &self.segment {
            all.push(("frame_distance".into(), "frame from the middle between two SYNC0".into(), segment.distance));
            all.push(("frame_round_trip".into(), "frame from sending to receiving".into(), segment.round_trip));
        }
        all
    }

    /// Name, label and bars of the histograms of lateness, whole cycle and frames.
    fn histograms(&self) -> Vec<(&'static str, &'static str, Vec<TimeBin>)> {
        let lateness = logarithmic(|edges| self.histograms.lateness_counts(edges));
        let cycle = logarithmic(|edges| self.histograms.counts(edges));
        let mut all = vec![
            ("lateness", "from the deadline to the start", lateness),
            ("cycle", "from the start to the end", cycle),
        ];
        if let Some(segment) = &self.segment {
            all.push(("frame_distance", "frame from the middle between two SYNC0", segment.distance_bins.clone()));
            all.push(("frame_round_trip", "frame from sending to receiving", segment.round_trip_bins.clone()));
        }
        all
    }

    /// Adds the results under their stable names, and the histograms as rows.
    pub fn add_to(&self, summary: &mut Summary) {
        summary
            .result("timing.cycles", self.summary.cycles as f64, "1")
            .result("timing.missed", self.summary.missed as f64, "1")
            .result("timing.overruns", self.summary.overruns as f64, "1")
            .result("timing.waited", self.waited as f64, "1")
            .result("timing.lost", self.histograms.lost as f64, "1");
        for (name, _, values) in self.distributions() {
            for (quantile, value) in QUANTILES.iter().zip(values) {
                summary.result(&format!("timing.{name}.{quantile}"), value, "s");
            }
        }
        for (name, _, bins) in self.histograms() {
            bins::add_rows(summary, name, &bins);
        }
        self.segment.iter().for_each(|segment| segment.add_to(summary));
    }

    /// Table of lateness and durations.
    pub fn table(&self) -> Table {
        let head = Table::new(["timing, µs", "p50", "p99", "p99.9", "longest"]);
        self.distributions().into_iter().fold(head, |table, (_, words, values)| {
            let micros = values.map(|value| Cell::Text(format!("{:.2}", 1e6 * value)));
            table.row([Cell::Text(words)].into_iter().chain(micros))
        })
    }

    /// Table of the histograms: number of values up to each edge.
    pub fn histogram_table(&self) -> Table {
        let histograms = self.histograms();
        let mut edges: Vec<f64> = histograms.iter().flat_map(|(.., bins)| bins.iter().map(|bin| bin.to)).collect();
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let head = Table::new(["up to, µs"].into_iter().chain(histograms.iter().map(|(_, label, _)| *label)));
        edges.into_iter().fold(head, |table, edge| {
            let count = |bins: &[TimeBin]| bins.iter().find(|bin| bin.to == edge).map_or(0, |bin| bin.count);
            let counts = histograms.iter().map(|(.., bins)| Cell::Text(count(bins).to_string()));
            table.row([Cell::Text(format!("{:.0}", 1e6 * edge))].into_iter().chain(counts))
        })
    }

    /// Warnings, each with a remedy.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Some(worst) = self.summary.worst {
            warnings.push(format!(
                "{} deadlines of {} were missed and {} cycles were held, with constant set-point and voltages. Worst \
                 case: {} Run `stickslip doctor`.",
                self.summary.overruns,
                self.summary.cycles,
                self.summary.missed,
                worst.sentence(&BLOCKS)
            ));
        }
        if self.waited > 0 {
            warnings.push(format!(
                "The virtual machine waited for late commands in {} of {} cycles. Results are unchanged, but the \
                 experiment took longer than real time. Physical hardware does not wait. Close other programs, and run \
                 `stickslip doctor`.",
                self.waited, self.summary.cycles,
            ));
        }
        warnings.extend(refusals(&self.granted));
        warnings
    }
}

/// Cause of a missed deadline, with the names of the blocks of a bench.
pub fn overrun_sentence(overrun: &Overrun) -> String {
    overrun.sentence(&BLOCKS)
}

/// Refused thread settings, each with effect and remedy.
pub fn refusals(granted: &Granted) -> Vec<String> {
    let mut refusals = Vec::new();
    for refused in granted.refused() {
        let remedy = refused.setting.remedy().map_or(String::new(), |remedy| format!(" Remedy: {remedy}"));
        refusals.push(format!("The system refuses {}. {}{remedy}", refused.setting, refused.setting.costs()));
    }
    refusals
}
