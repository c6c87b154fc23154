//! Constant speeds one after the other, in both directions: the friction of the load at each.

use std::f64::consts::TAU;

use stickslip_core::control::reference::Setpoint;
use stickslip_core::friction::Stribeck;

use super::Trace;

/// Slowest and fastest speed [rad/s].
const RANGE: [f64; 2] = [0.05, 50.0];
/// Number of speeds.
const SPEEDS: usize = 12;
/// Speed from which on a plateau is a whole number of turns [rad/s].
const WHOLE_TURNS: f64 = 2.0;
/// Arc of slower plateaus [rad].
const ARC: f64 = 0.1;
/// Least duration of a plateau, and of its settling before [s].
const LEAST: f64 = 0.3;
/// Least way of the settling [rad]: after a reversal the load sticks until the controller has caught up, and then runs
/// ahead.
const SETTLING: f64 = 0.05;
/// Acceleration between the plateaus [rad/s²].
const ACCELERATION: f64 = 300.0;

/// A time of constant acceleration.
#[derive(Clone, Copy)]
struct Segment {
    start_time: f64,
    start: Setpoint<f64>,
}

/// The staircase, from rest at angle 0.
pub(super) struct Staircase {
    segments: Vec<Segment>,
    /// Velocity [rad/s], start and end [s] of each plateau: forth and back at a speed, then the next.
    plateaus: Vec<(f64, [f64; 2])>,
    duration: f64,
}

impl Staircase {
    /// Plans it.
    pub(super) fn new() -> Self {
        let mut plan = Staircase { segments: Vec::new(), plateaus: Vec::new(), duration: 0.0 };
        let mut at = Setpoint::default();
        for k in 0..SPEEDS {
            let share = k as f64 / (SPEEDS - 1) as f64;
            let speed = RANGE[0] * libm::pow(RANGE[1] / RANGE[0], share);
            let turns = libm::ceil(LEAST * speed / TAU).max(1.0);
            let hold = if speed < WHOLE_TURNS { (ARC / speed).max(LEAST) } else { turns * TAU / speed };
            for velocity in [speed, -speed] {
                let change = velocity - at.velocity;
                at.acceleration = ACCELERATION.copysign(change);
                plan.push(&mut at, change.abs() / ACCELERATION);
                (at.velocity, at.acceleration) = (velocity, 0.0);
                plan.push(&mut at, (SETTLING / speed).max(LEAST));
                let start = plan.duration;
                plan.push(&mut at, hold);
                plan.plateaus.push((velocity, [start, plan.duration]));
            }
        }
        plan
    }

    fn push(&mut self, at: &mut Setpoint<f64>, time: f64) {
        self.segments.push(Segment { start_time: self.duration, start: *at });
        *at = after(at, time);
        self.duration += time;
    }

    /// Duration [s].
    pub(super) fn duration(&self) -> f64 {
        self.duration
    }

    /// The set-point at a time [s].
    pub(super) fn at(&self, time: f64) -> Setpoint<f64> {
        let next = self.segments.partition_point(|segment| segment.start_time <= time);
        match next.checked_sub(1).map(|k| self.segments[k]) {
            Some(segment) => after(&segment.start, time - segment.start_time),
            None => Setpoint::default(),
        }
    }

    /// Speed [rad/s], rendered and desired friction [N m] of each plateau: rendered is the odd part of the mean
    /// resistance of the load, and desired that at its true mean speed. The staircase starts at `rest` [s] in the
    /// trace. NaN if the trace ends before.
    pub(super) fn curve(&self, trace: &Trace, desired: &Stribeck<f64>, rest: f64) -> Vec<[f64; 3]> {
        let means = |[start, end]: [f64; 2]| {
            let sample = |time: f64| ((rest + time) / trace.period).round() as usize;
            let (start, end) = (sample(start), sample(end).min(trace.resisting_torque.len()));
            if start + 1 >= end {
                return [f64::NAN; 2];
            }
            let way = trace.angle[end - 1] - trace.angle[start];
            let torque: f64 = trace.resisting_torque[start..end].iter().sum();
            [way / ((end - 1 - start) as f64 * trace.period), torque / (end - start) as f64]
        };
        let point = |pair: &[(f64, [f64; 2])]| {
            let (forth, back) = (means(pair[0].1), means(pair[1].1));
            let [speed, rendered] = [0, 1].map(|k| 0.5 * (forth[k] - back[k]));
            [speed, rendered, desired.torque(speed)]
        };
        self.plateaus.chunks_exact(2).map(point).collect()
    }

