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
use crate::shown::Shown;
use crate::source::{self, Setting};

/// What to measure.
#[derive(Subcommand)]
pub(crate) enum Measure {
    /// Friction at constant speeds in both directions: the curve that `fit` reads.
    #[command(after_help = "Example: stickslip measure friction --linings released --plan thorough --dry-run\n\
                            Example: stickslip measure friction --set plan.speeds=8 --set plan.slowest=0.5 --record\n\
                            Example: stickslip measure friction --real-time --set plan.speeds=4 --set plan.slowest=5")]
    Friction(How),
    /// Breakaway torque by slow torque ramps from rest.
    #[command(after_help = "Example: stickslip measure breakaway --set plan.angles=1 --set plan.repetitions=2")]
    Breakaway(How),
    /// Bristle stiffness and damping by small torque cycles below breakaway, after a friction curve.
    #[command(after_help = "Example: stickslip measure presliding --set plan.quick_cycles=4")]
    Presliding(How),
    /// Frequency response from the commanded torque to encoder and tacho, under control, beside that of the axis that is
    /// believed.
    #[command(after_help = "Example: stickslip measure response --linings released\n\
                            Example: stickslip measure response --set plan.velocity=0 --set plan.chirp=true")]
    Response(How),
    /// Iterative learning: which torque a sine needs besides the controller's, learnt from repetition to repetition, until
    /// nothing is gained any more.
    #[command(after_help = "Example: stickslip measure learning --set plan.frequency=2 --set plan.repetitions=6")]
    Learning(How),
    /// Tracking: the controller under test follows sines and moves, slow and fast, with every sample on record. What a
    /// network for the compensation of friction is trained on.
    #[command(after_help = "Example: stickslip measure tracking --preset prototype\n\
                            Example: stickslip measure tracking --set plan.speed=20 --set plan.stroke=10 --dry-run")]
    Tracking(How),
}

/// On which bench, how long, and where to.
#[derive(Args)]
pub(crate) struct How {
    /// Name of a preset, or a parameter file.
    #[arg(long, value_name = "NAME|FILE", default_value = "clm-bench")]
    preset: String,
    /// How much bench time it may take.
    #[arg(long, value_enum, default_value_t = Length::Quick)]
    plan: Length,
    /// Change a value of the preset, or of the plan (plan.speeds=8); may be given several times.
    #[arg(long, value_name = "PATH=VALUE")]
    set: Vec<Setting>,
    /// Seed of the noise: the same seed gives the same numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Measure on a machine in another process, as `stickslip plant` serves one; the preset says what is believed of it.
    #[arg(long, value_name = "udp:ADDRESS:PORT|shm:NAME|serial:PORT", conflicts_with = "seed")]
    io: Option<Address>,
    /// Run by the clock, as a bench of steel does, instead of as fast as it goes.
    #[arg(long)]
    real_time: bool,
    /// Record every cycle into run.mf4, which other tools read and `stickslip replay` replays.
    #[arg(long, conflicts_with = "io")]
    record: bool,
    /// Linings of the friction wheel; without it as the preset has them.
    #[arg(long, value_enum)]
    linings: Option<Linings>,
    /// Say what would be done and how long it takes on the bench, and end.
    #[arg(long)]
    dry_run: bool,
    /// Folder for data, report and summary.json; by default stickslip-out/measure-friction and so on.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shown: Shown,
}

#[derive(Clone, Copy, ValueEnum)]
enum Length {
    /// Enough for a fit.
    Quick,
    /// Longer, and sharper.
    Thorough,
}

#[derive(Clone, Copy, ValueEnum)]
enum Linings {
    /// Off the disc: the friction of screw, nut and guide.
    Released,
    /// On the disc with full preload.
    Pressed,
}

impl Measure {
    pub(crate) fn shown(&self) -> Shown {
        let (Measure::Friction(how)
        | Measure::Breakaway(how)
        | Measure::Presliding(how)
        | Measure::Response(how)
        | Measure::Learning(how)
        | Measure::Tracking(how)) = self;
        how.shown
    }

    /// Where its results go, and the preset.
    pub(super) fn leaves(&self) -> (PathBuf, String) {
        let (how, kind) = match self {
            Measure::Friction(how) => (how, FrictionPlan::<f64>::KIND),
            Measure::Breakaway(how) => (how, BreakawayPlan::<f64>::KIND),
            Measure::Presliding(how) => (how, PreslidingPlan::<f64>::KIND),
            Measure::Response(how) => (how, ResponsePlan::<f64>::KIND),
            Measure::Learning(how) => (how, LearningPlan::<f64>::KIND),
            Measure::Tracking(how) => (how, TrackingPlan::<f64>::KIND),
        };
        (how.folder(kind), how.preset.clone())
    }

    pub(crate) fn run(self, out: &mut dyn Write, watch: &Watch) -> Result<(), Failure> {
        match self {
            Measure::Friction(how) => how.run::<FrictionPlan<f64>>(out, watch),
            Measure::Breakaway(how) => how.run::<BreakawayPlan<f64>>(out, watch),
            Measure::Presliding(how) => how.run::<PreslidingPlan<f64>>(out, watch),
            Measure::Response(how) => how.run::<ResponsePlan<f64>>(out, watch),
            Measure::Learning(how) => how.run::<LearningPlan<f64>>(out, watch),
            Measure::Tracking(how) => how.run::<TrackingPlan<f64>>(out, watch),
        }
    }
}

impl How {
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
        self.shown.say(out, &format!("{}, linings at {linings}: {duration} s on the bench.", plan.about()))?;
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
        let measured = match self.io {
            Some(address) if self.real_time => {
                let bench = ClockedBench::connect(&preset, &address, ThreadSettings::default(), tap)?;
                measure_in_real_time(plan, &preset, bench, preload, None, watch)
            }
            Some(address) => measure_on(plan, &preset, &mut RemoteBench::connect(&preset, &address)?, preload, watch),
            None if self.real_time => {
                let bench = ClockedBench::virtual_machine(&preset, self.seed, ThreadSettings::default(), tap)?;
                measure_in_real_time(plan, &preset, bench, preload, Some(self.seed), watch)
            }
            None => measure(plan, &preset, preload, self.seed, tap, watch),
        };
        // What was recorded until a failure is kept, too.
        let recorded = recorder.map(Recorder::finish).transpose();
        let measurement = measured?;
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
