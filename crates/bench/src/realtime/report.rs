//! Report of an examination: numbers, table, figure, page.

use std::path::Path;

use stickslip_rt::Quantiles;

use super::{Examination, Finding, Verdict, WakeUp};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Provenance, Report, Table};
use stickslip_base::{Error, Summary};

const NAME: &str = "lateness.svg";

impl Examination {
    /// The numbers, with their stable names.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new("doctor");
        for verdict in [Verdict::Good, Verdict::Costs, Verdict::Unknown] {
            summary.result(&format!("doctor.{}", word(verdict)), self.count(verdict) as f64, "1");
        }
        summary.result("doctor.refused", self.granted().refused().count() as f64, "1");
        summary.result("timing.floor.watched", self.floor.watched, "s");
        summary.result("timing.rate", self.checkup.rate, "Hz");
        for (name, _, quantiles) in self.distributions() {
            for (quantile, value) in QUANTILES.iter().zip(quantiles) {
                summary.result(&format!("timing.{name}.{quantile}"), value, "s");
            }
        }
        for (name, WakeUp { summary: run, histograms, .. }) in [("asleep", &self.asleep), ("spinning", &self.spinning)]
        {
            summary
                .result(&format!("timing.{name}.cycles"), run.cycles as f64, "1")
                .result(&format!("timing.{name}.missed"), run.missed as f64, "1")
                .result(&format!("timing.{name}.lost"), histograms.lost as f64, "1");
        }
        for Finding { what, found, verdict, .. } in &self.findings {
            let verdict = word(*verdict);
            summary.row([("what", (*what).into()), ("found", found.as_str().into()), ("verdict", verdict.into())]);
        }
        summary
    }

    /// Name, label, and p50, p99, p99.9 and longest [s] of floor and both wake-ups.
    fn distributions(&self) -> [(&'static str, String, [f64; 4]); 3] {
        let floor = [0.5, 0.99, 0.999].map(|part| self.floor.quantile(part));
        let wake_up = |wake_up: &WakeUp| {
            let Quantiles { p50, p99, p999, max, .. } = wake_up.histograms.lateness();
            [p50, p99, p999, max].map(|time| time as f64 * 1e-9)
        };
        let spun = format!("asleep, spinning for the last {} µs", self.spinning.spin.as_micros());
        [
            ("floor", "the machine itself".into(), [floor[0], floor[1], floor[2], self.floor.longest()]),
            ("asleep", "the executive, asleep until its deadline".into(), wake_up(&self.asleep)),
            ("spinning", format!("the executive, {spun}"), wake_up(&self.spinning)),
        ]
    }

    /// Lateness of the machine itself and of both wake-ups.
    pub fn table(&self) -> Table {
        let head = Table::new(["lateness in µs", "p50", "p99", "p99.9", "longest"]);
        self.distributions().into_iter().fold(head, |table, (_, words, values)| {
            let micros = values.map(|value| Cell::Text(format!("{:.2}", value * 1e6)));
            table.row([Cell::Text(words)].into_iter().chain(micros))
        })
    }

    /// Number of late cycles in a million over the lateness.
    pub fn figure(&self) -> Figure {
        let longest = self.distributions().iter().map(|(_, _, values)| values[3]).fold(1e-6, f64::max);
        let steps = || (0..).map(|step| 1e-8 * 1.05f64.powi(step)).take_while(move |time| *time < 1.1 * longest);
        let of_wake_up = |wake_up: &WakeUp| -> Vec<(f64, f64)> {
            let later = |time: f64| 1e6 * wake_up.histograms.later_than((time * 1e9) as u64);
            steps().map(|time| (time * 1e6, later(time))).collect()
        };
        let floor = steps().filter(|time| *time >= 1e-6);
        let floor = floor.map(|time| (time * 1e6, 1e6 * self.floor.later_than(time)));
        Figure::new("Distribution of the lateness")
            .x(Axis::new("lateness in µs", "1").stretched())
            .y(Axis::new("cycles of a million that are later", "1").stretched().range(0.0, 1e6))
            .series(Series::line(Role::Reference, "the machine itself", floor))
            .series(Series::line(Role::Trace(0), "asleep until the deadline", of_wake_up(&self.asleep)))
            .series(Series::line(Role::Trace(1), "spinning at the end", of_wake_up(&self.spinning)))
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let [(.., floor), (.., asleep), (.., spinning)] = self.distributions();
        let time = |value: f64| Estimate::new(value, "s");
        let rate = Estimate::new(self.checkup.rate, "Hz");
        let report = Report::new("Real-time performance of this machine", Provenance::new(command, None, ""))
            .summary(format!(
                "At {rate} the executive woke up within {} in 99\u{a0}% of its cycles when asleep, and within {} when \
                 spinning before its deadline. The longest hole of the machine itself was {}; longer ones are possible \
                 at any time.",
                time(asleep[1]),
                time(spinning[1]),
                time(floor[3]),
            ))
            .key("lateness asleep, p99", time(asleep[1]))
            .key("lateness spinning, p99", time(spinning[1]))
            .key("longest hole", time(floor[3]))
            .heading("Lateness")
            .table(self.table().caption(
                "Time from the deadline to the wake-up. For the machine itself: lateness of an ideal executive, from the \
                 holes in a thread that only reads the clock.",
            ))
            .figure(
                self.figure(),
                "Number of cycles in a million with a larger lateness. Both axes are linear up to 2 and logarithmic \
                 beyond.",
            )
            .heading("Set-up");
        let cell = |text: &str| Cell::Text(text.into());
        let head = Table::new(["what", "found", "verdict"]);
        let findings = self.findings.iter().fold(head, |table, Finding { what, found, verdict, .. }| {
            table.row([cell(what), cell(found), cell(word(*verdict))])
        });
        let costs = self.findings.iter().filter(|finding| finding.verdict == Verdict::Costs);
        let costs = costs.map(|Finding { what, costs, remedy, .. }| match remedy {
            Some(remedy) => format!("{what}: {costs} Remedy: {remedy}"),
            None => format!("{what}: {costs}"),
        });
        let granted = self.granted().to_string();
        report
            .table(findings.caption("Settings that affect the deadlines."))
            .list(costs)
            .paragraph("Requested settings of the measured thread:")
            .list(granted.lines())
    }

    /// Writes figure, report and summary into a folder.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, directory: &Path, command: &str) -> Result<Summary, Error> {
        self.report(command).write_all(self.summary(), [(NAME, &self.figure())], directory)
    }
}

/// Names of the values of a distribution.
const QUANTILES: [&str; 4] = ["p50", "p99", "p999", "max"];

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "good",
        Verdict::Costs => "costs",
        Verdict::Unknown => "unknown",
    }
}
