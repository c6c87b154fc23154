//! Jerk-limited moves from rest to rest.

use super::{Setpoint, resting};
use crate::Fields;

/// Limits of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct MotionLimits<T> {
    /// Highest speed.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-3..=1e4, default = 50.0)]
    pub velocity: T,
    /// Highest acceleration.
    #[field(symbol = "α_max", unit = "rad/s^2", range = 1e-3..=1e6, default = 300.0)]
    pub acceleration: T,
    /// Highest change of the acceleration.
    #[field(symbol = "j_max", unit = "rad/s^3", range = 1e-3..=1e9, default = 30000.0)]
    pub jerk: T,
}

/// Moves forward and back in seven segments, with a rest between. Only the jerk jumps.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct PointToPoint<T> {
    /// Distance; negative moves backwards first.
    #[field(symbol = "r₀", unit = "rad", range = -1e5..=1e5, default = 10.0)]
    pub distance: T,
    /// Limits of the motion.
    pub limits: MotionLimits<T>,
    /// Rest after each move.
    #[field(symbol = "T", unit = "s", range = 0.0..=1e5, default = 0.55)]
    pub dwell_time: T,
    /// Number of moves: 1 goes there and stays, 2 returns.
    #[field(symbol = "n", unit = "1", whole, range = 1.0..=1e6, default = 1.0)]
    pub moves: T,
}

/// Moves to random targets within ± a range, endless. Only the jerk jumps.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct RandomStrokes<T> {
    /// Farthest target from the origin, to either side.
    #[field(symbol = "r₀", unit = "rad", range = 1e-6..=1e5, default = 20.0)]
    pub range: T,
    /// Limits of the motion.
    pub limits: MotionLimits<T>,
    /// Rest after each move.
    #[field(symbol = "T", unit = "s", range = 0.0..=1e5, default = 0.1)]
    pub dwell_time: T,
    /// Seed of the sequence; the same seed gives the same targets.
    #[field(unit = "1", whole, range = 0.0..=9007199254740991.0, default = 1.0)]
    pub seed: T,
}

impl PointToPoint<f64> {
    /// Time of all moves and rests [s].
    pub fn duration(&self) -> f64 {
        self.moves * (Stroke::plan(self.distance, &self.limits).duration() + self.dwell_time)
    }
}

/// One planned move: the fastest with these limits, "double S" of seven segments.
///
/// Biagiotti and Melchiorri, *Trajectory Planning for Automatic Machines and Robots* (2008), section 3.4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Distance [rad].
    distance: f64,
    /// Jerk [rad/s³], signed as the distance.
    jerk: f64,
    /// Time of one jerk, of the whole acceleration, at constant speed [s].
    jerk_time: f64,
    acceleration_time: f64,
    cruise_time: f64,
}

impl Stroke {
    /// Plans a move over this distance [rad].
    pub fn plan(distance: f64, limits: &MotionLimits<f64>) -> Self {
        let (length, jerk) = (distance.abs(), limits.jerk);
        let jerk = if distance < 0.0 { -jerk } else { jerk };
        let stroke = |jerk_time, acceleration_time, cruise_time| Stroke {
            distance,
            jerk,
            jerk_time,
            acceleration_time,
            cruise_time,
        };
        // With a cruise: whether the acceleration is reached depends on the speed.
        let ramp = limits.acceleration / limits.jerk;
        let reaches = limits.velocity >= limits.acceleration * ramp;
        let jerk_time = if reaches { ramp } else { libm::sqrt(limits.velocity / limits.jerk) };
        let acceleration_time = if reaches { limits.velocity / limits.acceleration + ramp } else { 2.0 * jerk_time };
        let cruise_time = length / limits.velocity - acceleration_time;
        if cruise_time >= 0.0 {
            return stroke(jerk_time, acceleration_time, cruise_time);
        }
        // Too short for the speed. Peak speed from v²/α + v·α/j = length, if that reaches the acceleration.
        let peak = 0.5 * limits.acceleration * (libm::sqrt(ramp * ramp + 4.0 * length / limits.acceleration) - ramp);
        if peak >= limits.acceleration * ramp {
            return stroke(ramp, peak / limits.acceleration + ramp, 0.0);
        }
        // Too short for the acceleration as well: four jerks, length = 2·j·t³.
        let jerk_time = libm::cbrt(0.5 * length / limits.jerk);
        stroke(jerk_time, 2.0 * jerk_time, 0.0)
    }

    /// From rest to rest [s].
    pub fn duration(&self) -> f64 {
        2.0 * self.acceleration_time + self.cruise_time
    }

