//! From a reference to one set-point a cycle.

use super::binary::BinarySequence;
use super::stroke::StrokeSequence;
use super::{Reference, Setpoint, resting};

/// Gives one [`Setpoint`] a cycle; without allocation, the same in every run.
#[derive(Clone, Copy, Debug)]
pub struct Generator<'a> {
    source: Source<'a>,
    origin: f64,
    rate: f64,
    cycle: u64,
}

/// Source of set-points.
#[derive(Clone, Copy, Debug)]
enum Source<'a> {
    /// A function of time.
    Formula(Reference<f64>),
    /// Speeds by a shift register.
    Binary(BinarySequence),
    /// Moves and rests.
    Strokes(StrokeSequence),
    /// Positions [rad] at this rate [Hz].
    Samples(&'a [f64], f64),
}

impl<'a> Generator<'a> {
    /// Follows a reference at `rate` cycles a second.
    pub fn new(reference: Reference<f64>, rate: f64) -> Self {
        let source = match reference {
            Reference::Prbs(prbs) => Source::Binary(BinarySequence::new(prbs, rate)),
            Reference::PointToPoint(moves) => Source::Strokes(StrokeSequence::point_to_point(&moves, rate)),
            Reference::RandomStrokes(strokes) => Source::Strokes(StrokeSequence::random(&strokes, rate)),
            formula => Source::Formula(formula),
        };
        Generator { source, origin: 0.0, rate, cycle: 0 }
    }

    /// Follows positions [rad] that were sampled at `sample_rate` [Hz], as read from a file, with straight lines between
    /// them; the last one stays. The velocity jumps from line to line. A NaN among the samples is passed on:
    /// controllers respond with zero torque, and the supervision with a fault.
    pub fn from_samples(samples: &'a [f64], sample_rate: f64, rate: f64) -> Self {
        Generator { source: Source::Samples(samples, sample_rate), origin: 0.0, rate, cycle: 0 }
    }

    /// The same, counted from this position [rad]: the present one, so that nothing jumps at the start.
    pub fn with_origin(mut self, position: f64) -> Self {
        self.origin = position;
        self
    }

    /// Position at the start [rad].
    pub fn origin(&self) -> f64 {
        self.origin
    }

    /// The cycle of the next set-point.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// The set-point of this cycle.
    #[expect(clippy::should_implement_trait, reason = "it never ends: an iterator's option would be unwrapped always")]
    pub fn next(&mut self) -> Setpoint<f64> {
        let time = self.cycle as f64 / self.rate;
        self.cycle += 1;
        let mut setpoint = match &mut self.source {
            Source::Formula(reference) => formula(reference, time),
            Source::Binary(sequence) => sequence.next(self.rate),
            Source::Strokes(sequence) => sequence.next(self.rate),
            Source::Samples(samples, sample_rate) => interpolated(samples, *sample_rate, time),
        };
        setpoint.position += self.origin;
        setpoint
    }
}

fn formula(reference: &Reference<f64>, time: f64) -> Setpoint<f64> {
    match reference {
        Reference::Constant(constant) => resting(constant.position),
        Reference::Steps(steps) => {
            let above = libm::floor(time / steps.hold_time) % 2.0 == 1.0;
            resting(if above { steps.height } else { 0.0 })
        }
        Reference::Ramp(ramp) => ramp.at(time),
        Reference::SpeedSweep(sweep) => sweep.at(time),
        Reference::Sine(sine) => sine.at(time),
        Reference::Chirp(chirp) => chirp.at(time),
        Reference::Multisine(multisine) => multisine.at(time),
        // These have a state and are sources of their own.
        Reference::Prbs(_) | Reference::PointToPoint(_) | Reference::RandomStrokes(_) => resting(0.0),
    }
}

fn interpolated(samples: &[f64], sample_rate: f64, time: f64) -> Setpoint<f64> {
    let place = time * sample_rate;
    // Beyond the last index the conversion saturates.
    let index = place as usize;
    let (Some(&here), Some(&there)) = (samples.get(index), samples.get(index.saturating_add(1))) else {
        return resting(samples.last().copied().unwrap_or(0.0));
    };
    let position = here + (there - here) * (place - index as f64);
    Setpoint { position, velocity: (there - here) * sample_rate, acceleration: 0.0 }
}
