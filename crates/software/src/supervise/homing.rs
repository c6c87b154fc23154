//! Homing: determines the zero of the screw's angle.
//!
//! An incremental encoder counts from its position at power-on; its index pulse comes once per revolution. Sequence:
//! approach, find the index, back off, approach again slowly, set zero. The slow second pass gives the angle; its
//! agreement with the first pass shows that both detected the same, real index.

use core::f64::consts::TAU;
use core::fmt;

use stickslip_core::Fields;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::fields::{Relation, at_most};
use stickslip_core::scalar::Scalar;

/// Revolutions without an index after which the search is given up.
const SEARCHED_TURNS: f64 = 1.5;

/// Plan of homing.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = HomingPlan::law)]
pub struct HomingPlan<T> {
    /// Velocity of the search; its sign is the direction of both passes.
    #[field(symbol = "Ω", unit = "rad/s", range = -200.0..=200.0, default = 10.0)]
    pub search_velocity: T,
    /// Speed of the slow pass.
    #[field(symbol = "Ω_slow", unit = "rad/s", range = 1e-3..=50.0, default = 1.0)]
    pub creep_speed: T,
    /// Acceleration of the set-point.
    #[field(symbol = "α", unit = "rad/s^2", range = 1e-2..=1e5, default = 100.0)]
    pub acceleration: T,
    /// Distance behind the index at which the screw reverses for the slow pass.
    #[field(symbol = "φ_b", unit = "rad", range = 1e-3..=4.0, default = 0.3)]
    pub back_off: T,
    /// Largest difference of the index between both passes: a few counts.
    #[field(symbol = "Δφ", unit = "rad", range = 1e-6..=0.1, default = 0.005)]
    pub repeatability: T,
}

impl<T: Scalar> HomingPlan<T> {
    /// Backing off must not reach the index of the previous revolution.
    fn law(&self) -> [Relation<T>; 1] {
        let braking = T::of(0.5) * self.search_velocity * self.search_velocity / self.acceleration;
        let remedy = "Search more slowly, or allow more acceleration: backing off ends before the next index.";
        [at_most("back_off", self.back_off, T::of(0.8 * TAU) - braking, remedy)]
    }
}

/// Inputs of homing in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingInput {
    /// Unwrapped screw angle [rad], counted from power-on of the encoder.
    pub angle: f64,
    /// This angle as latched at an index pulse since the last cycle [rad].
    pub index: Option<f64>,
}

/// Fault of homing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HomingFault {
    /// No index within a revolution and a half.
    NoIndex {
        /// Searched distance [rad].
        travel: f64,
    },
    /// The slow pass did not find the index.
    IndexLost {
        /// Index of the fast pass [rad].
        expected: f64,
    },
    /// The two passes disagree.
    IndexMoved {
        /// In the fast pass [rad].
        first: f64,
        /// In the slow pass [rad].
        second: f64,
    },
    /// The encoder's angle is not finite.
    NotANumber,
}

impl fmt::Display for HomingFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        super::Fault::Homing(*self).fmt(f)
    }
}

impl HomingFault {
    /// The cause, with the measured values.
    pub(super) fn write_cause(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            HomingFault::NoIndex { travel } => {
                write!(f, "no index pulse within {travel:.2} rad; one is expected every {TAU:.2} rad.")
            }
            HomingFault::IndexLost { expected } => {
                write!(f, "the index of the fast pass at {expected:.4} rad did not appear in the slow one.")
            }
            HomingFault::IndexMoved { first, second } => {
                write!(f, "the index was at {first:.4} rad in the fast pass and at {second:.4} rad in the slow one.")
            }
            HomingFault::NotANumber => write!(f, "the encoder's angle is not finite."),
        }
    }
}

/// Progress of homing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HomingProgress {
    /// Searching.
    Moving,
    /// At rest again; the screw's zero is where the index was latched in the slow pass.
    Homed {
        /// Angle of the index [rad].
        index: f64,
    },
    /// Failed; the set-point comes to rest.
    Failed(HomingFault),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    Search,
    BackOff { first: f64 },
    Creep { first: f64 },
    Stop { index: f64 },
    Failed(HomingFault),
}

/// An active search for the index.
#[derive(Clone, Copy, Debug)]
pub struct Homing {
    plan: HomingPlan<f64>,
    phase: Phase,
    start: f64,
    setpoint: Setpoint<f64>,
}

impl Homing {
    /// Starts at rest at this angle [rad].
    pub fn begin(plan: HomingPlan<f64>, angle: f64) -> Self {
        let setpoint = Setpoint { position: angle, velocity: 0.0, acceleration: 0.0 };
        Homing { plan, phase: Phase::Search, start: angle, setpoint }
    }

