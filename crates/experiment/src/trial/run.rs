//! The run of a trial on a bench.

use stickslip_core::control::reference::{Generator, PointToPoint, Reference, Shaped};

use super::TrialMotion;
use super::motion::gentle;
use crate::completed;
use stickslip_base::{Error, Preset, Watch};
use stickslip_bench::{Bench, Command, Frame};
use stickslip_simulate::manoeuvre::{Course, Scores};

/// Rest before each repetition, as in the benchmark [s].
const REST: f64 = 0.3;
/// Speed of the way to the start [rad/s].
const APPROACH: f64 = 20.0;
/// Mark of the frames of the motion.
const MARK: u32 = 1;
/// Half the time over which a speed is measured [s].
const WINDOW: f64 = 0.05;

/// Plan of a trial.
#[derive(Clone, Copy, Debug)]
pub struct TrialPlan<'a> {
    /// The motion.
    pub motion: &'a TrialMotion,
    /// Number of repetitions.
    pub repetitions: u64,
    /// Whether the load motor renders the desired friction.
    pub render: bool,
    /// Start of the motion [rad].
    pub origin: f64,
}

/// A repetition.
#[derive(Clone, Debug, PartialEq)]
pub struct Repetition {
    /// Place of the manoeuvre, 0 … 1.
    pub chance: f64,
    /// The set-points, one for each sample of the controller [rad].
    pub setpoint: Vec<f64>,
    /// The measured course.
    pub course: Course,
    /// Its scores.
    pub scores: Scores,
}

/// The result.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The completed repetitions.
    pub repetitions: Vec<Repetition>,
    /// Whether all repetitions were completed.
    pub complete: bool,
    /// Bench time [s].
    pub duration: f64,
}

impl TrialPlan<'_> {
    /// Place of a repetition: as even as possible, none on a count.
    pub fn chance(&self, repetition: u64) -> f64 {
        (repetition as f64 + 0.5) / self.repetitions as f64
    }
}

