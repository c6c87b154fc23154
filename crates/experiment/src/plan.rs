//! Speeds, angles and times of a friction measurement.

use std::f64::consts::TAU;

use stickslip_core::Fields;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::fields::{Relation, at_least};
use stickslip_core::scalar::Scalar;

use stickslip_base::Error;
use stickslip_bench::SpeedRamp;

/// Plan of a friction measurement at constant speeds, both directions.
///
/// Fast plateaus last whole turns, which average out the dependence on the angle. Slow ones cover an arc that is the
/// same for every speed, and the angle dependence is taken from the fast ones: a turn at each of 24 speeds from 0.05
/// rad/s would take a quarter of an hour. A slow plateau is approached in its own direction at a higher speed, so that
/// no breakaway is within it.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = FrictionPlan::law)]
pub struct FrictionPlan<T> {
    /// Slowest speed.
    #[field(symbol = "Ω_min", unit = "rad/s", range = 1e-3..=100.0, default = 0.1)]
    pub slowest: T,
    /// Fastest speed.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-2..=1000.0, default = 50.0)]
    pub fastest: T,
    /// Number of speeds, evenly spaced on a logarithmic scale.
    #[field(symbol = "n", unit = "1", range = 2.0..=200.0, default = 15.0, whole)]
    pub speeds: T,
    /// Time at a speed before its plateau.
    #[field(symbol = "T_s", unit = "s", range = 0.0..=60.0, default = 0.3)]
    pub settling_time: T,
    /// Rise and fall time of a plateau's weight, before and after its angle.
    #[field(symbol = "T_e", unit = "s", range = 1e-3..=1.0, default = 0.1)]
    pub edge_time: T,
    /// Speed from which on a plateau lasts whole turns.
    #[field(symbol = "Ω_turn", unit = "rad/s", range = 1e-2..=1000.0, default = 2.0)]
    pub whole_turns_from: T,
    /// Number of turns of a fast plateau.
    #[field(symbol = "n_t", unit = "1", range = 1.0..=100.0, default = 1.0, whole)]
    pub turns: T,
    /// Angle of a slow plateau.
    #[field(symbol = "Δφ", unit = "rad", range = 1e-2..=100.0, default = 0.2)]
    pub arc: T,
    /// Start angle of the slow plateaus.
    #[field(symbol = "φ_a", unit = "rad", range = -1e4..=1e4)]
    pub arc_begin: T,
    /// Speed between the slow plateaus.
    #[field(symbol = "Ω_a", unit = "rad/s", range = 1e-2..=100.0, default = 2.0)]
    pub approach_speed: T,
    /// Angle over which a slow plateau is approached at this speed.
    #[field(symbol = "φ_l", unit = "rad", range = 0.0..=100.0, default = 0.15)]
    pub lead_in: T,
    /// Acceleration between the speeds.
    #[field(symbol = "Ω̇", unit = "rad/s^2", range = 1.0..=1e5, default = 200.0)]
    pub acceleration: T,
}

/// Purpose of a tick of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// On the way.
    Moving,
    /// On the plateau of this velocity [rad/s].
    Plateau(f64),
}

impl<T: Scalar> FrictionPlan<T> {
    fn law(&self) -> [Relation<T>; 1] {
        [at_least("fastest", self.fastest, self.slowest, "The fastest speed is below the slowest: swap them.")]
    }
}

impl FrictionPlan<f64> {
    /// At most 45 s of bench time, 0.1 to 50 rad/s.
    pub fn quick() -> Self {
        FrictionPlan::default()
    }

    /// 24 speeds from 0.05 rad/s, longer arcs, two turns.
    pub fn thorough() -> Self {
        FrictionPlan {
            slowest: 0.05,
            speeds: 24.0,
            settling_time: 0.6,
            arc: 0.4,
            turns: 2.0,
            ..FrictionPlan::default()
        }
    }

    /// The speeds [rad/s], rising.
    pub fn speeds(&self) -> impl Iterator<Item = f64> {
        let (slowest, last) = (self.slowest, self.speeds - 1.0);
        let ratio = libm::log(self.fastest / slowest);
        (0..self.speeds as usize).map(move |k| slowest * libm::exp(ratio * k as f64 / last))
    }

    /// Angle over which a plateau of this speed lasts [rad].
    pub fn length(&self, speed: f64) -> f64 {
        if speed < self.whole_turns_from { self.arc } else { self.turns * TAU }
    }

    /// Bench time of the plan [s], from rest at an angle [rad].
    pub fn duration(&self, start: f64, dt: f64) -> f64 {
        let mut ticks = 0u64;
        let counted = self.walk(start, dt, &mut |_, _| {
            ticks += 1;
            Ok(())
        });
        debug_assert!(counted.is_ok(), "only the visitor of a walk can fail");
        ticks as f64 * dt
    }

