//! Manoeuvres of the benchmark, and their measures.

mod inputs;
mod run;
mod scores;

pub use run::{Lane, run_in_lanes, run_with, simulated_time};
pub use scores::Scores;

use std::f64::consts::TAU;

use stickslip_core::control::reference::{Constant, MotionLimits, PointToPoint, Ramp, Reference, Sine, Steps};

use scores::{noise, rms};
use stickslip_base::preset::Preset;
use stickslip_design::Hunting;

/// True course, one value for each sample of the controller, from the start of the manoeuvre on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Course {
    /// Time between samples [s].
    pub period: f64,
    /// Set-point minus true angle [rad].
    pub deviation: Vec<f64>,
    /// True velocity [rad/s].
    pub velocity: Vec<f64>,
    /// Active torque [N m].
    pub torque: Vec<f64>,
}

/// A manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Manoeuvre {
    /// A sine of 20 rad at 0.1 Hz: reversals with 7.9 rad/s², as a circle of 50 mm at 1 m/min has them (ISO 230-4).
    Reversal,
    /// A sine of 2 rad at 0.5 Hz.
    SlowSine,
    /// A sine of 2 rad at 2 Hz.
    FastSine,
    /// Steps of 10 µm of the carriage, forth and back.
    Steps,
    /// 0.05 rad/s, 40 µm/s of the carriage of most screws.
    Creep,
    /// Jerk-limited moves of 10 rad with rests.
    PointToPoint,
    /// A constant set-point between two counts.
    Hold,
    /// Ways between 10 µm and a full stroke of 100 mm, as fast as the drive permits, forth and back.
    Strokes,
}

/// All manoeuvres; the last is run on request only.
pub const MANOEUVRES: [Manoeuvre; 8] = [
    Manoeuvre::Reversal,
    Manoeuvre::SlowSine,
    Manoeuvre::FastSine,
    Manoeuvre::Steps,
    Manoeuvre::Creep,
    Manoeuvre::PointToPoint,
    Manoeuvre::Hold,
    Manoeuvre::Strokes,
];

/// One number of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// Its stable name.
    pub name: &'static str,
    /// Its title in a table.
    pub title: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Whether it measures tracking and is part of the rank.
    pub ranks: bool,
}

const fn measure(name: &'static str, title: &'static str, unit: &'static str, ranks: bool) -> Measure {
    Measure { name, title, unit, ranks }
}

/// Time between two steps of 10 µm, and number of steps.
const STEP_TIME: f64 = 0.6;
const STEP_COUNT: f64 = 4.0;
/// Way of such a step, and tolerance of settling [m].
const STEP: f64 = 10e-6;
const SETTLED: f64 = 2e-6;
/// Fade-in time of a sine, and settling time of a ramp [s].
const FADE_IN: f64 = 1.0;
const STEADY: f64 = 4.0;
/// Speed below which a load is stuck [rad/s].
const STUCK: f64 = 0.005;
/// Start of the evaluation of a held set-point [s].
const HELD: f64 = 6.0;
/// Least distance of the extremes of hunting, in counts.
const COUNTS: f64 = 3.0;