    /// One cycle of `dt` [s]: the set-point to follow, without jumps in position and velocity, and the progress.
    pub fn step(&mut self, input: HomingInput, dt: f64) -> (Setpoint<f64>, HomingProgress) {
        self.phase = self.next_phase(input);
        let wanted = match self.phase {
            Phase::Search => self.plan.search_velocity,
            Phase::BackOff { .. } => -self.plan.search_velocity,
            Phase::Creep { .. } => self.plan.creep_speed * self.direction(),
            Phase::Stop { .. } | Phase::Failed(_) => 0.0,
        };
        self.drive(wanted, dt);
        let progress = match self.phase {
            Phase::Stop { index } if self.setpoint.velocity == 0.0 => HomingProgress::Homed { index },
            Phase::Failed(fault) => HomingProgress::Failed(fault),
            _ => HomingProgress::Moving,
        };
        (self.setpoint, progress)
    }

    fn direction(&self) -> f64 {
        if self.plan.search_velocity < 0.0 { -1.0 } else { 1.0 }
    }

    fn next_phase(&self, input: HomingInput) -> Phase {
        if let Phase::Failed(_) | Phase::Stop { .. } = self.phase {
            return self.phase;
        }
        if !(input.angle.is_finite() && input.index.unwrap_or(0.0).is_finite()) {
            return Phase::Failed(HomingFault::NotANumber);
        }
        // Distance ahead of an angle, in the direction of the search.
        let ahead = |of: f64| (self.setpoint.position - of) * self.direction();
        match (self.phase, input.index) {
            (Phase::Search, Some(first)) => Phase::BackOff { first },
            (Phase::Search, None) if ahead(self.start) > SEARCHED_TURNS * TAU => {
                Phase::Failed(HomingFault::NoIndex { travel: ahead(self.start) })
            }
            // A pulse while backing off is ignored: it is that of the wrong direction.
            (Phase::BackOff { first }, _) if ahead(first) < -self.plan.back_off => Phase::Creep { first },
            (Phase::Creep { first }, Some(second)) => {
                if (second - first).abs() <= self.plan.repeatability {
                    Phase::Stop { index: second }
                } else {
                    Phase::Failed(HomingFault::IndexMoved { first, second })
                }
            }
            (Phase::Creep { first }, None) if ahead(first) > self.plan.back_off => {
                Phase::Failed(HomingFault::IndexLost { expected: first })
            }
            (phase, _) => phase,
        }
    }

