//! `stickslip measure`: friction at constant speeds, breakaway, presliding, frequency response, learning, tracking.

use std::io::Write;
use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use stickslip::bench::remote::Address;
use stickslip::bench::{ClockedBench, RemoteBench, ThreadSettings};
use stickslip::experiment::{BreakawayPlan, FrictionPlan, LearningPlan, PreslidingPlan, ResponsePlan, TrackingPlan};
use stickslip::quantity::number;
use stickslip::run::{About, Recorder};
use stickslip::workflow::measure::{Outcome, Plan, measure, measure_in_real_time, measure_on};
use stickslip::{Watch, parameters};

use crate::failure::Failure;
use crate::output_options::OutputOptions;
use crate::source::{self, Setting};

/// Measurements.
#[derive(Subcommand)]
pub(crate) enum Measure {
    /// Measure friction at constant speeds in both directions: the curve that `fit` reads.
    #[command(after_help = "Example: stickslip measure friction --linings released --plan thorough --dry-run\n\
                            Example: stickslip measure friction --set plan.speeds=8 --set plan.slowest=0.5 --record\n\
                            Example: stickslip measure friction --real-time --set plan.speeds=4 --set plan.slowest=5\n\
                            Example: stickslip measure friction --io ethercat:eth0,drives.toml --preset calibrated.toml")]
    Friction(MeasureOptions),
    /// Measure the breakaway torque by slow torque ramps from rest.
    #[command(after_help = "Example: stickslip measure breakaway --set plan.angles=1 --set plan.repetitions=2")]
    Breakaway(MeasureOptions),
    /// Measure bristle stiffness and damping by small torque cycles below breakaway, after a friction curve.
    #[command(after_help = "Example: stickslip measure presliding --set plan.quick_cycles=4")]
    Presliding(MeasureOptions),
    /// Measure the frequency response from the commanded torque to encoder and tacho, under control, and compare it with
    /// the controller's model.
    #[command(after_help = "Example: stickslip measure response --linings released\n\
                            Example: stickslip measure response --set plan.velocity=0 --set plan.chirp=true")]
    Response(MeasureOptions),
    /// Learn the torque that a sine requires in addition to the controller's, by iterative learning control, until the
    /// error no longer decreases.
    #[command(after_help = "Example: stickslip measure learning --set plan.frequency=2 --set plan.repetitions=6")]
    Learning(MeasureOptions),
    /// Track sines and moves, slow and fast, and record every sample: training data for a friction compensation by a
    /// network.
    #[command(after_help = "Example: stickslip measure tracking --preset prototype\n\
                            Example: stickslip measure tracking --set plan.speed=20 --set plan.stroke=10 --dry-run")]
    Tracking(MeasureOptions),
}

/// Bench, duration and output of a measurement.
#[derive(Args)]
pub(crate) struct MeasureOptions {
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// Length of the measurement.
    #[arg(long, value_enum, default_value_t = Length::Quick)]
    plan: Length,
    /// Change a value of the preset, or of the plan (plan.NAME, as in the example); may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Seed of the noise: the same seed gives the same numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Address of a machine in another process (see `stickslip plant`), or of two servo drives on EtherCAT; the preset is
    /// the controller's model of it.
    #[arg(
        long,
        value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT|ethercat:INTERFACE[,FILE]",
        conflicts_with = "seed"
    )]
    io: Option<Address>,
    /// Run in real time, as physical hardware does, drives on EtherCAT always [default: as fast as possible].
    #[arg(long)]
    real_time: bool,
    /// Record every cycle into run.mf4, which other tools read and `stickslip replay` replays.
    #[arg(long, conflicts_with = "io")]
    record: bool,
    /// Linings of the friction wheel [default: as in the preset].
    #[arg(long, value_enum)]
    linings: Option<Linings>,
    /// Print the plan and its duration on the bench without measuring.
    #[arg(long)]
    dry_run: bool,
    /// Folder for data, report and summary.json [default: stickslip-out/measure-friction and so on].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shown: OutputOptions,
}

#[derive(Clone, Copy, ValueEnum)]
enum Length {
    /// Sufficient for a fit.
    Quick,
    /// Longer, with smaller uncertainty.
    Thorough,
}

#[derive(Clone, Copy, ValueEnum)]
enum Linings {
    /// Linings off the disc: friction of screw, nut and guide.
    Released,
    /// Linings on the disc with full preload.
    Pressed,
}

impl Measure {
    pub(crate) fn shown(&self) -> OutputOptions {
        let (Measure::Friction(options)
        | Measure::Breakaway(options)
        | Measure::Presliding(options)
        | Measure::Response(options)
        | Measure::Learning(options)
        | Measure::Tracking(options)) = self;
        options.shown
    }

