//! `stickslip calibrate`: automatic identification of the bench.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use stickslip::bench::remote::Address;
use stickslip::calibrate::CalibrationPlan;
use stickslip::quantity::number;
use stickslip::workflow::calibrate::{CALIBRATED, calibrate_in_real_time, calibrate_remote, calibrate_run};
use stickslip::{Watch, parameters};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Bench and plan of the calibration.
#[derive(Args)]
pub(crate) struct CalibrateCommand {
    /// Name of a preset, or a parameter file: the model before the calibration.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    pub(super) preset: String,
    /// Change a value of the bench (plant.servo.torque_per_volt=0.145), or of the plan (plan.duration=2); may be given
    /// several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Address of a machine in another process (see `stickslip plant`), or of two servo drives on EtherCAT [default: the
    /// virtual machine of the preset].
    #[arg(
        long,
        value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT|ethercat:INTERFACE[,FILE]",
        conflicts_with = "seed"
    )]
    io: Option<Address>,
    /// Seed of the noise: the same seed gives the same numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for the calibrated preset, figures, data, report and summary.json.
    #[arg(long, value_name = "DIR", default_value = "stickslip-out/calibrate")]
    pub(super) out: PathBuf,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

impl CalibrateCommand {
    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let (of_preset, of_plan) = source::split(&self.set);
        let plan = parameters::changed(&CalibrationPlan::default(), "--set plan", &of_plan)?;
        let preset = source::preset(&self.preset, of_preset)?;
        let duration = number(plan.bench_time(&preset.model, &preset.bench), 0);
        self.shown
            .print_line(out, &format!("Both motors, friction and bristles: {duration} s on the bench after homing."))?;
        let run = match self.io {
            Some(address @ Address::Ethercat(_)) => {
                calibrate_in_real_time(&plan, &preset, super::clocked_bench(&preset, &address, None)?, watch)?
            }
            Some(address) => calibrate_remote(&plan, &preset, address, watch)?,
            None => calibrate_run(&plan, &preset, self.seed, watch)?,
        };
        let summary = run.write(&self.out, &source::command_line())?;
        self.shown.show(out, &summary, |out| {
            for line in run.table().lines() {
                writeln!(out, "{line}")?;
            }
            for warning in &run.calibration.warnings {
                writeln!(out, "Note: {warning}")?;
            }
            writeln!(out, "Calibrated preset: --preset {}", self.out.join(CALIBRATED).display())?;
            Ok(writeln!(out, "Report with figures: {}", self.out.join("report.html").display())?)
        })
    }
}
