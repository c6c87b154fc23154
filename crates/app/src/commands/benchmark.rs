//! `stickslip benchmark`: controllers ranked for each friction.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::Watch;
use stickslip::benchmark::{Entrant, FRICTIONS, HOUSE, MANOEUVRES, Plan, entrants, run_plan};
use stickslip::fidelity::by_name;

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Cases of the benchmark. Default: all. Each selection may be given several times.
#[derive(Args)]
pub(crate) struct Benchmark {
    /// Run the short benchmark: two frictions, two seeds, four set-points to hold, friction modelled 30 % too low or high.
    #[arg(long)]
    quick: bool,
    /// Name of a preset, or a parameter file: the machine. The compared frictions replace its friction.
    #[arg(long, value_name = "NAME|FILE", default_value = "prototype")]
    pub(super) preset: String,
    /// Change a value of the preset (bench.tick_rate=1000); may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    // The help lists the built-in controllers.
    #[arg(long, value_name = "NAME|FILE", help = controller_help())]
    controller: Vec<String>,
    /// Name of a friction: mild, nominal, vicious.
    #[arg(long, value_name = "NAME")]
    friction: Vec<String>,
    /// Name of a manoeuvre: reversal, sine_0.5hz, sine_2hz, step_10um, creep, point_to_point, hold; strokes runs only if
    /// it is named.
    #[arg(long, value_name = "NAME")]
    manoeuvre: Vec<String>,
    /// Number of noise seeds for each result [default: 6, or 2 with --quick].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: Option<u64>,
    /// Number of set-points to hold [default: 12, or 4 with --quick].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    places: Option<u64>,
    /// Number of threads [default: all processors]. Results do not depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Folder for figures, report and summary.json. Finished cases are in its folder cells; the same command resumes.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/benchmark")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

fn controller_help() -> String {
    format!(
        "A controller: {}; a parameter file (*.toml) with controller, filter, compensation and hold; or an external \
         controller as for `stickslip load`: a shared library, an FMU or a function in Python, optionally with values of \
         its parameters (servo.so,gain=6). The first is the reference for the others",
        entrants()
    )
}

impl Benchmark {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let preset = source::preset(&self.preset, self.set.iter().map(|s| (s.path.as_str(), s.value.as_str())))?;
        let all = HOUSE.map(String::from);
        let names: &[String] = if self.controller.is_empty() { &all } else { &self.controller };
        let entrants =
            names.iter().map(|name| Entrant::open(name, &self.out.join("made"))).collect::<Result<Vec<_>, _>>()?;
        let mut plan = Plan::new(self.preset.clone(), preset, entrants);
        if self.quick {
            plan = plan.quick();
        }
        if !self.friction.is_empty() {
            plan.frictions = by_name("friction", &self.friction, &FRICTIONS, |it| it.name)?;
        }
        if !self.manoeuvre.is_empty() {
            plan.manoeuvres = by_name("manoeuvre", &self.manoeuvre, &MANOEUVRES, |it| it.name())?;
        }
        plan.seeds = self.seeds.unwrap_or(plan.seeds);
        plan.places = self.places.unwrap_or(plan.places);
        plan.threads = if self.threads > 0 { self.threads } else { plan.threads };

        let outcome = run_plan(&plan, &self.out.join("cells"), watch)?;
        let summary = outcome.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for (title, table) in outcome.tables().into_iter().chain(outcome.robustness()) {
                writeln!(out, "{title}")?;
                for line in table.lines() {
                    writeln!(out, "{line}")?;
                }
                writeln!(out)?;
            }
            for remark in outcome.remarks() {
                writeln!(out, "{remark}")?;
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })?;
        if outcome.complete { Ok(()) } else { Err(Failure::Incomplete(self.out)) }
    }
}