impl Manoeuvre {
    /// Its stable name.
    pub fn name(self) -> &'static str {
        match self {
            Manoeuvre::Reversal => "reversal",
            Manoeuvre::SlowSine => "sine_0.5hz",
            Manoeuvre::FastSine => "sine_2hz",
            Manoeuvre::Steps => "step_10um",
            Manoeuvre::Creep => "creep",
            Manoeuvre::PointToPoint => "point_to_point",
            Manoeuvre::Hold => "hold",
            Manoeuvre::Strokes => "strokes",
        }
    }

    /// Its measures.
    pub fn measures(self) -> &'static [Measure] {
        match self {
            Manoeuvre::Reversal => &[const { measure("reversal_peak", "reversal, peak", "rad", true) }],
            Manoeuvre::SlowSine => &[
                const { measure("sine_0.5hz_rms", "0.5 Hz, RMS", "rad", true) },
                const { measure("torque_noise", "torque noise", "N m", false) },
            ],
            Manoeuvre::FastSine => &[const { measure("sine_2hz_rms", "2 Hz, RMS", "rad", true) }],
            Manoeuvre::Steps => &[
                const { measure("step_10um_settling", "10 µm, settling", "s", false) },
                const { measure("step_10um_failures", "not settled", "1", false) },
            ],
            Manoeuvre::Creep => &[
                const { measure("creep_extent", "creep, extent", "rad", false) },
                const { measure("creep_stuck", "stuck", "1", false) },
            ],
            Manoeuvre::PointToPoint => &[
                const { measure("point_to_point_settling", "moves, settling", "s", false) },
                const { measure("point_to_point_failures", "not settled", "1", false) },
            ],
            Manoeuvre::Hold => &[
                const { measure("hold_hunting", "hunts", "1", false) },
                const { measure("hold_extent", "hold, extent", "rad", false) },
            ],
            Manoeuvre::Strokes => &[
                const { measure("strokes_settling", "strokes, settling", "s", false) },
                const { measure("strokes_failures", "not settled", "1", false) },
                const { measure("strokes_deviation", "strokes, deviation", "rad", false) },
            ],
        }
    }

    /// Whether its runs differ in place or way, not in the seed alone.
    pub fn has_places(self) -> bool {
        matches!(self, Manoeuvre::Hold | Manoeuvre::Strokes)
    }

    /// Whether it is run by default.
    pub fn is_usual(self) -> bool {
        self != Manoeuvre::Strokes
    }

    /// Its name for people, with its size.
    pub fn title(self) -> &'static str {
        match self {
            Manoeuvre::Reversal => "Reversal (sine of 20 rad, 0.1 Hz)",
            Manoeuvre::SlowSine => "Sine 0.5 Hz, 2 rad",
            Manoeuvre::FastSine => "Sine 2 Hz, 2 rad",
            Manoeuvre::Steps => "Steps of 10 µm",
            Manoeuvre::Creep => "Creep (0.05 rad/s)",
            Manoeuvre::PointToPoint => "Point to point, 10 rad",
            Manoeuvre::Hold => "Hold at a set-point",
            Manoeuvre::Strokes => "Strokes of 10 µm to 100 mm",
        }
    }

    /// Start of its evaluation [s].
    pub fn evaluated_from(self) -> f64 {
        match self {
            Manoeuvre::SlowSine | Manoeuvre::FastSine => FADE_IN,
            Manoeuvre::Creep => STEADY,
            Manoeuvre::Hold => HELD,
            Manoeuvre::Reversal | Manoeuvre::Steps | Manoeuvre::PointToPoint | Manoeuvre::Strokes => 0.0,
        }
    }

    /// The set-points on a machine, with a place chosen by `chance` (0 … 1), and their duration [s].
    pub fn reference(self, preset: &Preset<f64>, chance: f64) -> (Reference<f64>, f64) {
        let sine = |amplitude, frequency, fade_time| Reference::Sine(Sine { amplitude, frequency, fade_time });
        match self {
            Manoeuvre::Reversal => (sine(20.0, 0.1, 0.0), 8.1),
            Manoeuvre::SlowSine => (sine(2.0, 0.5, FADE_IN), FADE_IN + 4.0),
            Manoeuvre::FastSine => (sine(2.0, 2.0, FADE_IN), FADE_IN + 2.0),
            Manoeuvre::Steps => {
                let height = STEP / preset.model.drive.carriage_ratio();
                (Reference::Steps(Steps { height, hold_time: STEP_TIME }), STEP_TIME * (STEP_COUNT + 1.0))
            }
            Manoeuvre::Creep => {
                (Reference::Ramp(Ramp { velocity: 0.05, acceleration: 1.0, hold_time: 1e4 }), STEADY + 6.0)
            }
            Manoeuvre::PointToPoint => {
                let moves = moves();
                (Reference::PointToPoint(moves), moves.duration())
            }
            Manoeuvre::Strokes => {
                let moves = strokes(preset, chance);
                (Reference::PointToPoint(moves), moves.duration())
            }
            Manoeuvre::Hold => {
                let count = TAU / preset.model.encoder.counts_per_revolution;
                (Reference::Constant(Constant { position: 0.3 + count * (chance - 0.5) }), HELD + 12.0)
            }
        }
    }

    /// The numbers of a run, in the order of the measures.
    pub fn judge(self, course: &Course, preset: &Preset<f64>, chance: f64) -> Vec<f64> {
        let Course { period, deviation, .. } = course;
        let from = |time: f64| ((time / period).round() as usize).min(deviation.len());
        let extent = |values: &[f64]| {
            let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
            high - low
        };
        match self {
            Manoeuvre::Reversal => {
                let peak = |reversal: f64| {
                    deviation[from(reversal - 0.02)..from(reversal + 0.5)].iter().fold(0.0f64, |m, e| m.max(e.abs()))
                };
                vec![0.5 * (peak(2.5) + peak(7.5))]
            }
            Manoeuvre::SlowSine => vec![rms(&deviation[from(FADE_IN)..]), noise(&course.torque[from(FADE_IN)..])],
            Manoeuvre::FastSine => vec![rms(&deviation[from(FADE_IN)..])],
            Manoeuvre::Steps => {
                let begins = (1..=STEP_COUNT as usize).map(|k| k as f64 * STEP_TIME);
                let tolerance = SETTLED / preset.model.drive.carriage_ratio();
                settling(begins.map(|begin| &deviation[from(begin)..from(begin + STEP_TIME)]), tolerance, *period)
            }
            Manoeuvre::Creep => {
                let stuck = course.velocity[from(STEADY)..].iter().filter(|velocity| velocity.abs() < STUCK).count();
                let all = deviation.len() - from(STEADY);
                vec![extent(&deviation[from(STEADY)..]), stuck as f64 / all as f64]
            }
            Manoeuvre::PointToPoint => {
                settling(rests(&moves()).map(|[a, b]| &deviation[from(a)..from(b)]), tolerance(preset), *period)
            }
            Manoeuvre::Strokes => {
                let moves = strokes(preset, chance);
                let rests = rests(&moves).map(|[a, b]| &deviation[from(a)..from(b)]);
                let mut numbers = settling(rests, tolerance(preset), *period);
                numbers.push(deviation.iter().fold(0.0, |largest: f64, it| largest.max(it.abs())));
                numbers
            }
            Manoeuvre::Hold => {
                let end = &deviation[from(HELD)..];
                let count = TAU / preset.model.encoder.counts_per_revolution;
                let hunts = extent(end) > COUNTS * count || Hunting::find(end, *period, COUNTS * count).is_some();
                vec![f64::from(u8::from(hunts)), extent(end)]
            }
        }
    }
}

