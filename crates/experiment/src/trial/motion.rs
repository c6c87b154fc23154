//! Motions of a trial, and the travel that they need.

use std::path::Path;

use stickslip_core::control::reference::{Generator, MotionLimits};

use stickslip_base::preset::{Preset, Settings};
use stickslip_base::{Error, quantity::number};
use stickslip_recording::Recording;
use stickslip_simulate::manoeuvre::Manoeuvre;

/// Distance that motions keep from the ends of the travel [rad].
const MARGIN: f64 = 0.5;
/// Share of the drive's torque for the acceleration of gentle moves, and time of their change of acceleration [s].
const SHARE: f64 = 0.25;
const JERK_TIME: f64 = 0.05;
/// Longest motion of a file [s].
const LONGEST: f64 = 600.0;

/// Limits of a gentle move with this speed [rad/s].
pub fn gentle(preset: &Preset<f64>, velocity: f64) -> MotionLimits<f64> {
    let available = SHARE * preset.bench.controller.torque_limit() / preset.model.drive.inertia();
    let acceleration = available.min(preset.bench.safety.stop_deceleration);
    MotionLimits { velocity, acceleration, jerk: acceleration / JERK_TIME }
}

/// Ends of the travel for motions, within those of the supervision [rad].
pub fn travel(settings: &Settings<f64>) -> [f64; 2] {
    [settings.safety.lower_end + MARGIN, settings.safety.upper_end - MARGIN]
}

/// A motion of a trial.
#[derive(Clone, Debug, PartialEq)]
pub enum TrialMotion {
    /// A manoeuvre of the benchmark.
    Manoeuvre(Manoeuvre),
    /// Positions of a file.
    File(PositionFile),
}

/// Positions over time, relative to the start.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionFile {
    /// Name of the file.
    pub name: String,
    /// Positions [rad].
    positions: Vec<f64>,
    /// Their rate [Hz].
    rate: f64,
}

impl PositionFile {
    /// The first two columns of a table: time [s] and position; a column in mm, µm or m is converted by the screw. The
    /// first position is the start.
    ///
    /// # Errors
    /// A text that is not a table; fewer than two rows; unequal steps of time; an unknown unit; more than ten minutes.
    pub fn parse(name: &str, text: &str, preset: &Preset<f64>) -> Result<Self, Error> {
        let recording = Recording::parse(Path::new(name), text.as_bytes())?;
        let refused = |answer: String, remedy: &str| {
            Err(Error::Answer { question: format!("the positions of {name}"), answer, remedy: remedy.into() })
        };
        let [time, position, ..] = recording.columns() else {
            return refused("one column".into(), "Two columns are required: time [s], position [rad] or [mm].");
        };
        let (times, values) = (&time.values, &position.values);
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
            return refused("no rows".into(), "At least two rows are required.");
        };
        let duration = last - first;
        let step = duration / (times.len() as f64 - 1.0);
        let even = times.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() <= 0.01 * step);
        if !(even && step > 0.0) {
            return refused("unequal steps of time".into(), "The rows must have equal steps of time, in seconds.");
        }
        if duration > LONGEST {
            return refused(format!("{} s", number(duration, 0)), "The longest motion is 600 s.");
        }
        let ratio = preset.model.drive.carriage_ratio();
        let factor = match position.unit.as_deref().unwrap_or_default() {
            "" | "rad" | "1" => 1.0,
            "mm" => 1e-3 / ratio,
            "µm" | "um" => 1e-6 / ratio,
            "m" => 1.0 / ratio,
            other => return refused(format!("the unit {other}"), "Use rad, mm, µm or m."),
        };
        let start = values.first().copied().unwrap_or(0.0);
        let positions: Vec<f64> = values.iter().map(|value| factor * (value - start)).collect();
        match positions.iter().position(|position| !position.is_finite()) {
            Some(row) => refused(format!("an invalid number in row {}", row + 1), "All positions must be numbers."),
            None => Ok(PositionFile { name: name.into(), positions, rate: 1.0 / step }),
        }
    }

    fn duration(&self) -> f64 {
        (self.positions.len() as f64 - 1.0) / self.rate
    }
}

impl TrialMotion {
    /// Its title.
    pub fn title(&self) -> &str {
        match self {
            TrialMotion::Manoeuvre(manoeuvre) => manoeuvre.title(),
            TrialMotion::File(file) => &file.name,
        }
    }

    /// Its name in files.
    pub fn name(&self) -> &str {
        match self {
            TrialMotion::Manoeuvre(manoeuvre) => manoeuvre.name(),
            TrialMotion::File(_) => "file",
        }
    }

    /// The manoeuvre, if it is one.
    pub fn manoeuvre(&self) -> Option<Manoeuvre> {
        match self {
            TrialMotion::Manoeuvre(manoeuvre) => Some(*manoeuvre),
            TrialMotion::File(_) => None,
        }
    }

    /// Its set-points about an origin [rad], and their number; `chance` is the place of a manoeuvre.
    pub fn setpoints(&self, preset: &Preset<f64>, chance: f64, origin: f64) -> (Generator<'_>, u64) {
        let rate = preset.bench.tick_rate;
        let (generator, duration) = match self {
            TrialMotion::Manoeuvre(manoeuvre) => {
                let (reference, duration) = manoeuvre.reference(preset, chance);
                (Generator::new(reference, rate), duration)
            }
            TrialMotion::File(file) => (Generator::from_samples(&file.positions, file.rate, rate), file.duration()),
        };
        // Whole samples of the controller.
        let divider = preset.bench.divider();
        (generator.with_origin(origin), (duration * rate / divider as f64).round() as u64 * divider)
    }

    /// Its duration [s].
    pub fn duration(&self, preset: &Preset<f64>, chance: f64) -> f64 {
        self.setpoints(preset, chance, 0.0).1 as f64 * preset.bench.tick_time()
    }

    /// Smallest and largest position relative to the start, and largest speed [rad, rad/s].
    pub fn extent(&self, preset: &Preset<f64>, chance: f64) -> ([f64; 2], f64) {
        let (mut setpoints, count) = self.setpoints(preset, chance, 0.0);
        let mut extent = ([0.0f64; 2], 0.0f64);
        for _ in 0..count {
            let setpoint = setpoints.next();
            let ([low, high], speed) = extent;
            let ends = [low.min(setpoint.position), high.max(setpoint.position)];
            extent = (ends, speed.max(setpoint.velocity.abs()));
        }
        extent
    }

    /// Checks that the motion stays within the travel and the speed limit from an origin [rad].
    ///
    /// # Errors
    /// [`Error::Answer`] with the permitted range of the origin.
    pub fn check(&self, preset: &Preset<f64>, origin: f64) -> Result<(), Error> {
        let ([low, high], speed) = self.extent(preset, 0.5);
        let [lower, upper] = travel(&preset.bench);
        let (from, to) = (lower - low, upper - high);
        let text = |value: f64| number(value, 1);
        let limit = preset.bench.safety.speed;
        let remedy = if speed > limit {
            format!("It reaches {} rad/s; the speed limit is {} rad/s.", text(speed), text(limit))
        } else if from > to {
            format!("It needs {} rad; the travel is {} to {} rad.", text(high - low), text(lower), text(upper))
        } else if !(from..=to).contains(&origin) {
            format!("Start between {} and {} rad: go to such a position first.", text(from), text(to))
        } else {
            return Ok(());
        };
        let question = format!("the start of {}", self.title());
        Err(Error::Answer { question, answer: format!("{} rad", text(origin)), remedy })
    }
}