    /// Folder of the results, and the preset.
    pub(super) fn destination(&self) -> (PathBuf, String) {
        let (options, kind) = match self {
            Measure::Friction(options) => (options, FrictionPlan::<f64>::KIND),
            Measure::Breakaway(options) => (options, BreakawayPlan::<f64>::KIND),
            Measure::Presliding(options) => (options, PreslidingPlan::<f64>::KIND),
            Measure::Response(options) => (options, ResponsePlan::<f64>::KIND),
            Measure::Learning(options) => (options, LearningPlan::<f64>::KIND),
            Measure::Tracking(options) => (options, TrackingPlan::<f64>::KIND),
        };
        (options.folder(kind), options.preset.clone())
    }

    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        match self {
            Measure::Friction(options) => options.run::<FrictionPlan<f64>>(out, watch),
            Measure::Breakaway(options) => options.run::<BreakawayPlan<f64>>(out, watch),
            Measure::Presliding(options) => options.run::<PreslidingPlan<f64>>(out, watch),
            Measure::Response(options) => options.run::<ResponsePlan<f64>>(out, watch),
            Measure::Learning(options) => options.run::<LearningPlan<f64>>(out, watch),
            Measure::Tracking(options) => options.run::<TrackingPlan<f64>>(out, watch),
        }
    }
}

impl MeasureOptions {
    fn folder(&self, kind: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| format!("stickslip-out/measure-{kind}").into())
    }

    fn run<P: Plan>(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        let plan = match self.plan {
            Length::Quick => P::default(),
            Length::Thorough => P::thorough(),
        };
        let (of_preset, of_plan) = source::split(&self.set);
        let plan = parameters::changed(&plan, "--set plan", &of_plan)?;
        let preset = source::preset(&self.preset, of_preset)?;
        let preload = self.linings.map(|linings| match linings {
            Linings::Released => 0.0,
            Linings::Pressed => 1.0,
        });
        let duration = number(plan.duration(&preset), 0);
        let linings = number(preload.unwrap_or(preset.plant.wheel.preload), 2);
        self.shown.print_line(out, &format!("{}, linings at {linings}: {duration} s on the bench.", plan.about()))?;
        if self.dry_run {
            return Ok(());
        }
        let folder = self.folder(P::KIND);
        let (mut recorder, mut tap) = (None, None);
        if self.record {
            stickslip::output::create_folder(&folder)?;
            let about = About { command: source::command_line(), preset, seed: Some(self.seed) };
            (recorder, tap) = Some(Recorder::start(&folder.join("run.mf4"), &about)?).unzip();
        }
        let result = match self.io {
            Some(address) if self.real_time || matches!(address, Address::Ethercat(_)) => {
                let bench = super::clocked_bench(&preset, &address, tap)?;
                measure_in_real_time(plan, &preset, bench, preload, None, watch)
            }
            Some(address) => measure_on(plan, &preset, &mut RemoteBench::connect(&preset, &address)?, preload, watch),
            None if self.real_time => {
                let bench = ClockedBench::virtual_machine(&preset, self.seed, ThreadSettings::default(), tap)?;
                measure_in_real_time(plan, &preset, bench, preload, Some(self.seed), watch)
            }
            None => measure(plan, &preset, preload, self.seed, tap, watch),
        };
        // The recording is complete up to a failure.
        let recorded = recorder.map(Recorder::finish).transpose();
        let measurement = result?;
        let mut summary = measurement.write(&folder, &source::command_line())?;
        let recorded = recorded?;
        if recorded.is_some() {
            summary.file("run.mf4").write(&folder)?;
        }
        let outcome = &measurement.outcome;
        self.shown.show(out, &summary, |out| {
            for line in outcome.table().lines() {
                writeln!(out, "  {line}")?;
            }
            for line in measurement.clocked.iter().flat_map(|clocked| clocked.table().lines()) {
                writeln!(out, "  {line}")?;
            }
            for warning in measurement.warnings() {
                writeln!(out, "Note: {warning}")?;
            }
            if let Some(recorded) = recorded {
                let path = folder.join("run.mf4");
                let lost = if recorded.lost > 0 { format!(", {} cycles lost", recorded.lost) } else { String::new() };
                writeln!(out, "Recorded: {} ({} cycles{lost})", path.display(), recorded.file.rows)?;
            }
            Ok(writeln!(out, "Data and report: {}", folder.join("report.html").display())?)
        })?;
        if outcome.complete() { Ok(()) } else { Err(Failure::Incomplete(folder)) }
    }
}
