//! `stickslip export` and `stickslip recover`: recorded runs for other tools.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use stickslip::recording::export::{Part, export};
use stickslip::recording::mdf;
use stickslip::{Summary, Watch};

use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Run, signals and file of an export.
#[derive(Args)]
pub(crate) struct ExportCommand {
    /// The run's file, the folder with its run.mf4, or its number in the catalogue.
    run: PathBuf,
    /// File to write; the ending .csv, .parquet, .mat or .mcap selects the format.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Name of a signal; may be given several times, or several names with commas [default: all]. `time` is always
    /// included.
    #[arg(long = "signal", short, value_name = "NAME", value_delimiter = ',')]
    signals: Vec<String>,
    /// Start time within the run [s].
    #[arg(long, value_name = "S")]
    from: Option<f64>,
    /// End time within the run, excluded [s].
    #[arg(long, value_name = "S")]
    until: Option<f64>,
    /// Decimation: one of N cycles is exported.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
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

/// Run to recover.
#[derive(Args)]
pub(crate) struct RecoverCommand {
    /// The run's file, the folder with its run.mf4, or its number in the catalogue.
    run: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
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
            Ok(writeln!(out, "{} complete rows; {} bytes discarded.", recovered.rows, recovered.discarded)?)
        })
    }
}

/// The file of a run, from a file, a folder, or a number in the catalogue.
pub(super) fn file(run: &Path) -> Result<PathBuf, Failure> {
    let run = super::runs::run_path(run)?;
    Ok(if run.is_dir() { run.join("run.mf4") } else { run })
}
