//! `stickslip identify`: inertia and friction of an axis from a recording.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::Watch;
use stickslip::identify::{ASYMMETRIC, Identification, SYMMETRIC, identify, write};
use stickslip::machine::Machine;
use stickslip::recording::Recording;

use crate::failure::Failure;

/// What to identify.
#[derive(Args)]
pub(crate) struct Identify {
    /// CSV file, may be gzipped: a header, then one row a sample.
    recording: PathBuf,
    /// What is known of the machine: columns, units, drive gain, controller.
    #[arg(long, value_name = "FILE")]
    machine: PathBuf,
    /// Folder for model.toml, feedforward.csv and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/identify")]
    out: PathBuf,
}

impl Identify {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        watch.stage("read", 0.0)?;
        let machine = Machine::read(&self.machine)?;
        let recording = Recording::read(&self.recording)?;
        let found = identify(&recording, &machine, watch)?;
        watch.stage("write", 0.0)?;
        write(&found, &machine, &self.out)?;
        Ok(show(&found, &machine, out)?)
    }
}

fn show(found: &Identification, machine: &Machine, out: &mut dyn Write) -> std::io::Result<()> {
    let least_squares =
        [("symmetric", &SYMMETRIC[..], &found.symmetric.fit), ("asymmetric", &ASYMMETRIC[..], &found.asymmetric.fit)];
    for (table, names, fit) in least_squares {
        writeln!(out, "{table}, force error {:.2} %", 100.0 * fit.relative_error)?;
        for ((name, value), [low, high]) in names.iter().zip(&fit.coefficients).zip(&fit.ci95) {
            let published = machine.published.get(table).and_then(|t| t.get(*name)).and_then(|v| v.first());
            let beside = published.map_or(String::new(), |p| format!("   published {p}"));
            writeln!(out, "  {name:18} {value:10.4}   {low:.4} … {high:.4}{beside}")?;
        }
    }
    for (side, verdict) in ["positive", "negative"].into_iter().zip(found.stribeck_verdicts()) {
        writeln!(out, "{side}: {verdict}")?;
    }
    for candidate in &found.candidates {
        let best = if candidate.kind == found.best().kind { "   <- best" } else { "" };
        let seen = candidate.prediction.map_or(String::new(), |p| {
            format!(", whole recording {:.2} %, position {:.3e} rms", 100.0 * p.voltage_error, p.position_rms)
        });
        let held_out = 100.0 * candidate.held_out;
        writeln!(out, "{:10} error on held-out half {held_out:.2} %{seen}{best}", candidate.kind.name())?;
    }
    Ok(())
}