    /// The set-point `time` [s] after the start, at rest before and after.
    pub fn at(&self, time: f64) -> Setpoint<f64> {
        let total = self.duration();
        if time >= total {
            return resting(self.distance);
        }
        if time <= 0.5 * total {
            return self.rise(time.max(0.0));
        }
        // The second half is the first one backwards.
        let mirror = self.rise(total - time);
        let position = self.distance - mirror.position;
        Setpoint { position, velocity: mirror.velocity, acceleration: -mirror.acceleration }
    }

    /// First half: jerk up, constant acceleration, jerk down, constant speed.
    fn rise(&self, time: f64) -> Setpoint<f64> {
        let (jerk, first, whole) = (self.jerk, self.jerk_time, self.acceleration_time);
        let acceleration = jerk * first;
        let velocity = acceleration * (whole - first);
        if time < first {
            let (v, a) = (0.5 * jerk * time * time, jerk * time);
            Setpoint { position: v * time / 3.0, velocity: v, acceleration: a }
        } else if time < whole - first {
            let v = acceleration * (time - 0.5 * first);
            let position = acceleration * (first * first / 6.0 + 0.5 * time * (time - first));
            Setpoint { position, velocity: v, acceleration }
        } else if time < whole {
            let left = whole - time;
            let position = velocity * (0.5 * whole - left) + jerk * left * left * left / 6.0;
            Setpoint { position, velocity: velocity - 0.5 * jerk * left * left, acceleration: jerk * left }
        } else {
            Setpoint { position: velocity * (time - 0.5 * whole), velocity, acceleration: 0.0 }
        }
    }
}

/// Targets of the moves of a sequence.
#[derive(Clone, Copy, Debug)]
enum Targets {
    Alternating { distance: f64, moves: f64 },
    Random { range: f64, seed: u64 },
}

impl Targets {
    /// The target of a move [rad]; `None` after the last one.
    fn get(&self, index: u64) -> Option<f64> {
        match *self {
            Targets::Alternating { distance, moves } => {
                ((index as f64) < moves).then_some(if index.is_multiple_of(2) { distance } else { 0.0 })
            }
            Targets::Random { range, seed } => Some(range * (2.0 * uniform(seed, index) - 1.0)),
        }
    }
}

/// A number in 0 … 1 that depends on seed and index alone (SplitMix64; Steele, Lea, Flood 2014).
fn uniform(seed: u64, index: u64) -> f64 {
    let z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
}

/// Moves and rests one after the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct StrokeSequence {
    targets: Targets,
    limits: MotionLimits<f64>,
    dwell_time: f64,
    stroke: Stroke,
    /// Start of the present move [rad], and the cycles since then and until the next.
    from: f64,
    within: u64,
    length: u64,
    index: u64,
}

impl StrokeSequence {
    /// Forward and back; `rate` in cycles a second.
    pub(super) fn point_to_point(moves: &PointToPoint<f64>, rate: f64) -> Self {
        let targets = Targets::Alternating { distance: moves.distance, moves: moves.moves };
        Self::new(targets, moves.limits, moves.dwell_time, rate)
    }

    /// To random targets; `rate` in cycles a second.
    pub(super) fn random(strokes: &RandomStrokes<f64>, rate: f64) -> Self {
        let targets = Targets::Random { range: strokes.range, seed: strokes.seed as u64 };
        Self::new(targets, strokes.limits, strokes.dwell_time, rate)
    }

    fn new(targets: Targets, limits: MotionLimits<f64>, dwell_time: f64, rate: f64) -> Self {
        let stroke = Stroke::plan(0.0, &limits);
        let mut sequence =
            StrokeSequence { targets, limits, dwell_time, stroke, from: 0.0, within: 0, length: 0, index: 0 };
        sequence.begin(rate);
        sequence
    }

    /// The next move, or rest for ever.
    fn begin(&mut self, rate: f64) {
        let from = self.from + self.stroke.distance;
        let Some(target) = self.targets.get(self.index) else {
            self.length = u64::MAX;
            return;
        };
        self.stroke = Stroke::plan(target - from, &self.limits);
        self.length = (libm::ceil((self.stroke.duration() + self.dwell_time) * rate) as u64).max(1);
        (self.from, self.within) = (from, 0);
        self.index += 1;
    }

    /// The set-point of this cycle.
    pub(super) fn next(&mut self, rate: f64) -> Setpoint<f64> {
        if self.within >= self.length {
            self.begin(rate);
        }
        let mut setpoint = self.stroke.at(self.within as f64 / rate);
        setpoint.position += self.from;
        self.within += 1;
        setpoint
    }
}