    /// Moves the set-point's velocity towards the wanted one [rad/s].
    fn drive(&mut self, wanted: f64, dt: f64) {
        let before = self.setpoint.velocity;
        let most = self.plan.acceleration * dt;
        let change = (wanted - before).clamp(-most, most);
        // Within one step of the wanted velocity it is reached exactly: rounding must not prevent rest.
        let velocity = if (wanted - before).abs() <= most { wanted } else { before + change };
        self.setpoint = Setpoint {
            position: self.setpoint.position + 0.5 * (before + velocity) * dt,
            velocity,
            acceleration: change / dt,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    const DT: f64 = 250e-6;

    /// An axis that lags 2 ms behind, with an index at this angle and every revolution from there.
    struct Axis {
        angle: f64,
        index: Option<f64>,
    }

    impl Axis {
        fn follow(&mut self, position: f64) -> HomingInput {
            let before = self.angle;
            self.angle += (position - self.angle) * DT / 2e-3;
            let index = self.index.and_then(|index| {
                let (low, high) = (before.min(self.angle), before.max(self.angle));
                let near = index + ((low - index) / TAU).ceil() * TAU;
                (near < high).then_some(near)
            });
            HomingInput { angle: self.angle, index }
        }
    }

    /// Homes with a disturbance of the measurements; returns the set-points and the last progress.
    fn home(
        plan: HomingPlan<f64>,
        mut axis: Axis,
        mut disturb: impl FnMut(usize, &mut HomingInput),
    ) -> (Vec<Setpoint<f64>>, HomingProgress) {
        let mut homing = Homing::begin(plan, axis.angle);
        let mut input = HomingInput { angle: axis.angle, index: None };
        let mut setpoints = Vec::new();
        for cycle in 0..40_000 {
            disturb(cycle, &mut input);
            let (setpoint, progress) = homing.step(input, DT);
            setpoints.push(setpoint);
            if progress != HomingProgress::Moving && setpoint.velocity == 0.0 {
                return (setpoints, progress);
            }
            input = axis.follow(setpoint.position);
        }
        (setpoints, HomingProgress::Moving)
    }

    #[test]
    fn the_index_is_found_from_anywhere_in_both_directions() {
        for search_velocity in [10.0, -10.0] {
            for start in 0..24 {
                let plan = HomingPlan { search_velocity, ..HomingPlan::default() };
                let axis = Axis { angle: f64::from(start) * 0.3, index: Some(100.123) };
                let (setpoints, progress) = home(plan, axis, |_, _| {});
                let HomingProgress::Homed { index } = progress else { panic!("{start}: {progress:?}") };
                let turns = (index - 100.123) / TAU;
                assert!((turns - turns.round()).abs() < 1e-9, "{index} is not at an index");
                let travel = setpoints.iter().map(|s| (s.position - f64::from(start) * 0.3).abs()).fold(0.0, f64::max);
                assert!(travel < SEARCHED_TURNS * TAU, "{travel}");
            }
        }
    }

    #[test]
    fn set_points_do_not_jump() {
        let plan = HomingPlan::default();
        let (setpoints, _) = home(plan, Axis { angle: 1.0, index: Some(3.0) }, |_, _| {});
        assert_eq!(setpoints[setpoints.len() - 1].velocity, 0.0);
        for pair in setpoints.windows(2) {
            let mean = 0.5 * (pair[0].velocity + pair[1].velocity);
            assert!((pair[1].position - pair[0].position - mean * DT).abs() < 1e-12);
            assert!((pair[1].velocity - pair[0].velocity).abs() <= plan.acceleration * DT * (1.0 + 1e-12));
            assert!((pair[1].velocity - pair[0].velocity - pair[1].acceleration * DT).abs() < 1e-12);
        }
        assert!(setpoints.iter().any(|s| s.velocity == -10.0), "it backs off");
        assert!(setpoints.iter().filter(|s| s.velocity == 1.0).count() > 100, "it comes back slowly");
    }

    #[test]
    fn a_removed_index_pulse_is_a_fault_after_a_revolution_and_a_half() {
        let (setpoints, progress) = home(HomingPlan::default(), Axis { angle: 0.0, index: None }, |_, _| {});
        let HomingProgress::Failed(HomingFault::NoIndex { travel }) = progress else { panic!("{progress:?}") };
        assert!(travel > 1.5 * TAU && travel < 1.5 * TAU + 0.01, "{travel}");
        // Braking takes 10²/(2·100) rad more.
        assert!(setpoints[setpoints.len() - 1].position < 1.5 * TAU + 0.51);
        let text = HomingFault::NoIndex { travel }.to_string();
        assert!(text.contains("9.42 rad") || text.contains("9.43 rad"), "{text}");
    }

    #[test]
    fn an_index_that_does_not_come_again_is_a_fault() {
        let mut seen = 0;
        let (_, progress) = home(HomingPlan::default(), Axis { angle: 0.0, index: Some(3.0) }, |_, input| {
            seen += usize::from(input.index.is_some());
            if seen > 1 {
                input.index = None;
            }
        });
        assert!(matches!(progress, HomingProgress::Failed(HomingFault::IndexLost { expected }) if expected == 3.0));
    }

    #[test]
    fn an_index_at_two_places_is_a_fault() {
        // A disturbance on the wire is taken for the index first.
        let mut disturbed = false;
        let (_, progress) = home(HomingPlan::default(), Axis { angle: 0.0, index: Some(3.0) }, |_, input| {
            if !disturbed && input.angle > 2.9 {
                (input.index, disturbed) = (Some(input.angle), true);
            }
        });
        let HomingProgress::Failed(HomingFault::IndexMoved { first, second }) = progress else {
            panic!("{progress:?}")
        };
        assert!(second == 3.0 && (first - second).abs() > 0.005, "{first} {second}");
    }

    #[test]
    fn a_non_finite_angle_is_a_fault() {
        for bad in [f64::NAN, f64::INFINITY] {
            let axis = || Axis { angle: 0.0, index: Some(3.0) };
            let angle = home(HomingPlan::default(), axis(), |cycle, input| {
                if cycle == 100 {
                    input.angle = bad;
                }
            });
            let latched = home(HomingPlan::default(), axis(), |cycle, input| {
                if cycle == 100 {
                    input.index = Some(bad);
                }
            });
            for (setpoints, progress) in [angle, latched] {
                assert_eq!(progress, HomingProgress::Failed(HomingFault::NotANumber));
                assert!(setpoints.iter().all(|s| s.position.is_finite()));
            }
        }
    }

    #[test]
    fn backing_off_may_not_reach_the_next_index() {
        assert_eq!(HomingPlan::<f64>::default().law()[0].check(), Ok(()));
        let fast = HomingPlan { search_velocity: -50.0, ..HomingPlan::default() };
        assert_eq!(
            fast.law()[0].check().map_err(|error| error.field),
            Err("back_off"),
            "it takes two revolutions to brake"
        );
    }
}