    /// RMS of rendered minus desired friction over the speeds, as a share of the desired breakaway torque.
    pub(super) fn error(&self, trace: &Trace, desired: &Stribeck<f64>, rest: f64) -> f64 {
        let curve = self.curve(trace, desired, rest);
        let squares = curve.iter().map(|[_, rendered, desired]| (rendered - desired).powi(2));
        libm::sqrt(squares.sum::<f64>() / SPEEDS as f64) / desired.breakaway_torque
    }
}

/// The set-point a time [s] later at the same acceleration.
fn after(start: &Setpoint<f64>, time: f64) -> Setpoint<f64> {
    Setpoint {
        position: start.position + (start.velocity + 0.5 * start.acceleration * time) * time,
        velocity: start.velocity + start.acceleration * time,
        acceleration: start.acceleration,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trace of a load with exactly this curve, on a staircase that starts at once.
    fn resisted(staircase: &Staircase, curve: impl Fn(f64) -> f64) -> Trace {
        let period = 1e-3;
        let samples = (staircase.duration() / period) as usize + 1;
        let (angle, resisting_torque) = (0..samples)
            .map(|k| staircase.at(k as f64 * period))
            .map(|setpoint| (setpoint.position, curve(setpoint.velocity)))
            .unzip();
        Trace { period, angle, resisting_torque, ..Trace::default() }
    }

    #[test]
    fn neither_position_nor_velocity_jumps() {
        let staircase = Staircase::new();
        let step = 1e-4;
        let mut last = staircase.at(0.0);
        assert_eq!(last.velocity, 0.0);
        for k in 1..(staircase.duration() / step) as usize {
            let next = staircase.at(k as f64 * step);
            assert!((next.velocity - last.velocity).abs() <= ACCELERATION * step * 1.001, "{next:?}");
            let way = 0.5 * (next.velocity + last.velocity) * step;
            assert!((next.position - last.position - way).abs() <= ACCELERATION * step * step, "{next:?}");
            last = next;
        }
    }

    #[test]
    fn the_desired_curve_has_no_error_and_an_offset_none_either() {
        let (staircase, desired) = (Staircase::new(), Stribeck::default());
        let exact = resisted(&staircase, |velocity| desired.torque(velocity) + 0.05);
        // The ends of a plateau are between samples: its mean speed is that of the set-point within a share of 1e-9.
        assert!(staircase.error(&exact, &desired, 0.0) < 1e-9);
        let scaled = resisted(&staircase, |velocity| velocity.signum() * (desired.magnitude(velocity.abs()) + 0.003));
        assert!((staircase.error(&scaled, &desired, 0.0) - 0.01).abs() < 1e-9, "1 % of M_S = 0.3 N m");
    }

    #[test]
    fn friction_is_evaluated_at_the_true_speed_of_the_load() {
        let (staircase, desired) = (Staircase::new(), Stribeck::default());
        // All speeds a fifth below their set-points.
        let mut slow = resisted(&staircase, |velocity| desired.torque(0.8 * velocity));
        let at_the_set_speed = staircase.error(&slow, &desired, 0.0);
        slow.angle.iter_mut().for_each(|angle| *angle *= 0.8);
        assert!(staircase.error(&slow, &desired, 0.0) < 1e-9 && at_the_set_speed > 0.01, "{at_the_set_speed}");
    }

    #[test]
    fn an_incomplete_run_has_no_curve() {
        let (staircase, desired) = (Staircase::new(), Stribeck::default());
        let mut cut = resisted(&staircase, |velocity| desired.torque(velocity));
        cut.resisting_torque.truncate(5000);
        cut.angle.truncate(5000);
        assert!(staircase.error(&cut, &desired, 0.0).is_nan());
    }
}
