//! `stickslip validate`: an identified model simulated on another recording.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::identify::{read_model, validate};
use stickslip::machine::Machine;
use stickslip::{Watch, shell};

use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Model, machine and recording of the validation.
#[derive(Args)]
pub(crate) struct Validate {
    /// Recording that was not used for the fit: CSV, MAT, Parquet or MDF 4.
    recording: PathBuf,
    /// The model.toml of an identification.
    #[arg(long, value_name = "FILE")]
    model: PathBuf,
    /// Machine file: columns, units, drive, controller.
    #[arg(long, value_name = "FILE")]
    machine: PathBuf,
    /// Group (raster) of a recording with several [default: of the machine file, or the fastest one with its columns].
    #[arg(long, value_name = "NAME")]
    group: Option<String>,
    /// Folder for report.html, figures and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/validate")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl Validate {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        watch.stage("read", 0.0)?;
        let model = read_model(&self.model)?;
        let machine = Machine::read(&self.machine)?;
        let recording = machine.recording(&self.recording, self.group.as_deref())?;
        let group = self.group.as_ref().map_or(String::new(), |group| format!(" --group {}", shell::word(group)));
        let validation = validate(&recording, &model, &machine, watch)?;
        let command = format!(
            "stickslip validate {} --model {} --machine {}{group}",
            shell::path(&self.recording),
            shell::path(&self.model),
            shell::path(&self.machine)
        );
        let summary = validation.write(&machine, &recording, &command, &self.out)?;
        self.shown.show(out, &summary, |out| {
            writeln!(out, "{}", validation.verdict().replace('\u{a0}', " "))?;
            for note in validation.signals.findings.iter().chain(&validation.signals.notes) {
                writeln!(out, "  {note}")?;
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}
