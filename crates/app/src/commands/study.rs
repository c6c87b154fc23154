//! `stickslip study`: parameters varied on the virtual bench.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::Watch;
use stickslip::quantity::rough;
use stickslip::study::{read, run_study};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source;

/// File and output of a study.
#[derive(Args)]
pub(crate) struct Study {
    /// File of the study (TOML): machine, controller, manoeuvres, axes and design.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Number of threads [default: all processors]. Results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Folder for study.parquet, report and summary.json. Finished parts are in its folder parts; the same command
    /// resumes.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/study")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

/// Simulated time above which a study is announced [s]: it runs for minutes before its first result.
const LONG: f64 = 1800.0;

impl Study {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let mut plan = read(&self.file)?;
        if self.threads > 0 {
            plan.threads = self.threads;
        }
        let time = plan.simulated_time()?;
        if time > LONG {
            let cases = plan.cases()?;
            let line = format!(
                "Cases: {cases}; simulated time: {} h. Ctrl-C stops, the same command resumes.",
                rough(time / 3600.0)
            );
            self.shown.print_line(out, &line)?;
        }
        let findings = run_study(&plan, &self.out, watch)?.findings()?;
        let summary = findings.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            writeln!(out, "{}", findings.sentences())?;
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}
