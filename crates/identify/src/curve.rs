//! The friction curve from the balance of forces: F − M·q̈ over speed, both through the same low-pass.

use super::motion::Motion;
use stickslip_fit::CurvePoint;

/// Friction over speed, both directions, slowest negative speed first… fastest positive speed last.
#[derive(Clone, Debug, PartialEq)]
pub struct FrictionCurve {
    /// All motion, in bins of speed.
    pub points: Vec<CurvePoint>,
    /// Stretches of constant speed alone.
    pub plateaus: Vec<Plateau>,
    /// Speed below which the low-pass mixes both directions, so that there is no result [m/s or rad/s].
    pub slowest: f64,
}

/// Friction at one constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plateau {
    /// Mean over all stretches, with the standard error from their scatter.
    pub point: CurvePoint,
    /// Standard deviation of single samples [N or N m].
    pub deviation: f64,
    /// Number of stretches.
    pub stretches: usize,
    /// Number of samples.
    pub samples: usize,
}

/// Bins for each direction, evenly spaced in the logarithm of speed.
const BINS: usize = 24;
/// Fewest crossings of a bin for a scatter.
const PASSES: usize = 3;

/// One crossing of a bin, or one stretch of constant speed.
#[derive(Clone, Copy, Debug, Default)]
struct Pass {
    velocity: f64,
    force: f64,
    square: f64,
    samples: usize,
}

impl Pass {
    fn add(&mut self, velocity: f64, force: f64) {
        self.velocity += velocity;
        self.force += force;
        self.square += force * force;
        self.samples += 1;
    }

    fn mean(&self) -> (f64, f64) {
        (self.velocity / self.samples as f64, self.force / self.samples as f64)
    }
}

impl FrictionCurve {
    /// From a motion, without its first `skip` samples, and the inertia. `low_pass` [Hz] is the cut-off of the motion's
    /// low-pass.
    pub fn of(motion: &Motion, inertia: f64, low_pass: f64, skip: usize) -> Self {
        // At its end the low-pass continues the recording without its acceleration.
        let edge = ((3.0 / (low_pass * motion.period)) as usize).min(motion.samples() / 10);
        let range = skip..motion.samples() - edge;
        let fast = quantile(motion.acceleration[range.clone()].iter().map(|a| a.abs()).collect(), 0.99);
        // Rise time of the low-pass, 0.34/f: over this time a reversal affects the speeds around it.
        let slowest = fast * 0.34 / low_pass;
        let fastest = motion.velocity[range.clone()].iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let bin = |i: usize| {
            let velocity = motion.velocity[i];
            let share = libm::log(velocity.abs() / slowest) / libm::log(fastest / slowest);
            (share >= 0.0).then(|| (velocity > 0.0, ((share * BINS as f64) as usize).min(BINS - 1)))
        };
        let friction = |i: usize| motion.smooth_force[i] - inertia * motion.acceleration[i];
        let steady = |i: usize| {
            let constant = motion.velocity[i].abs() > slowest && motion.acceleration[i].abs() < 0.05 * fast;
            constant.then_some(motion.velocity[i] > 0.0)
        };
        let sample = |i: usize| (motion.velocity[i], friction(i));
        let mut points: Vec<CurvePoint> = Vec::new();
        let passes = passes(range.clone(), bin, sample);
        for forward in [false, true] {
            for k in 0..BINS {
                let here: Vec<Pass> = passes.iter().filter(|p| p.0 == (forward, k)).map(|p| p.1).collect();
                points.extend(summarise(&here).filter(|_| here.len() >= PASSES));
            }
        }
        points.sort_by(|a, b| a.velocity.total_cmp(&b.velocity));
        // Shorter than five periods of the cut-off it is not a plateau but a zero crossing of the acceleration.
        let shortest = (5.0 / (low_pass * motion.period)) as usize;
        let stretches = self::passes(range, steady, sample).into_iter().map(|p| p.1).filter(|p| p.samples >= shortest);
        FrictionCurve { points, plateaus: plateaus(stretches.collect()), slowest }
    }
}

/// Runs of samples that share a key.
fn passes<K: PartialEq + Copy>(
    range: std::ops::Range<usize>,
    key: impl Fn(usize) -> Option<K>,
    sample: impl Fn(usize) -> (f64, f64),
) -> Vec<(K, Pass)> {
    let mut passes: Vec<(K, Pass)> = Vec::new();
    let mut last = None;
    for i in range {
        let now = key(i);
        if let Some(now) = now {
            if last != Some(now) {
                passes.push((now, Pass::default()));
            }
            let (velocity, force) = sample(i);
            if let Some((_, pass)) = passes.last_mut() {
                pass.add(velocity, force);
            }
        }
        last = now;
    }
    passes
}

/// Each pass is one observation: its samples are correlated.
fn summarise(passes: &[Pass]) -> Option<CurvePoint> {
    let n = passes.len() as f64;
    let means: Vec<(f64, f64)> = passes.iter().map(Pass::mean).collect();
    let (velocity, torque) = means.iter().fold((0.0, 0.0), |(v, f), m| (v + m.0 / n, f + m.1 / n));
    let variance = means.iter().map(|m| (m.1 - torque).powi(2)).sum::<f64>() / (n - 1.0);
    let standard_error = (variance / n).sqrt();
    (passes.len() >= 2 && standard_error > 0.0).then_some(CurvePoint { velocity, torque, standard_error })
}

/// Stretches whose speeds are within 5 % of each other belong to one plateau.
fn plateaus(mut stretches: Vec<Pass>) -> Vec<Plateau> {
    stretches.sort_by(|a, b| a.mean().0.total_cmp(&b.mean().0));
    let mut plateaus = Vec::new();
    for group in stretches.chunk_by(|a, b| (b.mean().0 - a.mean().0).abs() < 0.05 * a.mean().0.abs()) {
        let samples: usize = group.iter().map(|p| p.samples).sum();
        let mean = group.iter().map(|p| p.force).sum::<f64>() / samples as f64;
        let square = group.iter().map(|p| p.square).sum::<f64>() / samples as f64;
        let deviation = (square - mean * mean).max(0.0).sqrt();
        plateaus.extend(summarise(group).map(|point| Plateau { point, deviation, stretches: group.len(), samples }));
    }
    plateaus
}

fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let k = ((values.len() - 1) as f64 * share) as usize;
    *values.select_nth_unstable_by(k, f64::total_cmp).1
}