/// The moves of a point-to-point manoeuvre.
fn moves() -> PointToPoint<f64> {
    let limits = MotionLimits { velocity: 40.0, acceleration: 600.0, jerk: 60e3 };
    PointToPoint { distance: 10.0, limits, dwell_time: 0.55, moves: 4.0 }
}

/// Moves of a way chosen by `chance` (0 … 1), evenly on a logarithmic scale, with half of the drive's torque.
fn strokes(preset: &Preset<f64>, chance: f64) -> PointToPoint<f64> {
    const SHORTEST: f64 = 10e-6;
    const RATIO: f64 = 1e4;
    const SPEED: f64 = 80.0;
    let acceleration = 0.5 * preset.bench.controller.torque_limit() / preset.model.drive.inertia();
    let limits = MotionLimits { velocity: SPEED, acceleration, jerk: 100.0 * acceleration };
    let distance = SHORTEST * libm::pow(RATIO, chance) / preset.model.drive.carriage_ratio();
    PointToPoint { distance, limits, dwell_time: 0.5, moves: 2.0 }
}

/// Start and end of the rests between moves [s].
fn rests(moves: &PointToPoint<f64>) -> impl Iterator<Item = [f64; 2]> + use<> {
    let (each, dwell) = (moves.duration() / moves.moves, moves.dwell_time);
    (1..=moves.moves as usize).map(move |k| [k as f64 * each - dwell, k as f64 * each])
}

/// Tolerance of a move [rad]: three counts, or the way of a slip at breakaway, whichever is larger.
pub fn tolerance(preset: &Preset<f64>) -> f64 {
    let own = &preset.model.own;
    let jump = (own.breakaway_torque - own.kinetic_torque) / preset.model.drive.coupling_stiffness;
    jump.max(3.0 * TAU / preset.model.encoder.counts_per_revolution)
}

/// Mean time until deviations stay within a tolerance [rad], of those that do; and the share of those that do not.
fn settling<'a>(rests: impl Iterator<Item = &'a [f64]>, tolerance: f64, period: f64) -> Vec<f64> {
    let (mut settled, mut sum, mut all) = (0.0, 0.0, 0.0);
    for rest in rests {
        all += 1.0;
        let last = rest.iter().rposition(|deviation| deviation.abs() > tolerance).map_or(0, |last| last + 1);
        // The last twentieth must be within the tolerance.
        if last * 20 <= rest.len() * 19 {
            settled += 1.0;
            sum += last as f64 * period;
        }
    }
    vec![if settled > 0.0 { sum / settled } else { f64::NAN }, 1.0 - settled / all]
}
