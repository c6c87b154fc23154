//! `stickslip identify`: inertia and friction of an axis from a recording.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use stickslip::identify::{Identification, ParameterLine, identify, parameter_lines, write};
use stickslip::machine::Machine;
use stickslip::quantity::number;
use stickslip::recording::Recording;
use stickslip::{Summary, Watch};

use crate::failure::Failure;
use crate::shown::Shown;

/// What to identify.
#[derive(Args)]
pub(crate) struct Identify {
    /// Recording: CSV (a header, then one row a sample; may be gzipped), MAT or Parquet.
    recording: PathBuf,
    /// What is known of the machine: columns, units, drive, controller. `stickslip machine init` writes one.
    #[arg(long, value_name = "FILE")]
    machine: PathBuf,
    /// Folder for report.html, figures, model.toml, feedforward.csv and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/identify")]
    out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

impl Identify {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        watch.stage("read", 0.0)?;
        let machine = Machine::read(&self.machine)?;
        let recording = Recording::read(&self.recording)?;
        let found = identify(&recording, &machine, watch)?;
        watch.stage("write", 0.0)?;
        let command = format!("stickslip identify {} --machine {}", self.recording.display(), self.machine.display());
        let summary = write(&found, &machine, &recording, &command, &self.out)?;
        self.shown.show(out, &summary, |out| {
            show(&found, &summary, &machine, out)?;
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}

fn show(found: &Identification, summary: &Summary, machine: &Machine, out: &mut dyn Write) -> io::Result<()> {
    let heads = ["A friction for each direction:", "One friction for both directions, and an offset:"];
    for (head, lines) in heads.into_iter().zip(parameter_lines(summary, machine)) {
        writeln!(out, "{head}")?;
        for ParameterLine { name, identified, published } in lines {
            let published = published.map_or(String::new(), |p| format!("   published {p}"));
            writeln!(out, "  {name:36} {identified}{published}")?;
        }
    }
    writeln!(out, "What this recording cannot tell:")?;
    for limit in found.limits() {
        writeln!(out, "  {limit}")?;
    }
    writeln!(out, "Error on halves of the recording that the fit has not seen:")?;
    for candidate in &found.candidates {
        let best = if candidate.kind == found.best().kind { "   best" } else { "" };
        writeln!(out, "  {:44} {} %{best}", candidate.kind.title(), number(100.0 * candidate.held_out, 2))?;
    }
    Ok(())
}
