//! `stickslip hunting`: prediction of hunting from the controller's model of the machine.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::Watch;
use stickslip::design::HuntingPlan;
use stickslip::workflow::hunting::HuntingRun;

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Loop and duration of the prediction.
#[derive(Args)]
pub(crate) struct HuntingCommand {
    /// Name of a preset, or a parameter file: its model is the axis; its controller, compensation and hold are active.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Change a value of the preset (bench.controller.integral_gain=9); may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Use the desired friction, which the load motor renders, instead of the machine's own.
    #[arg(long)]
    desired: bool,
    /// Simulated time [s]; slow controllers hunt slowly.
    #[arg(long, value_name = "S", default_value_t = HuntingPlan::default().duration, value_parser = positive)]
    duration: f64,
    /// Folder for figures, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/hunting")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

/// Reads a duration between 1 s and 3600 s.
fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number of seconds"))?;
    if (1.0..=3600.0).contains(&value) { Ok(value) } else { Err("choose 1 s to 3600 s".into()) }
}

impl HuntingCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let mut preset = source::preset(&self.preset, self.set.iter().map(|s| (s.path.as_str(), s.value.as_str())))?;
        if self.desired {
            preset.model.own = preset.bench.desired;
            preset.model.own_bristles = preset.bench.desired_bristles;
        }
        let run = HuntingRun::new(&preset, &HuntingPlan::lasting(self.duration), watch)?;
        let summary = run.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for line in run.table().lines() {
                writeln!(out, "{line}")?;
            }
            for remark in run.remarks() {
                writeln!(out, "{remark}")?;
            }
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}
