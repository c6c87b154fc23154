//! `stickslip demo`: the paper's experiment on the virtual bench.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::demo::Demo;
use stickslip::quantity::number;
use stickslip::run::{About, Recorder};
use stickslip::{Preset, Watch, parameters};

use crate::failure::Failure;
use crate::output_options::OutputOptions;

/// Options of the demo.
#[derive(Args)]
pub(crate) struct DemoCommand {
    /// Folder for figures, tables, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/demo")]
    pub(super) out: PathBuf,
    /// Seed of the noise: the same seed gives the same bytes.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Without effect; accepted for older scripts.
    #[arg(long, hide = true)]
    no_serve: bool,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl DemoCommand {
    /// Runs the demo, writes the files and prints the main results.
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let preset: Preset<f64> = parameters::presets::find(&self.preset)?.read()?;
        let command = format!("stickslip demo --preset {} --seed {}", self.preset, self.seed);
        stickslip::output::create_folder(&self.out)?;
        let about = About { command: command.clone(), preset, seed: Some(self.seed) };
        let (recorder, tap) = Recorder::start(&self.out.join("run.mf4"), &about)?;
        let result = Demo::run(&preset, self.seed, Some(tap), watch);
        // The recording is complete up to a failure.
        let recorded = recorder.finish();
        let demo = result?;
        let mut summary = demo.write(&self.out, &command)?;
        recorded?;
        summary.file("run.mf4").write(&self.out)?;

        self.shown.show(out, &summary, |out| {
            writeln!(
                out,
                "Friction wheel: preload {} brings the breakaway torque to {} N·m ({} would be exact, 1 is the most).",
                number(demo.preload.preload, 3),
                number(demo.preload.breakaway_torque, 3),
                number(demo.preload.wanted, 3)
            )?;
            writeln!(out, "Own friction at this preload, measured at constant speeds:")?;
            for (name, estimate) in demo.own.lines() {
                writeln!(out, "  {name:<26} {estimate}")?;
            }
            writeln!(
                out,
                "Rendered by the load motor and measured again, RMS distance from the desired characteristic:"
            )?;
            for line in demo.rendering.lines() {
                writeln!(out, "  {line}")?;
            }
            writeln!(
                out,
                "{} s on the bench took {} s: {} times real time.",
                number(demo.bench_time, 0),
                number(demo.wall_time, 1),
                number(demo.bench_time / demo.wall_time, 0)
            )?;
            writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?;
            Ok(())
        })
    }
}