/// Runs a trial on a homed, running bench with the active controller; `preset` are its parameters.
///
/// # Errors
/// [`Error::NotHomed`]; [`Error::Answer`] where the motion does not fit into the travel; [`Error::BenchFault`];
/// [`Error::Cancelled`] before the first repetition has ended.
pub fn run_trial(
    plan: &TrialPlan<'_>,
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Trial, Error> {
    plan.motion.check(preset, plan.origin)?;
    let mut trial = Trial { repetitions: Vec::new(), complete: true, duration: 0.0 };
    let mut ended = Ok(());
    for index in 0..plan.repetitions {
        let report = |fraction: f64| {
            let stage = format!("{}, repetition {} of {}", plan.motion.title(), index + 1, plan.repetitions);
            watch.stage(&stage, (index as f64 + fraction) / plan.repetitions as f64)
        };
        match run_repetition(plan, plan.chance(index), preset, bench, &report) {
            Ok((repetition, duration)) => {
                trial.repetitions.push(repetition);
                trial.duration += duration;
            }
            Err(error) => {
                ended = Err(error);
                break;
            }
        }
    }
    trial.complete = completed(ended, !trial.repetitions.is_empty())?;
    Ok(trial)
}

/// Runs one repetition, and comes to rest. Returns it with the bench time [s]; `report` gets the finished part and may
/// cancel.
///
/// # Errors
/// As [`run_trial`].
pub fn run_repetition(
    plan: &TrialPlan<'_>,
    chance: f64,
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    report: &dyn Fn(f64) -> Result<(), Error>,
) -> Result<(Repetition, f64), Error> {
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let mut recorder = Recorder::new(preset);
    let followed = approach(plan, preset, bench, report).and_then(|cycle| {
        recorder.begin = cycle;
        follow(plan, chance, preset, bench, &mut recorder, report)
    });
    // Also after a cancellation the set-point comes to rest; after a fault there is none.
    let rested = bench.come_to_rest();
    followed.and(rested)?;
    let duration = (recorder.last - recorder.begin) as f64 * preset.bench.tick_time();
    let Recorder { setpoint, angle, torque, .. } = recorder;
    let period = preset.bench.control_period();
    let deviation = setpoint.iter().zip(&angle).map(|(setpoint, angle)| setpoint - angle).collect();
    let course = Course { period, deviation, velocity: velocities(&angle, period), torque };
    let scores = Scores::of(plan.motion.manoeuvre(), &course, preset, chance);
    Ok((Repetition { chance, setpoint, course, scores }, duration))
}

/// Goes to the start and rests there. Returns the first cycle.
fn approach(
    plan: &TrialPlan<'_>,
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    report: &dyn Fn(f64) -> Result<(), Error>,
) -> Result<u64, Error> {
    let rate = preset.bench.tick_rate;
    let first = bench.step(Command { render: plan.render, ..Command::default() })?;
    let present = first.angle;
    let distance = plan.origin - present;
    let moves = PointToPoint { distance, limits: gentle(preset, APPROACH), dwell_time: REST, moves: 1.0 };
    let mut setpoints = Generator::new(Reference::PointToPoint(moves), rate).with_origin(present);
    for tick in 0..(moves.duration() * rate).ceil() as u64 {
        check(tick, rate, 0.0, report)?;
        let command = Command { setpoint: setpoints.next(), control: true, render: plan.render, ..Command::default() };
        bench.hand_over(command)?.iter().try_for_each(stays_enabled)?;
    }
    Ok(first.cycle)
}

/// Follows the motion.
fn follow(
    plan: &TrialPlan<'_>,
    chance: f64,
    preset: &Preset<f64>,
    bench: &mut dyn Bench,
    recorder: &mut Recorder,
    report: &dyn Fn(f64) -> Result<(), Error>,
) -> Result<(), Error> {
    let rate = preset.bench.tick_rate;
    let (generator, count) = plan.motion.setpoints(preset, chance, plan.origin);
    let shaper = preset.bench.shaper.shaper(&preset.model.drive, rate);
    let mut setpoints = Shaped::new(generator, shaper);
    for tick in 0..count + shaper.delay() {
        check(tick, rate, tick as f64 / count as f64, report)?;
        let setpoint = setpoints.next();
        let command = Command { setpoint, control: true, render: plan.render, mark: MARK, ..Command::default() };
        if let Some(frame) = bench.hand_over(command)? {
            stays_enabled(&frame)?;
            recorder.add(&frame);
        }
    }
    bench.drain(&mut |frame| recorder.add(frame))
}

/// Reports progress, and checks for a cancellation, fifty times a second.
fn check(tick: u64, rate: f64, fraction: f64, report: &dyn Fn(f64) -> Result<(), Error>) -> Result<(), Error> {
    if tick.is_multiple_of((rate / 50.0).ceil() as u64) { report(fraction) } else { Ok(()) }
}

/// A fault ends the trial; an operator that disables the torque cancels it.
fn stays_enabled(frame: &Frame) -> Result<(), Error> {
    match frame.safety.fault() {
        Some(fault) => Err(Error::BenchFault { cycle: frame.cycle, reason: fault.to_string() }),
        None if frame.safety.allows_torque() => Ok(()),
        None => Err(Error::Cancelled),
    }
}

/// Samples of the controller during the motion.
struct Recorder {
    divider: u64,
    begin: u64,
    last: u64,
    setpoint: Vec<f64>,
    angle: Vec<f64>,
    torque: Vec<f64>,
}

impl Recorder {
    fn new(preset: &Preset<f64>) -> Self {
        let (setpoint, angle, torque) = (Vec::new(), Vec::new(), Vec::new());
        Recorder { divider: preset.bench.divider(), begin: 0, last: 0, setpoint, angle, torque }
    }

    fn add(&mut self, frame: &Frame) {
        self.last = frame.cycle;
        if frame.command.mark == MARK && frame.cycle.is_multiple_of(self.divider) {
            self.setpoint.push(frame.command.setpoint.position);
            self.angle.push(frame.angle);
            self.torque.push(frame.signals.commanded_torque);
        }
    }
}

/// Measured speed at each sample: the way within the window about it [rad/s].
fn velocities(angle: &[f64], period: f64) -> Vec<f64> {
    let half = ((WINDOW / period).round() as usize).max(1);
    let end = angle.len().saturating_sub(1);
    let speed = |k: usize| {
        let (from, to) = (k.saturating_sub(half), (k + half).min(end));
        (angle[to] - angle[from]) / ((to - from).max(1) as f64 * period)
    };
    (0..angle.len()).map(speed).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::home;
    use crate::trial::PositionFile;
    use stickslip_base::parameters::presets;
    use stickslip_bench::VirtualBench;
    use stickslip_simulate::manoeuvre::Manoeuvre;
    use stickslip_software::supervise::SafetyState;

    fn homed() -> (Preset<f64>, VirtualBench) {
        let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
        (preset.bench.tick_rate, preset.bench.control_divider) = (1000.0, 1.0);
        let mut bench = VirtualBench::new(&preset, 1).unwrap();
        home(&mut bench, &Watch::silent()).unwrap();
        (preset, bench)
    }

    #[test]
    fn repetitions_start_at_the_same_place_and_give_nearly_the_same_scores() {
        let (preset, mut bench) = homed();
        let motion = TrialMotion::Manoeuvre(Manoeuvre::FastSine);
        let plan = TrialPlan { motion: &motion, repetitions: 2, render: false, origin: 3.0 };
        let trial = run_trial(&plan, &preset, &mut bench, &Watch::silent()).unwrap();
        assert!(trial.complete && trial.repetitions.len() == 2 && trial.duration > 6.0);
        let rms = |k: usize| trial.repetitions[k].scores.tracking_rms;
        assert!((rms(0) / rms(1) - 1.0).abs() < 0.05 && (1e-3..0.3).contains(&rms(0)), "{} {}", rms(0), rms(1));
        for repetition in &trial.repetitions {
            assert_eq!(repetition.setpoint[0], 3.0);
            assert_eq!(repetition.setpoint.len(), 3000);
            assert_eq!(repetition.course.torque.len(), 3000);
        }
        assert!(matches!(bench.safety(), SafetyState::Running));
    }

    #[test]
    fn positions_of_a_file_are_followed_in_their_unit() {
        let (preset, mut bench) = homed();
        let rows: String =
            (0..=200).map(|k| format!("{:.2};{:.4}\n", 0.01 * f64::from(k), 0.02 * f64::from(k))).collect();
        let file = PositionFile::parse("ramp.csv", &format!("time [s];position [mm]\n{rows}"), &preset).unwrap();
        let motion = TrialMotion::File(file);
        let plan = TrialPlan { motion: &motion, repetitions: 1, render: false, origin: 0.0 };
        let trial = run_trial(&plan, &preset, &mut bench, &Watch::silent()).unwrap();
        let end = *trial.repetitions[0].setpoint.last().unwrap() * preset.model.drive.carriage_ratio();
        assert!((end - 4e-3).abs() < 4e-5, "{end} m");
        let parse = |text: &str| PositionFile::parse("f.csv", text, &preset).unwrap_err().to_string();
        assert!(parse("t [s],x [furlong]\n0,1\n1,2\n").contains("furlong"));
        assert!(parse("t [s],x\n0,1\n1,2\n5,3\n").contains("equal steps"));
        assert!(parse("t [s]\n0\n1\n2\n").contains("Two columns"));
        assert!(parse("t,x\n0,1\n400,2\n800,2\n").contains("600 s"));
    }

    #[test]
    fn a_motion_beyond_the_travel_is_refused_with_the_places_where_it_fits() {
        let (preset, mut bench) = homed();
        let motion = TrialMotion::Manoeuvre(Manoeuvre::Reversal);
        let plan = TrialPlan { motion: &motion, repetitions: 1, render: false, origin: 150.0 };
        let refused = run_trial(&plan, &preset, &mut bench, &Watch::silent()).unwrap_err().to_string();
        assert!(refused.contains("-136.5 and 136.5 rad") || refused.contains("−136.5 and 136.5 rad"), "{refused}");
    }

    #[test]
    fn a_cancelled_trial_rests_and_keeps_its_repetitions() {
        let (preset, mut bench) = homed();
        let motion = TrialMotion::Manoeuvre(Manoeuvre::FastSine);
        let plan = TrialPlan { motion: &motion, repetitions: 5, render: false, origin: 0.0 };
        let cancelled = Arc::new(AtomicBool::new(false));
        let stop = cancelled.clone();
        let watch = Watch::new(cancelled, move |_, fraction| stop.store(fraction > 0.3, Ordering::Relaxed));
        let trial = run_trial(&plan, &preset, &mut bench, &watch).unwrap();
        assert!(!trial.complete && trial.repetitions.len() == 1);
        let frame = bench.step(Command::default()).unwrap();
        assert!(frame.signals.estimated_velocity.abs() < 0.5, "{}", frame.signals.estimated_velocity);
    }
}
