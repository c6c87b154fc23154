//! From the runs of A, A0 and B to numbers.

use stickslip_core::friction::Stribeck;

use super::scenario::{BROKEN_AWAY, Quantity, REST};
use super::staircase::Staircase;
use super::{LimitCycle, Runs, Scenario, Trace};
use stickslip_base::statistics::{bootstrap, mean};

/// Difference of B from A in one measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// Name of the measure.
    pub measure: &'static str,
    /// Mean over the seeds, the same noise in A and B: E for angles, |B/A − 1| for single values, the difference of
    /// numbers for counts, the distance from the desired curve over its breakaway torque for the curve. 1 if B has no
    /// limit cycle, or no presliding loop, though A has one; NaN if B is unstable.
    pub difference: f64,
    /// 95 % interval of it.
    pub ci95: [f64; 2],
    /// Contribution of the rendering above the floor, from independent noise.
    pub excess: f64,
    /// 95 % interval of it.
    pub excess_ci95: [f64; 2],
    /// A against A with other noise, mean over the seeds. NaN with one seed; for the curve, the distance of A's own.
    pub floor: f64,
    /// Value of A, mean over the seeds: distance from A0 [rad] for angles, else the measure's own value, SI.
    pub reference: f64,
    /// Whether B was completed with every seed.
    pub stable: bool,
    /// Chatter of B's load motor [N m].
    pub chatter: f64,
    /// Error of the velocity of the load in B's law when its torque starts to act, RMS [rad/s].
    pub velocity_error: f64,
}

/// Compares B with A in all measures of its scenarios; A0 scales the angles. All have the same seeds, A all scenarios of
/// B, A0 those with angles.
pub fn scores(b: &Runs, a: &Runs, a0: &Runs) -> Vec<Score> {
    let mut scores = Vec::new();
    for (index, &scenario) in b.scenarios.iter().enumerate() {
        let arm = a.of(scenario).iter().any(|trace| trace.arm_twist.iter().any(|&twist| twist != 0.0));
        for measure in scenario.measures.iter().filter(|measure| arm || measure.of != Quantity::Twist) {
            let judge = Judge { scenario, quantity: measure.of, desired: b.desired };
            scores.push(judge.score(measure.name, &b.traces[index], a.of(scenario), a0.of(scenario)));
        }
    }
    scores
}

/// One measure.
struct Judge {
    scenario: Scenario,
    quantity: Quantity,
    desired: Stribeck<f64>,
}

impl Judge {
    fn score(&self, measure: &'static str, b: &[Trace], a: &[Trace], a0: &[Trace]) -> Score {
        let seeds = a.len();
        // With independent noise: each seed against the next.
        let other = |k: usize| (k + 1) % seeds;
        let compare = |b: &Trace, k: usize, of: usize| self.difference(b, &a[of], (a0.get(k), &a[k]));
        let stable = b.iter().all(|trace| trace.stable);
        let same: Vec<f64> = (0..seeds).map(|k| compare(&b[k], k, k)).collect();
        let apart: Vec<f64> = (0..seeds).map(|k| compare(&b[k], k, other(k))).collect();
        // A trace compared with itself gives no floor.
        let alone = seeds == 1 && self.quantity != Quantity::Curve;
        let floor = |k: usize| if alone { f64::NAN } else { compare(&a[k], k, other(k)) };
        let floors: Vec<f64> = (0..seeds).map(floor).collect();
        let square = |values: &[f64], sample: &[usize]| mean(sample.iter().map(|&k| values[k] * values[k]));
        let excess = |sample: &[usize]| {
            let more = square(&apart, sample) - square(&floors, sample);
            // Not `max`: NaN stays.
            if more < 0.0 { 0.0 } else { libm::sqrt(more) }
        };
        let all: Vec<usize> = (0..seeds).collect();
        let unless_unstable = |value: f64| if stable { value } else { f64::NAN };
        Score {
            measure,
            difference: unless_unstable(mean(same.iter().copied())),
            ci95: bootstrap(seeds, |sample| mean(sample.iter().map(|&k| same[k]))).map(unless_unstable),
            excess: unless_unstable(excess(&all)),
            excess_ci95: bootstrap(seeds, excess).map(unless_unstable),
            floor: mean(floors.iter().copied()),
            reference: mean((0..seeds).map(|k| self.reference(&a[k], a0.get(k)))),
            stable,
            chatter: mean(b.iter().map(Trace::chatter)),
            velocity_error: mean(b.iter().map(|trace| trace.velocity_error)),
        }
    }

