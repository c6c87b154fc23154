//! `stickslip fidelity`: whether a controller notices that its friction is rendered.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use stickslip::Watch;
use stickslip::fidelity::{Selection, run_plan};

use crate::failure::Failure;
use crate::shown::Shown;
use crate::source;

/// What to compare. Without any of the selections all that the benchmark has; each may be given several times.
#[derive(Args)]
pub(crate) struct Fidelity {
    /// The short benchmark: the paper's law and the picked one, in closed loop, 3 seeds.
    #[arg(long)]
    quick: bool,
    /// How many noise seeds a cell has; 10, or 3 with --quick.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: Option<u64>,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE")]
    preset: Vec<String>,
    /// Name of a law: paper, smooth, karnopp, bristle, residual, residual_slow, admittance, admittance_slow; auto is the one that the bench picks.
    #[arg(long, value_name = "NAME")]
    law: Vec<String>,
    /// Rate of sensors, observer, law and current control.
    #[arg(long, value_name = "HZ")]
    rate: Vec<f64>,
    /// Only with the friction wheel pressed on, or only with it released.
    #[arg(long, value_name = "STATE")]
    wheel: Option<Linings>,
    /// How the machine differs from the model: perfect, real, own+10%, gaussian, kt-2%, …
    #[arg(long, value_name = "NAME")]
    mismatch: Vec<String>,
    /// Name of a scenario: sine_0.5hz, sine_2hz, point_to_point, hunting, stick_slip, breakaway, presliding, curve.
    #[arg(long, value_name = "NAME")]
    scenario: Vec<String>,
    /// Threads that share the work; as many as there are processors. The numbers do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Folder for figures, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/fidelity")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Linings {
    /// On the disc.
    Pressed,
    /// Off it.
    Released,
}

impl Fidelity {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let selection = Selection {
            quick: self.quick,
            seeds: self.seeds,
            presets: self.preset,
            laws: self.law,
            rates: self.rate,
            wheel: self.wheel.map(|wheel| wheel == Linings::Pressed),
            mismatches: self.mismatch,
            scenarios: self.scenario,
            threads: self.threads,
        };
        let outcome = run_plan(&selection.plan()?, watch)?;
        let summary = outcome.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for (title, table) in outcome.tables() {
                writeln!(out, "{title}")?;
                for line in table.lines() {
                    writeln!(out, "{line}")?;
                }
                writeln!(out)?;
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })?;
        if outcome.complete { Ok(()) } else { Err(Failure::Incomplete(self.out)) }
    }
}
