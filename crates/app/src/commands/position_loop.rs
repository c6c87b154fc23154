//! `stickslip loop`: robustness of the loop of a position controller.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use stickslip::Watch;
use stickslip::workflow::position_loop::{LoopRun, PRESET, as_cascade, as_pid, as_predictive, as_state_feedback};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Loop to analyse.
#[derive(Args)]
pub(crate) struct LoopCommand {
    /// Name of a preset, or a parameter file: its model is the axis, its bench.controller the controller.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Change a value of the preset (bench.controller.velocity_gain=0.2); may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Kind of controller: PID or cascade, equivalent to that of the preset, or a state feedback in its place.
    #[arg(long, value_enum)]
    control: Option<Control>,
    /// Tune the gains first: least deviation after a step of the load torque within limits of sensitivity and noise. Takes
    /// some seconds.
    #[arg(long)]
    tune: bool,
    /// Speed of the sliding load [rad/s].
    #[arg(long, value_name = "RAD/S", default_value_t = 10.0)]
    speed: f64,
    /// Folder for the preset with this controller, figures, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/loop")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

#[derive(Clone, Copy, ValueEnum)]
enum Control {
    /// PID control of the position.
    Pid,
    /// P control of the position around PI control of the velocity.
    Cascade,
    /// Feedback of all states of the drive, estimated by an observer.
    StateFeedback,
    /// State feedback that predicts the limits of torque, torque rate and velocity.
    Predictive,
}

impl LoopCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let mut preset = source::preset(&self.preset, self.set.iter().map(|s| (s.path.as_str(), s.value.as_str())))?;
        let controller = &mut preset.bench.controller;
        match self.control {
            Some(Control::Pid) => *controller = as_pid(controller),
            Some(Control::Cascade) => *controller = as_cascade(controller),
            Some(Control::StateFeedback) => *controller = as_state_feedback(controller),
            Some(Control::Predictive) => *controller = as_predictive(controller),
            None => {}
        }
        let run =
            if self.tune { LoopRun::tuned(&preset, self.speed, watch)? } else { LoopRun::new(&preset, self.speed)? };
        let summary = run.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for line in run.table().lines() {
                writeln!(out, "{line}")?;
            }
            for remark in run.remarks() {
                writeln!(out, "{remark}")?;
            }
            writeln!(out, "The bench with this controller: --preset {}", self.out.join(PRESET).display())?;
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}