    /// Difference of `b` from `a`; angles are scaled by the distance of two traces.
    fn difference(&self, b: &Trace, a: &Trace, scale: (Option<&Trace>, &Trace)) -> f64 {
        match self.quantity {
            Quantity::Angle | Quantity::Moving | Quantity::End => {
                self.distance(b, a) / scale.0.map_or(f64::NAN, |a0| self.distance(a0, scale.1))
            }
            Quantity::Twist => self.distance(b, a) / self.reference(a, None),
            Quantity::Curve => self.value(b),
            Quantity::Count => (self.value(b) - self.value(a)).abs(),
            Quantity::Amplitude | Quantity::Interval | Quantity::Breakaway | Quantity::Area | Quantity::Stiffness => {
                let (of_b, of_a) = (self.value(b), self.value(a));
                // A cycle or a loop of A that B lacks. Without one in A there is no comparison.
                if of_b.is_nan() && !of_a.is_nan() { 1.0 } else { (of_b / of_a - 1.0).abs() }
            }
        }
    }

    fn reference(&self, a: &Trace, a0: Option<&Trace>) -> f64 {
        match self.quantity {
            Quantity::Angle | Quantity::Moving | Quantity::End => a0.map_or(f64::NAN, |a0| self.distance(a0, a)),
            Quantity::Twist => libm::sqrt(mean(a.arm_twist.iter().map(|twist| twist * twist))),
            _ => self.value(a),
        }
    }

    /// Root mean square distance of two angles, or two twists of arms [rad], in the interval of the quantity.
    fn distance<'a>(&self, b: &'a Trace, a: &'a Trace) -> f64 {
        let from = (self.scenario.evaluated_from() / a.period) as usize;
        let samples = a.angle.len().min(b.angle.len());
        let of = |trace: &'a Trace| if self.quantity == Quantity::Twist { &trace.arm_twist } else { &trace.angle };
        let dwell = (0.1 / a.period).round() as usize;
        let moves = |k: usize| a.reference[k] != a.reference[k - 1];
        let counts = |k: &usize| match self.quantity {
            Quantity::Moving => moves(*k),
            // A dwell ends where the set-point moves next, or the run ends.
            Quantity::End => !moves(*k) && (k + dwell >= samples || (k + 1..=k + dwell).any(moves)),
            _ => true,
        };
        let squares: Vec<f64> = (from.max(1)..samples).filter(counts).map(|k| (of(b)[k] - of(a)[k]).powi(2)).collect();
        libm::sqrt(mean(squares.iter().copied()))
    }

    /// The one value of a trace; NaN if it has none.
    fn value(&self, trace: &Trace) -> f64 {
        let from = self.scenario.evaluated_from();
        match self.quantity {
            Quantity::Amplitude => LimitCycle::find(trace, from).amplitude,
            Quantity::Interval => LimitCycle::find(trace, from).interval,
            Quantity::Count => LimitCycle::find(trace, from).breakaways as f64,
            Quantity::Breakaway => trace.felt_torque.last().copied().unwrap_or(f64::NAN),
            Quantity::Area => presliding(trace, from).map_or(f64::NAN, |[area, _]| area),
            Quantity::Stiffness => presliding(trace, from).map_or(f64::NAN, |[_, stiffness]| stiffness),
            Quantity::Curve => Staircase::new().error(trace, &self.desired, REST),
            Quantity::Angle | Quantity::Moving | Quantity::End | Quantity::Twist => f64::NAN,
        }
    }
}

/// Closed loops of drive torque over angle from a time [s] on: their area [N m rad] and their stiffness from end to end
/// [N m/rad]; `None` if the load breaks away or the trace is too short.
fn presliding(trace: &Trace, from: f64) -> Option<[f64; 2]> {
    let start = ((from / trace.period) as usize).max(1);
    let work =
        |k: usize| 0.5 * (trace.felt_torque[k] + trace.felt_torque[k - 1]) * (trace.angle[k] - trace.angle[k - 1]);
    if trace.angle.len() <= start || trace.angle.iter().any(|angle| angle.abs() > BROKEN_AWAY) {
        return None;
    }
    let extent = |values: &[f64]| {
        let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), &x| (low.min(x), high.max(x)));
        high - low
    };
    let stiffness = extent(&trace.felt_torque[start..]) / extent(&trace.angle[start..]);
    Some([(start..trace.angle.len()).map(work).sum(), stiffness])
}
