//! `stickslip fidelity`: a controller with rendered friction compared to the same friction in the machine.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use stickslip::Watch;
use stickslip::fidelity::{Selection, run_plan};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source;

/// Cases of the comparison. Default: all. Each selection may be given several times.
#[derive(Args)]
pub(crate) struct Fidelity {
    /// Run the short comparison: the paper's law and the automatic one, in closed loop, 3 seeds.
    #[arg(long)]
    quick: bool,
    /// Number of noise seeds for each case [default: 10, or 3 with --quick].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: Option<u64>,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE")]
    preset: Vec<String>,
    /// Name of a law: paper, smooth, karnopp, bristle, residual, residual_slow, admittance, admittance_slow; auto is the automatic choice of the bench.
    #[arg(long, value_name = "NAME")]
    law: Vec<String>,
    /// Rate of sensors, observer, law and current control [Hz].
    #[arg(long, value_name = "HZ")]
    rate: Vec<f64>,
    /// State of the friction wheel [default: both].
    #[arg(long, value_name = "STATE")]
    wheel: Option<Linings>,
    /// Difference between machine and model: perfect, real, own+10%, gaussian, kt-2%, …
    #[arg(long, value_name = "NAME")]
    mismatch: Vec<String>,
    /// Observer of the bench: accelerometer (with tacho), or model (encoder and model of the drive).
    #[arg(long, value_name = "NAME")]
    observer: Vec<String>,
    /// Name of a scenario: sine_0.5hz, sine_2hz, point_to_point, hunting, stick_slip, breakaway, presliding, curve,
    /// curve_corrected.
    #[arg(long, value_name = "NAME")]
    scenario: Vec<String>,
    /// Number of threads [default: all processors]. Results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Folder for figures, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/fidelity")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Linings {
    /// Linings on the disc.
    Pressed,
    /// Linings off the disc.
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
            observers: self.observer,
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
