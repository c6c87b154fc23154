//! Tracking: the controller under test follows motions with many reversals and speeds, and every sample is recorded.
//!
//! Sines from slow to fast at several frequencies, then moves of several lengths, gentle and as fast as allowed; each
//! motion ends at rest where it started. One set-point continues from one to the next, so that its past is known for
//! each sample. The record contains the torque of each motion and can train a network.

use std::f64::consts::TAU;

use stickslip_core::Fields;
use stickslip_core::control::compensation::{FEATURES, FeatureState, SetpointFeatures};
use stickslip_core::control::reference::{Chirp, Generator, MotionLimits, PointToPoint, Reference, Setpoint};

use super::completed;
use stickslip_base::preset::CompensationChoice;
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame};
use stickslip_design::{preview, setpoint_features};

/// Time in which a sine fades in, and out [s].
const FADE: f64 = 1.0;
/// Periods of a sine between the fades, and its least time [s].
const PERIODS: f64 = 2.0;
const LEAST_TIME: f64 = 2.0;
/// Rest after each motion [s].
const DWELL: f64 = 0.2;
/// Lengths of moves, as shares of the stroke.
const LENGTHS: [f64; 4] = [1e-3, 1e-2, 0.1, 1.0];
/// Shares of the largest speed and acceleration of a gentle move.
const GENTLE: [f64; 2] = [0.125, 0.03];

/// Plan of a record of tracking.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct TrackingPlan<T> {
    /// Largest speed.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-2..=1e3, default = 40.0)]
    pub speed: T,
    /// Largest speed of the slowest sine.
    #[field(symbol = "Ω_min", unit = "rad/s", range = 1e-3..=1e3, default = 0.2)]
    pub slowest: T,
    /// Largest number of sines of different speeds at a frequency.
    #[field(symbol = "n_Ω", unit = "1", range = 2.0..=50.0, default = 6.0, whole)]
    pub speeds: T,
    /// Lowest frequency.
    #[field(symbol = "f_min", unit = "Hz", range = 0.02..=20.0, default = 0.1)]
    pub lowest_frequency: T,
    /// Highest frequency.
    #[field(symbol = "f_max", unit = "Hz", range = 0.02..=50.0, default = 2.0)]
    pub highest_frequency: T,
    /// Number of frequencies.
    #[field(symbol = "n_f", unit = "1", range = 2.0..=20.0, default = 4.0, whole)]
    pub frequencies: T,
    /// Largest amplitude of a sine, and length of the longest move.
    #[field(symbol = "r₀", unit = "rad", range = 1e-2..=1e4, default = 25.0)]
    pub stroke: T,
    /// Largest acceleration of moves and sines.
    #[field(symbol = "α_max", unit = "rad/s^2", range = 1e-1..=1e5, default = 600.0)]
    pub acceleration: T,
    /// Largest change of the acceleration in a move.
    #[field(symbol = "j_max", unit = "rad/s^3", range = 1.0..=1e8, default = 60e3)]
    pub jerk: T,
}

/// A motion of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Description.
    pub what: String,
    reference: Reference<f64>,
    /// Duration [s].
    duration: f64,
}

/// One sample of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedSample {
    /// Time since the first sample [s].
    pub time: f64,
    /// Index of the motion, from 0.
    pub motion: usize,
    /// Set-point.
    pub setpoint: Setpoint<f64>,
    /// Angle by the encoder [rad].
    pub angle: f64,
    /// Commanded torque computed from it, active from the next sample on [N m].
    pub torque: f64,
}

/// Deviation over a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// Deviation by the encoder, RMS [rad].
    pub deviation: f64,
    /// Largest deviation [rad].
    pub peak: f64,
}

/// The record.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracked {
    /// The motions of the plan.
    pub motions: Vec<Motion>,
    /// All samples, in their order.
    pub samples: Vec<TrackedSample>,
    /// Time between samples [s].
    pub period: f64,
    /// Delay from a sample to its torque [s].
    pub preview: f64,
    /// Inertia of the model [kg m²].
    pub inertia: f64,
    /// Features of the set-points for a network.
    pub features: SetpointFeatures<f64>,
    /// Whether it was completed.
    pub complete: bool,
    /// Bench time [s].
    pub duration: f64,
}

impl TrackingPlan<f64> {
    /// The motions, one after the other.
    pub fn motions(&self) -> Vec<Motion> {
        let spread = |count: f64, low: f64, high: f64| {
            let ratio = high / low;
            (0..count as usize).map(move |k| low * libm::pow(ratio, k as f64 / (count - 1.0)))
        };
        let mut motions = Vec::new();
        for frequency in spread(self.frequencies, self.lowest_frequency, self.highest_frequency) {
            for speed in spread(self.speeds, self.slowest.min(self.speed), self.speed) {
                let amplitude = speed / (TAU * frequency);
                // The digits of a number on the page.
                let within = 1.0 + 1e-9;
                if amplitude > self.stroke * within || speed * TAU * frequency > self.acceleration * within {
                    continue;
                }
                // Whole periods: it ends where it started.
                let between = (LEAST_TIME * frequency).max(PERIODS);
                let duration = (between + 2.0 * FADE * frequency).ceil() / frequency;
                let sine = Chirp {
                    amplitude,
                    start_frequency: frequency,
                    end_frequency: frequency,
                    duration,
                    fade_time: FADE,
                };
                motions.push(Motion {
                    what: format!("sine of {frequency:.2} Hz, {speed:.3} rad/s"),
                    reference: Reference::Chirp(sine),
                    duration: duration + DWELL,
                });
            }
        }
        let full = MotionLimits { velocity: self.speed, acceleration: self.acceleration, jerk: self.jerk };
        let [speed, acceleration] = GENTLE;
        let gentle = MotionLimits {
            velocity: speed * full.velocity,
            acceleration: acceleration * full.acceleration,
            jerk: acceleration * full.jerk,
        };
        for (name, limits) in [("gentle", gentle), ("fast", full)] {
            for length in LENGTHS {
                let distance = length * self.stroke;
                let moves = PointToPoint { distance, limits, dwell_time: DWELL, moves: 4.0 };
                motions.push(Motion {
                    what: format!("{name} moves of {distance:.3} rad"),
                    duration: moves.duration(),
                    reference: Reference::PointToPoint(moves),
                });
            }
        }
        motions
    }

