//! `stickslip doctor`: the real-time settings of this computer, and how late cycles start on it.

mod network;

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use stickslip::Watch;
use stickslip::bench::remote::Address;
use stickslip::realtime::{Checkup, Examination, Finding, NOT_REPORTED, Outcome, Verdict};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source;

/// Duration, rate and output of the check.
#[derive(Args)]
pub(crate) struct DoctorCommand {
    /// Total time of the measurement [s]. Rare delays show in long measurements only, for example over a night.
    #[arg(long, value_name = "S", default_value_t = Checkup::default().seconds)]
    seconds: f64,
    /// Rate of the cycles [Hz].
    #[arg(long, value_name = "HZ", default_value_t = Checkup::default().rate)]
    rate: f64,
    /// Also examine a network card for EtherCAT: link, driver, interrupt coalescing, permission, addresses, and the devices
    /// that answer. They are scanned, and leave operation, only if the card has a link and no address.
    #[arg(long, value_name = "ethercat:INTERFACE")]
    io: Option<Address>,
    /// Folder for figure, report and summary.json [default: no files].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl DoctorCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let checkup = Checkup { rate: self.rate, seconds: self.seconds };
        let card = self.io.as_ref().map(network::findings).transpose()?;
        let mut examination = checkup.examine(Path::new("/"), watch)?;
        examination.findings.extend(card.into_iter().flatten());
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

/// Prints the findings that cost determinism, with remedies; the good and the unknown ones, a line each; the measurement.
fn show(examination: &Examination, out: &mut dyn Write) -> Result<(), Failure> {
    let of = |verdict: Verdict| examination.findings.iter().filter(move |finding| finding.verdict == verdict);
    let mut printed = BTreeSet::new();
    let mut write_remedy = |out: &mut dyn Write, text: Option<String>| match text {
        // A remedy for two findings is printed once.
        Some(text) if printed.insert(text.clone()) => writeln!(out, "    {text}"),
        _ => Ok(()),
    };
    for Finding { what, found, costs, remedy, .. } in of(Verdict::Costs) {
        writeln!(out, "{what}: {found}. {costs}")?;
        write_remedy(out, remedy.clone())?;
    }
    let list = |findings: Vec<String>| findings.join(", ");
    let good = list(of(Verdict::Good).map(|finding| format!("{} ({})", finding.what, finding.found)).collect());
    let reason = |finding: &Finding| match finding.found.as_str() {
        NOT_REPORTED => finding.what.to_string(),
        found => format!("{} ({found})", finding.what),
    };
    let unknown = list(of(Verdict::Unknown).map(reason).collect());
    for (name, text) in [("Good", good), ("Unknown", unknown)] {
        if !text.is_empty() {
            writeln!(out, "{name}: {text}.")?;
        }
    }
    writeln!(out)?;
    let rate = examination.checkup.rate;
    let granted = examination.granted();
    let names = granted.granted().map(|outcome| outcome.setting.to_string()).collect();
    writeln!(out, "Measured at {rate} Hz on a thread with: {}.", list(names))?;
    for Outcome { setting, refused } in granted.refused() {
        writeln!(
            out,
            "Refused by the system: {setting} ({}). {}",
            refused.as_deref().unwrap_or_default(),
            setting.costs()
        )?;
        write_remedy(out, setting.remedy())?;
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
