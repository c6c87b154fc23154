//! `stickslip study`: parameters changed on the virtual bench.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::Watch;
use stickslip::study::{read, run_study};

use crate::failure::Failure;
use crate::shown::Shown;
use crate::source;

/// A study, and where it goes.
#[derive(Args)]
pub(crate) struct Study {
    /// The study: machine, controller, manoeuvres, axes and design, in TOML.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Threads that share the work; as many as there are processors. The numbers do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Folder for study.parquet, report and summary.json. What is finished lies in parts; the same command goes on from
    /// there.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/study")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

impl Study {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let mut plan = read(&self.file)?;
        if self.threads > 0 {
            plan.threads = self.threads;
        }
        let findings = run_study(&plan, &self.out, watch)?.findings()?;
        let summary = findings.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            writeln!(out, "{}", findings.sentences())?;
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}