    /// Visits every tick with its set-point and phase, from rest at an angle [rad] to rest.
    ///
    /// # Errors
    /// Those of the visitor.
    pub fn walk(
        &self,
        start: f64,
        dt: f64,
        visit: &mut dyn FnMut(Setpoint<f64>, Phase) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let mut traveller = SpeedRamp::new(start, self.acceleration, dt);
        for speed in self.speeds() {
            for sign in [1.0, -1.0] {
                if speed < self.whole_turns_from {
                    self.approach(&mut traveller, sign, speed, visit)?;
                }
                self.plateau(&mut traveller, sign * speed, dt, visit)?;
            }
        }
        while traveller.setpoint.velocity != 0.0 {
            visit(traveller.toward(0.0), Phase::Moving)?;
        }
        Ok(())
    }

    /// Moves the set-point to the start of a slow plateau's settling, in its direction.
    fn approach(
        &self,
        traveller: &mut SpeedRamp,
        sign: f64,
        speed: f64,
        visit: &mut dyn FnMut(Setpoint<f64>, Phase) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let entry = if sign > 0.0 { self.arc_begin } else { self.arc_begin + self.arc };
        let fast = self.approach_speed.max(speed);
        let settle = entry - sign * speed * (self.settling_time + 0.5 * self.edge_time);
        // Back far enough to turn round and reach the approach speed.
        let turn = settle - sign * self.lead_in;
        while sign * (traveller.setpoint.position + traveller.way_to(0.0) - turn) > 0.0 {
            visit(traveller.toward(-sign * fast), Phase::Moving)?;
        }
        while sign * (settle - traveller.setpoint.position) > sign * traveller.way_to(sign * speed) {
            visit(traveller.toward(sign * fast), Phase::Moving)?;
        }
        Ok(())
    }

    /// Accelerates to a velocity, settles, and holds it for the plateau.
    fn plateau(
        &self,
        traveller: &mut SpeedRamp,
        velocity: f64,
        dt: f64,
        visit: &mut dyn FnMut(Setpoint<f64>, Phase) -> Result<(), Error>,
    ) -> Result<(), Error> {
        while traveller.setpoint.velocity != velocity {
            visit(traveller.toward(velocity), Phase::Moving)?;
        }
        let ticks = |seconds: f64| (seconds / dt).round() as u64;
        for _ in 0..ticks(self.settling_time) {
            visit(traveller.toward(velocity), Phase::Moving)?;
        }
        for _ in 0..ticks(self.length(velocity.abs()) / velocity.abs() + self.edge_time) {
            visit(traveller.toward(velocity), Phase::Plateau(velocity))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_plan_takes_at_most_45_seconds_and_slow_plateaus_cover_the_same_arc() {
        let plan = FrictionPlan::quick();
        assert!((14.0..=16.0).contains(&plan.speeds));
        let duration = plan.duration(0.7, 250e-6);
        assert!(duration <= 45.0, "{duration} s");
        let mut arcs: Vec<(f64, f64, f64)> = Vec::new();
        plan.walk(0.7, 250e-6, &mut |setpoint, phase| {
            if let Phase::Plateau(velocity) = phase {
                assert_eq!(setpoint.velocity, velocity);
                match arcs.last_mut() {
                    Some(arc) if arc.0 == velocity => {
                        arc.1 = arc.1.min(setpoint.position);
                        arc.2 = arc.2.max(setpoint.position);
                    }
                    _ => arcs.push((velocity, setpoint.position, setpoint.position)),
                }
            }
            Ok(())
        })
        .unwrap();
        assert_eq!(arcs.len(), 30);
        for (velocity, low, high) in arcs {
            if velocity.abs() < 2.0 {
                // Within the overshoot of the approach, a tick at the approach speed. The edges are half outside.
                let edge = 0.5 * plan.edge_time * velocity.abs();
                let (low, high) = (low + edge, high - edge);
                assert!((low - 0.0).abs() < 2e-3 && (high - 0.2).abs() < 2e-3, "{velocity}: {low} … {high}");
            } else {
                let edges = plan.edge_time * velocity.abs();
                assert!((high - low - edges - TAU).abs() < 0.03, "{velocity}: {low} … {high}");
            }
        }
    }

    #[test]
    fn the_set_point_never_jumps() {
        let plan = FrictionPlan::quick();
        let mut last: Option<Setpoint<f64>> = None;
        plan.walk(-3.0, 1e-3, &mut |setpoint, _| {
            if let Some(last) = last {
                let way = 0.5 * (last.velocity + setpoint.velocity) * 1e-3;
                assert!((setpoint.position - last.position - way).abs() < 1e-12);
                assert!((setpoint.velocity - last.velocity).abs() <= 0.2 + 1e-12);
            }
            last = Some(setpoint);
            Ok(())
        })
        .unwrap();
    }

    #[test]
    fn a_failing_visitor_ends_the_walk() {
        let mut ticks = 0;
        let ended = FrictionPlan::quick().walk(0.0, 1e-3, &mut |_, _| {
            ticks += 1;
            if ticks == 10 { Err(Error::Cancelled) } else { Ok(()) }
        });
        assert!(matches!(ended, Err(Error::Cancelled)));
        assert_eq!(ticks, 10);
    }
}
