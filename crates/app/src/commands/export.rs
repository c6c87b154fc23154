//! `stickslip export` and `stickslip recover`: recorded runs for other tools.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use stickslip::recording::export::{Part, export};
use stickslip::recording::mdf;
use stickslip::{Summary, Watch};

use crate::failure::Failure;
use crate::shown::Shown;

/// What to export, and into what.
#[derive(Args)]
pub(crate) struct ExportCommand {
    /// The run's file, the folder with its run.mf4, or its number in the catalogue.
    run: PathBuf,
    /// The file to write; its name ends with .csv, .parquet, .mat or .mcap.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// A signal; may be given several times, or several with commas. Without, all; `time` is always there.
    #[arg(long = "signal", short, value_name = "NAME", value_delimiter = ',')]
    signals: Vec<String>,
    /// From this time of the run on [s].
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// Until before this time [s].
    #[arg(long, value_name = "S")]
    until: Option<f64>,
    /// Of so many cycles one is kept.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

impl ExportCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let all = Part::default();
        let part = Part {
            signals: self.signals,
            from: self.from.unwrap_or(all.from),
            until: self.until.unwrap_or(all.until),
            every: self.every,
        };
        let exported = export(&file(&self.run)?, &self.out, &part, watch)?;
        let mut summary = Summary::new("export");
        summary
            .result("export.rows", exported.rows as f64, "1")
            .result("export.columns", exported.columns as f64, "1")
            .file(&self.out.display().to_string());
        let out_file = self.out.display();
        self.shown.show(out, &summary, |out| {
            Ok(writeln!(out, "{} rows of {} columns: {out_file}", exported.rows, exported.columns)?)
        })
    }
}

/// Which file.
#[derive(Args)]
pub(crate) struct RecoverCommand {
    /// The run's file, the folder with its run.mf4, or its number in the catalogue.
    run: PathBuf,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

impl RecoverCommand {
    pub(crate) fn run(self, out: &mut dyn Write) -> Result<(), Failure> {
        let recovered = mdf::recover(&file(&self.run)?)?;
        let mut summary = Summary::new("recover");
        summary
            .result("recover.rows", recovered.rows as f64, "1")
            .result("recover.bytes", recovered.bytes as f64, "bytes")
            .result("recover.discarded", recovered.discarded as f64, "bytes");
        self.shown.show(out, &summary, |out| {
            Ok(writeln!(out, "{} rows are whole; {} bytes were left aside.", recovered.rows, recovered.discarded)?)
        })
    }
}

/// A run's file, or the one in its folder; by its number in the catalogue, too.
pub(super) fn file(run: &Path) -> Result<PathBuf, Failure> {
    let run = super::runs::named(run)?;
    Ok(if run.is_dir() { run.join("run.mf4") } else { run })
}
