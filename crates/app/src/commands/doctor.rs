//! `stickslip doctor`: what this machine does with a deadline.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use stickslip::Watch;
use stickslip::realtime::{Checkup, Examination, Finding, Outcome, Verdict};

use crate::failure::Failure;
use crate::shown::Shown;
use crate::source;

/// How to look at the machine.
#[derive(Args)]
pub(crate) struct DoctorCommand {
    /// How long to measure, all together [s]. Rare holes take their time to show: a night tells more.
    #[arg(long, value_name = "S", default_value_t = Checkup::default().seconds)]
    seconds: f64,
    /// Cycles a second [Hz].
    #[arg(long, value_name = "HZ", default_value_t = Checkup::default().rate)]
    rate: f64,
    /// Folder for figure, report and summary.json; without, nothing is written.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

impl DoctorCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let checkup = Checkup { rate: self.rate, seconds: self.seconds };
        let examination = checkup.examine(Path::new("/"), watch)?;
        let summary = match &self.out {
            Some(folder) => examination.write(folder, &source::command_line())?,
            None => examination.summary(),
        };
        self.shown.show(out, &summary, |out| {
            show(&examination, out)?;
            if let Some(folder) = &self.out {
                writeln!(out, "Report with figure: {}", folder.join("report.html").display())?;
            }
            Ok(())
        })
    }
}

/// What costs, with its remedy; then what is good and what is not known, in a line each; then the measurement.
fn show(examination: &Examination, out: &mut dyn Write) -> Result<(), Failure> {
    let of = |verdict: Verdict| examination.findings.iter().filter(move |finding| finding.verdict == verdict);
    let mut said = BTreeSet::new();
    let mut remedy = |out: &mut dyn Write, mend: Option<String>| match mend {
        // What mends two things is said once.
        Some(mend) if said.insert(mend.clone()) => writeln!(out, "    {mend}"),
        _ => Ok(()),
    };
    for Finding { what, found, costs, mend, .. } in of(Verdict::Costs) {
        writeln!(out, "{what}: {found}. {costs}")?;
        remedy(out, mend.clone())?;
    }
    let list = |findings: Vec<String>| findings.join(", ");
    let good = list(of(Verdict::Good).map(|finding| format!("{} ({})", finding.what, finding.found)).collect());
    let unknown = list(of(Verdict::Unknown).map(|finding| finding.what.to_string()).collect());
    for (name, text) in [("Good", good), ("Not told by the system", unknown)] {
        if !text.is_empty() {
            writeln!(out, "{name}: {text}.")?;
        }
    }
    writeln!(out)?;
    let rate = examination.checkup.rate;
    let granted = examination.granted();
    let names = granted.granted().map(|outcome| outcome.wish.to_string()).collect();
    writeln!(out, "Measured at {rate} Hz on a thread with: {}.", list(names))?;
    for Outcome { wish, refused } in granted.refused() {
        writeln!(out, "Refused: {wish} ({}). {}", refused.as_deref().unwrap_or_default(), wish.costs())?;
        remedy(out, wish.mend())?;
    }
    writeln!(out)?;
    for line in examination.table().lines() {
        writeln!(out, "{line}")?;
    }
    for (name, wake_up) in [("asleep", &examination.asleep), ("spinning", &examination.spinning)] {
        let run = &wake_up.summary;
        if run.overruns > 0 {
            writeln!(out, "Note: {name}, {} of {} cycles were missed.", run.missed, run.cycles + run.missed)?;
        }
    }
    Ok(())
}
