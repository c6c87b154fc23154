//! How the clock was kept, for people and files.

use stickslip_rt::{Granted, Histograms, Overrun, Quantiles, Summary as Executed};

use super::cycle::BLOCKS;
use stickslip_base::Summary;
use stickslip_base::report::{Cell, Table};

/// How the clock was kept.
#[derive(Clone, Debug)]
pub struct TimingReport {
    /// What the executive says.
    pub summary: Executed,
    /// Lateness, and the time of each block.
    pub histograms: Histograms,
    /// Ticks through which a virtual machine waited for a command that was late.
    pub waited: u64,
    /// What the system granted.
    pub granted: Granted,
}

const QUANTILES: [&str; 4] = ["p50", "p99", "p999", "max"];

impl TimingReport {
    /// Name, words, and p50, p99, p99.9 and the longest [s] of lateness, whole cycle and blocks.
    fn distributions(&self) -> Vec<(String, String, [f64; 4])> {
        let seconds = |q: Quantiles| [q.p50, q.p99, q.p999, q.max].map(|nanoseconds| nanoseconds as f64 * 1e-9);
        let mut all = vec![
            ("lateness".into(), "from the deadline to the begin".into(), seconds(self.histograms.lateness())),
            ("cycle".into(), "from there to the end".into(), seconds(self.histograms.total())),
        ];
        let blocks = self.histograms.blocks();
        all.extend(blocks.map(|(block, spent)| (block.name.into(), format!("of it: {}", block.name), seconds(spent))));
        all
    }

    /// The numbers, under their stable names.
    pub fn tell(&self, summary: &mut Summary) {
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
    }

    /// Lateness and durations.
    pub fn table(&self) -> Table {
        let head = Table::new(["by the clock, µs", "p50", "p99", "p99.9", "longest"]);
        self.distributions().into_iter().fold(head, |table, (_, words, values)| {
            let micros = values.map(|value| Cell::Text(format!("{:.2}", 1e6 * value)));
            table.row([Cell::Text(words)].into_iter().chain(micros))
        })
    }

    /// What a reader should know of it, each with a remedy.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Some(worst) = self.summary.worst {
            warnings.push(format!(
                "{} deadlines of {} were missed and {} cycles held, while set-point and voltages stood. The worst: {} \
                 See what `stickslip doctor` finds.",
                self.summary.overruns,
                self.summary.cycles,
                self.summary.missed,
                worst.sentence(&BLOCKS)
            ));
        }
        if self.waited > 0 {
            warnings.push(format!(
                "The virtual machine waited {} of {} cycles for commands that were late: the experiment took longer than \
                 by its clock, its results are the same. Machines of steel do not wait. Close other programs, and see \
                 what `stickslip doctor` finds.",
                self.waited, self.summary.cycles,
            ));
        }
        warnings.extend(refusals(&self.granted));
        warnings
    }
}

/// Why a deadline was missed, with the names of the blocks of a bench.
pub fn overrun_sentence(overrun: &Overrun) -> String {
    overrun.sentence(&BLOCKS)
}

/// What the system refused, each with what it costs and how to mend it.
pub fn refusals(granted: &Granted) -> Vec<String> {
    let mut refusals = Vec::new();
    for refused in granted.refused() {
        let mend = refused.wish.mend().map_or(String::new(), |mend| format!(" To mend it: {mend}"));
        refusals.push(format!("The system refuses {}. {}{mend}", refused.wish, refused.wish.costs()));
    }
    refusals
}