    /// Bench time [s].
    pub fn duration(&self) -> f64 {
        // And half a second to come to rest.
        self.motions().iter().map(|motion| motion.duration).sum::<f64>() + 0.5
    }
}

/// Follows the motions of a plan and records every sample. The bench must be homed and running.
///
/// # Errors
/// [`Error::NotHomed`]; [`Error::BenchFault`]; [`Error::Cancelled`] before the first motion has ended; afterwards a
/// cancelled record returns its samples as not complete.
pub fn record_tracking(plan: &TrackingPlan<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<Tracked, Error> {
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let (model, settings) = (*bench.model(), *bench.settings());
    let first = bench.step(Command::default())?;
    let mut tracked = Tracked {
        motions: plan.motions(),
        samples: Vec::new(),
        period: settings.control_period(),
        preview: preview(&model, &settings),
        inertia: model.drive.inertia(),
        features: match settings.compensation {
            CompensationChoice::Network(choice) => choice.network.features,
            _ => setpoint_features(&model),
        },
        complete: true,
        duration: 0.0,
    };
    let ended = follow(plan, first.angle, &mut tracked, bench, watch);
    bench.come_to_rest()?;
    // A sample with a missed torque is left out.
    tracked.samples.retain(|sample| sample.torque.is_finite());
    tracked.complete = completed(ended, tracked.samples.last().is_some_and(|sample| sample.motion > 0))?;
    let last = bench.step(Command::default())?;
    tracked.duration = (last.cycle - first.cycle) as f64 * settings.tick_time();
    Ok(tracked)
}

fn follow(
    plan: &TrackingPlan<f64>,
    home: f64,
    tracked: &mut Tracked,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<(), Error> {
    let (rate, divider) = (bench.settings().tick_rate, bench.settings().divider());
    let motions = tracked.motions.clone();
    let total = plan.duration();
    let (mut ticks, mut start) = (0u64, None);
    let samples = &mut tracked.samples;
    let mut see = |frame: &Frame| {
        // The mark is the motion, from 1.
        let Some(motion) = (frame.command.mark as usize).checked_sub(1) else { return };
        let start = *start.get_or_insert(frame.cycle);
        let phase = frame.cycle % divider;
        if phase == 0 {
            let time = (frame.cycle - start) as f64 / rate;
            let (setpoint, angle) = (frame.command.setpoint, frame.angle);
            samples.push(TrackedSample { time, motion, setpoint, angle, torque: f64::NAN });
        }
        // The torque computed from a sample is in its last tick.
        if let Some(sample) = samples.last_mut().filter(|_| phase == divider - 1) {
            sample.torque = frame.signals.commanded_torque;
        }
    };
    for (number, motion) in motions.iter().enumerate() {
        let mut setpoints = Generator::new(motion.reference, rate).with_origin(home);
        for _ in 0..(motion.duration * rate).round() as u64 {
            if ticks.is_multiple_of(512) {
                watch.stage("motions", ticks as f64 / rate / total)?;
            }
            ticks += 1;
            let setpoint = setpoints.next();
            let command = Command { setpoint, control: true, mark: number as u32 + 1, ..Command::default() };
            bench.hand_over(command)?.iter().for_each(&mut see);
        }
    }
    bench.drain(&mut see)
}

impl Tracked {
    /// Deviation over the samples of a motion, or over all.
    pub fn followed(&self, motion: Option<usize>) -> Followed {
        let of = self.samples.iter().filter(|sample| motion.is_none_or(|motion| sample.motion == motion));
        let (mut square, mut peak, mut count) = (0.0, 0.0f64, 0.0);
        for sample in of {
            let deviation = sample.setpoint.position - sample.angle;
            (square, peak, count) = (square + deviation * deviation, peak.max(deviation.abs()), count + 1.0);
        }
        Followed { deviation: libm::sqrt(square / count), peak }
    }

    /// Torque of each sample without that of the model's inertia, at the acceleration of the set-point when the torque
    /// acts [N m].
    pub fn friction(&self) -> Vec<f64> {
        let acceleration = |index: usize| self.samples[index.min(self.samples.len() - 1)].setpoint.acceleration;
        let ahead = self.preview / self.period;
        let (whole, part) = (ahead.floor() as usize, ahead - ahead.floor());
        let of = |(k, sample): (usize, &TrackedSample)| {
            let (before, behind) = (acceleration(k + whole), acceleration(k + whole + 1));
            sample.torque - self.inertia * (before + part * (behind - before))
        };
        self.samples.iter().enumerate().map(of).collect()
    }

    /// Features of each sample for a network.
    pub fn features(&self) -> Vec<[f64; FEATURES]> {
        let mut state = FeatureState::default();
        let of = |sample: &TrackedSample| {
            let Setpoint { velocity, acceleration, .. } = sample.setpoint;
            let ahead = velocity + self.preview * acceleration;
            self.features.advance(&mut state, ahead, acceleration, self.period)
        };
        self.samples.iter().map(of).collect()
    }
}
