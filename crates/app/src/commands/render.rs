//! `stickslip render`: the load motor renders the desired friction, which is then measured.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::experiment::FrictionPlan;
use stickslip::parameters::presets;
use stickslip::quantity::number;
use stickslip::workflow::measure::{Outcome, Plan};
use stickslip::workflow::render::render_run;
use stickslip::{Preset, Watch};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Own and desired friction, and the bench.
#[derive(Args)]
pub(crate) struct RenderCommand {
    /// Own friction, which the law subtracts: the fit.toml of a fit. Its preload of the linings is used if it has one.
    #[arg(long, value_name = "FILE|NAME")]
    own: String,
    /// Desired friction: the desired.toml of a design, or a preset.
    #[arg(long, value_name = "FILE|NAME")]
    desired: String,
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Change a value of the bench (bench.fade_velocity=0.2); may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Largest number of corrections: the torque over speed is corrected by the measured difference and measured again,
    /// until the difference no longer decreases.
    #[arg(long, value_name = "N", default_value_t = 0)]
    corrections: usize,
    /// Seed of the noise: the same seed gives the same numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for figures, data, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/render")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl RenderCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let remedy = "Give the fit.toml that `stickslip fit` or `stickslip friction` wrote, or a preset.";
        let own = presets::find(&self.own)?.stating("model.own", remedy)?;
        let measured: Preset<f64> = own.read()?;
        let desired: Preset<f64> = presets::find(&self.desired)?
            .stating("bench.desired", "Give the desired.toml that `stickslip design` wrote, or a preset.")?
            .read()?;
        let linings = own.states("plant.wheel.preload").then(|| measured.plant.wheel.preload.to_string());
        let linings = linings.iter().map(|preload| ("plant.wheel.preload", preload.as_str()));
        let settings = self.set.iter().map(|s| (s.path.as_str(), s.value.as_str()));
        let mut preset = source::preset(&self.preset, linings.chain(settings))?;
        preset.model.own = measured.model.own;
        preset.bench.desired = desired.bench.desired;

        let plan = FrictionPlan::quick();
        let duration = number(Plan::duration(&plan, &preset), 0);
        let linings = number(preset.plant.wheel.preload, 2);
        self.shown.print_line(
            out,
            &format!("{} under the law, linings at {linings}: {duration} s on the bench.", plan.about()),
        )?;
        let run = render_run(&plan, &preset, self.corrections, self.seed, watch)?;
        let summary = run.write(&self.out, &source::command_line())?;
        let rendering = run.rendering();
        self.shown.show(out, &summary, |out| {
            writeln!(out, "RMS distance of the rendered from the desired characteristic:")?;
            for line in rendering.lines().into_iter().chain(run.lines()) {
                writeln!(out, "  {line}")?;
            }
            for warning in rendering.curve.warnings() {
                writeln!(out, "Note: {warning}")?;
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })?;
        if run.complete() { Ok(()) } else { Err(Failure::Incomplete(self.out)) }
    }
}
