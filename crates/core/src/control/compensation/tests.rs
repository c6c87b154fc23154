//! Tests of each kind of compensation, and of the hold.

use std::vec::Vec;

use super::*;
use crate::control::{Cascade, Pid};
use crate::estimate::DriveObserver;
use crate::friction::{Bristles, Stribeck};

const DT: f64 = 1e-3;
const INERTIA: f64 = 1.01e-3;

fn curve() -> Stribeck<f64> {
    Stribeck {
        breakaway_torque: 0.45,
        kinetic_torque: 0.2,
        stribeck_velocity: 1.0,
        viscous_friction: 8e-3,
        ..Stribeck::default()
    }
}

fn bristles() -> Bristles<f64> {
    Bristles { stiffness: 3000.0, ..Bristles::default() }
}

fn all() -> [Compensation<f64>; 7] {
    [
        Compensation::Curve(CurveFeedforward { friction: curve(), ..CurveFeedforward::default() }),
        Compensation::Feedforward(FrictionFeedforward {
            friction: bristles().under(curve()),
            ..FrictionFeedforward::default()
        }),
        Compensation::Adaptive(AdaptiveStribeck {
            friction: curve(),
            bristles: bristles(),
            ..AdaptiveStribeck::default()
        }),
        Compensation::FriedlandPark(FriedlandPark::default()),
        Compensation::DisturbanceObserver(DisturbanceObserver::default()),
        Compensation::FrictionObserver(FrictionObserver {
            observer: DriveObserver::unhurried(INERTIA, bristles().under(curve()), DT),
            ..FrictionObserver::default()
        }),
        Compensation::Network(network()),
    ]
}

/// 0.3 N m along the way of the set-point, up to 25 rad/s.
fn network() -> NetworkFeedforward<f64> {
    let region = [25.0, 300.0, 1.0, 1.0, 1.0, 1.0];
    let smallest = region.map(|largest| -largest);
    let mut network = Network { scale: region, smallest, largest: region, ..Network::default() };
    network.first[5][0] = 5.0;
    network.second[0][0] = 5.0;
    network.output[0] = 0.3;
    let friction = bristles().under(curve());
    NetworkFeedforward { network, fallback: FrictionFeedforward { friction, ..FrictionFeedforward::default() } }
}

/// Starts in a steady motion: the state and the torque.
fn begin(compensation: &Compensation<f64>, input: CompensationInput<f64>) -> (CompensationState<f64>, f64) {
    let mut state = CompensationState::default();
    let torque = compensation.begin(&mut state, input);
    (state, torque)
}

fn moving(velocity: f64, acceleration: f64) -> Setpoint<f64> {
    Setpoint { position: 0.0, velocity, acceleration }
}

fn input(velocity: f64, applied_torque: f64) -> CompensationInput<f64> {
    CompensationInput {
        reference: moving(velocity, 0.0),
        measured_velocity: velocity,
        measured_angle: 0.0,
        applied_torque,
        pending_torque: applied_torque,
    }
}

/// A rigid drive that slides with this friction [N m] of its velocity, its torque active one sample late.
struct Sliding<F> {
    friction: F,
    angle: f64,
    velocity: f64,
    in_force: f64,
    applied: f64,
}

impl<F: Fn(f64) -> f64> Sliding<F> {
    fn at(velocity: f64, friction: F) -> Self {
        let torque = friction(velocity);
        Sliding { friction, angle: 0.0, velocity, in_force: torque, applied: torque }
    }

    /// One sample: `torque` becomes active after it.
    fn sample(&mut self, torque: f64) {
        self.angle += DT * self.velocity;
        self.velocity += DT / INERTIA * (self.in_force - (self.friction)(self.velocity));
        self.applied = self.in_force;
        self.in_force = torque;
    }

    fn input(&self) -> CompensationInput<f64> {
        CompensationInput {
            reference: moving(self.velocity, 0.0),
            measured_velocity: self.velocity,
            measured_angle: self.angle,
            applied_torque: self.applied,
            pending_torque: self.in_force,
        }
    }
}

#[test]
fn feedforward_along_a_constant_speed_is_the_curve() {
    for velocity in [-20.0, -0.5, 0.3, 5.0] {
        let expected = curve().torque(velocity);
        for compensation in &all()[..3] {
            let (mut state, start) = begin(compensation, input(velocity, expected));
            let mut torque = 0.0;
            for _ in 0..200 {
                torque = compensation.step(&mut state, input(velocity, expected), DT).torque;
            }
            // A smooth sign of 0.05 rad/s lacks 1.4 % at 0.3 rad/s.
            let tolerance = if matches!(compensation, Compensation::Curve(_)) { 0.02 } else { 1e-9 };
            assert!((torque - expected).abs() < tolerance * expected.abs(), "{compensation:?} {velocity}: {torque}");
            assert!((start - torque).abs() < 1e-9, "it begins with {start} and gives {torque}");
        }
    }
}

#[test]
fn feedforward_is_that_of_the_moment_when_it_acts() {
    for compensation in &all()[..3] {
        // A reversal at −30 rad/s²: 60 samples of ±1.8 rad/s.
        let (mut state, _) = begin(compensation, input(1.8, curve().torque(1.8)));
        let mut last_positive = 0.0;
        for k in 0..120 {
            let velocity = 1.8 - 30.0 * f64::from(k) * DT;
            let applied = curve().torque(velocity) - 30.0 * INERTIA;
            let sample = CompensationInput { reference: moving(velocity, -30.0), ..input(velocity, applied) };
            if compensation.step(&mut state, sample, DT).torque > 0.0 {
                last_positive = velocity;
            }
        }
        // 1.8 ms before the reversal the set-point has 0.054 rad/s left; the bristles turn over within 0.3 mrad.
        let (least, most) = if matches!(compensation, Compensation::Curve(_)) { (0.05, 0.09) } else { (-0.15, 0.06) };
        assert!((least..=most).contains(&last_positive), "{compensation:?}: {last_positive}");
    }
}

#[test]
fn the_bristle_torque_stays_when_the_set_point_is_constant() {
    let compensation = all()[1];
    let (mut state, _) = begin(&compensation, input(2.0, 0.0));
    let mut torques = [0.0; 2];
    for k in 0..1000 {
        // From 2 rad/s to rest within 0.1 s.
        let (velocity, acceleration) = if k < 100 { (2.0 - 0.02 * f64::from(k), -20.0) } else { (0.0, 0.0) };
        let sample = CompensationInput { reference: moving(velocity, acceleration), ..input(velocity, 0.0) };
        torques[usize::from(k > 500)] = compensation.step(&mut state, sample, DT).torque;
    }
    assert!(torques[1] > 0.2 && torques[0] == torques[1], "{torques:?}");
}

#[test]
fn the_adaptive_curve_converges_from_a_wrong_start() {
    let wrong = Stribeck { breakaway_torque: 0.225, kinetic_torque: 0.1, viscous_friction: 0.0, ..curve() };
    let adaptive =
        AdaptiveStribeck { friction: wrong, bristles: bristles(), freeze_velocity: 0.3, ..AdaptiveStribeck::default() };
    let mut state = AdaptiveStribeckState::default();
    let mut drive = Sliding::at(0.5, |velocity| curve().torque(velocity));
    adaptive.begin(&mut state, drive.input());
    for k in 0..60_000 {
        adaptive.step(&mut state, drive.input(), DT);
        let wanted = 6.0 * (0.002 * f64::from(k)).sin();
        drive.sample(0.2 * (wanted - drive.velocity) + curve().torque(wanted));
    }
    let truth = [0.2, 0.25, 8e-3];
    for (found, true_value) in state.estimate.iter().zip(truth) {
        assert!((found - true_value).abs() < 0.05 * true_value, "{:?}", state.estimate);
    }
}

#[test]
fn the_adaptive_curve_is_frozen_while_the_velocity_is_noise() {
    let Compensation::Adaptive(adaptive) = all()[2] else { panic!("the third") };
    let mut state = AdaptiveStribeckState::default();
    adaptive.begin(&mut state, input(0.0, 0.0));
    let before = state.estimate;
    let mut fast = state;
    for k in 0..10_000 {
        // Stuck under 0.3 N m, the tacho flickers.
        let flicker = 0.1 * f64::from(k * 7919 % 201 - 100) / 100.0;
        adaptive.step(&mut state, CompensationInput { measured_velocity: flicker, ..input(0.0, 0.3) }, DT);
        adaptive.step(&mut fast, input(3.0, 0.3), DT);
    }
    assert_eq!(state.estimate, before);
    assert_ne!(fast.estimate, before, "the same torque while it slides is learnt");
}

#[test]
fn the_adaptive_curve_stays_friction_and_its_covariance_bounded() {
    let Compensation::Adaptive(adaptive) = all()[2] else { panic!("the third") };
    let mut state = AdaptiveStribeckState::default();
    adaptive.begin(&mut state, input(3.0, 0.0));
    // A torque against the motion: an external push. At one speed the three numbers are not identifiable.
    for _ in 0..200_000 {
        adaptive.step(&mut state, input(3.0, -0.5), DT);
    }
    let [level, drop, viscous] = state.estimate;
    assert!(level >= 1e-6 && (0.0..=1.5 * level).contains(&drop) && viscous >= 0.0, "{:?}", state.estimate);
    let trace = state.covariance[0][0] + state.covariance[1][1];
    assert!(trace <= 30.0 * adaptive.covariance, "{trace}");
}

#[test]
fn friedland_and_park_converge_to_coulomb_friction_at_their_rate() {
    let observer = FriedlandPark::<f64>::default();
    let mut drive = Sliding::at(5.0, |velocity: f64| 0.2 * velocity.signum());
    let mut state = FriedlandParkState { level: observer.rate * observer.inertia * drive.velocity };
    for k in 0..100 {
        let torque = observer.step(&mut state, drive.input(), DT).torque;
        let expected = 0.2 * (1.0 - 0.9f64.powi(k));
        assert!((torque - expected).abs() < 1e-9, "{k}: {torque} instead of {expected}");
        drive.sample(0.2);
    }
}

#[test]
fn the_disturbance_observer_has_the_double_pole_that_it_is_designed_for() {
    let pole = (-0.1f64).exp();
    let observer = DisturbanceObserver {
        velocity_gain: 1.0 - pole * pole,
        torque_gain: (1.0 - pole) * (1.0 - pole) * INERTIA / DT,
        inertia: INERTIA,
        ..DisturbanceObserver::default()
    };
    let mut drive = Sliding::at(5.0, |_| 0.3);
    let mut state = DisturbanceObserverState { velocity: 5.0, torque: 0.0 };
    let mut errors = Vec::new();
    for _ in 0..40 {
        drive.sample(0.3);
        observer.step(&mut state, drive.input(), DT);
        errors.push(0.3 - state.torque);
    }
    for three in errors.windows(3) {
        let left = three[2] - 2.0 * pole * three[1] + pole * pole * three[0];
        assert!(left.abs() < 1e-12, "{left}");
    }
}

#[test]
fn no_kind_exceeds_its_limit_or_keeps_a_non_finite_number() {
    for compensation in all() {
        let (mut state, _) = begin(&compensation, input(2.0, 0.3));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, 1e9] {
            let good = input(2.0, 0.3);
            let reference = Setpoint { position: bad, velocity: bad, acceleration: bad };
            for sample in [
                CompensationInput { reference, ..good },
                CompensationInput { measured_velocity: bad, ..good },
                CompensationInput { measured_angle: bad, ..good },
                CompensationInput { applied_torque: bad, ..good },
            ] {
                let torque = compensation.step(&mut state, sample, DT).torque;
                assert!(torque.abs() <= 1.4, "{compensation:?} gives {torque} for {sample:?}");
            }
        }
        let mut torque = 0.0;
        for k in 0..5000 {
            let sample = CompensationInput { measured_angle: 2.0 * DT * f64::from(k), ..input(2.0, 0.3) };
            torque = compensation.step(&mut state, sample, DT).torque;
        }
        assert!((0.05..0.6).contains(&torque), "{compensation:?} gives {torque} afterwards");
    }
}

#[test]
fn an_observed_friction_is_compensated_while_the_set_point_moves_and_released_when_it_is_constant() {
    let compensation = FrictionObserver {
        observer: DriveObserver::unhurried(INERTIA, bristles().under(curve()), DT),
        share: 0.5,
        ..FrictionObserver::default()
    };
    let mut state = FrictionObserverState::default();
    let mut drive = Sliding::at(3.0, |velocity| curve().torque(velocity));
    let mut torque = 0.0;
    for _ in 0..1000 {
        torque = compensation.step(&mut state, drive.input(), DT).torque;
        drive.sample(0.2 * (3.0 - drive.velocity) + curve().torque(3.0));
    }
    let half = 0.5 * curve().torque(3.0);
    assert!((torque - half).abs() < 0.05 * half, "{torque} instead of {half}");
    let (mut given, mut handed_back) = (Vec::new(), 0.0);
    for _ in 0..1000 {
        let resting = CompensationInput { reference: moving(0.0, 0.0), ..drive.input() };
        let output = compensation.step(&mut state, resting, DT);
        given.push(output.torque);
        handed_back -= output.taken;
        drive.sample(0.2 * (3.0 - drive.velocity) + curve().torque(3.0));
    }
    // By 1/e in 0.1 s, nowhere by a jump.
    assert!((given[99] / half - 0.37).abs() < 0.03 && given[999].abs() < 1e-4, "{} {}", given[99], given[999]);
    assert!(given.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.02 * half));
    assert!((handed_back / half - 1.0).abs() < 0.05, "the integral gets {handed_back}");
}

fn hold() -> StictionHold<f64> {
    StictionHold { dead_zone: 1.2e-3, knock_torque: 0.3, knock_zone: 0.9e-3, ..StictionHold::default() }
}

/// Torques of a number of samples at a set-point and an angle.
fn holding(hold: &StictionHold<f64>, state: &mut HoldState<f64>, position: f64, angle: f64, samples: u32) -> Vec<f64> {
    let reference = Setpoint { position, ..Setpoint::default() };
    (0..samples).map(|_| hold.step(state, HoldInput { reference, measured_angle: angle }, DT).torque).collect()
}

#[test]
fn knocks_come_towards_the_set_point_once_it_rests_and_only_outside_the_zone() {
    let (hold, mut state) = (hold(), HoldState::default());
    let torques = holding(&hold, &mut state, 1.0, 0.995, 400);
    let first = torques.iter().position(|&torque| torque != 0.0).unwrap();
    // One sample shows that the set-point stays.
    assert_eq!(first, 101, "dwell of 0.1 s");
    assert!(torques[first..first + 3].iter().all(|&torque| torque == 0.3) && torques[first + 3] == 0.0);
    let second = torques[first + 3..].iter().position(|&torque| torque != 0.0).unwrap() + first + 3;
    assert_eq!(second - first, 50, "interval of 0.05 s");
    let other_side = holding(&hold, &mut state, 1.0, 1.005, 200);
    assert!(other_side.contains(&-0.3));
    holding(&hold, &mut state, 1.0, 1.0005, 5);
    assert!(holding(&hold, &mut state, 1.0, 1.0005, 400).iter().all(|&torque| torque == 0.0), "within the zone");
    // A set-point that jumped must be constant again.
    assert!(holding(&hold, &mut state, 2.0, 1.0, 100).iter().all(|&torque| torque == 0.0));
    assert!(holding(&hold, &mut state, 2.0, 1.0, 3).contains(&0.3));
}

#[test]
fn within_the_dead_zone_the_integral_is_frozen() {
    let hold = hold();
    let at = |angle: f64| {
        let reference = Setpoint { position: 1.0, ..Setpoint::default() };
        hold.step(&mut HoldState::default(), HoldInput { reference, measured_angle: angle }, DT).integrates
    };
    assert_eq!([at(1.001), at(0.999), at(1.0013), at(0.9987)], [0.0, 0.0, 1.0, 1.0]);
    let cascade = Cascade::<f64>::default();
    for (integrates, moves) in [(0.0, false), (1.0, true)] {
        let mut state = crate::control::CascadeState { integral: 0.2 };
        let input = crate::control::ControllerInput { reference_position: 0.1, integrates, ..Default::default() };
        cascade.step(&mut state, input, DT);
        assert_eq!(state.integral != 0.2, moves);
        let mut state = crate::control::PidState { integral: 0.2, ..Default::default() };
        Pid::<f64>::default().step(&mut state, input, DT);
        assert_eq!(state.integral != 0.2, moves);
    }
}

#[test]
fn dither_has_its_amplitude_and_its_frequency() {
    let hold = StictionHold { dither_torque: 0.2, dither_frequency: 50.0, ..StictionHold::default() };
    let torques = holding(&hold, &mut HoldState::default(), 0.0, 0.0, 1000);
    let most = torques.iter().fold(0.0f64, |most, &torque| most.max(torque.abs()));
    assert!((most - 0.2).abs() < 1e-3, "{most}");
    let rising = torques.windows(2).filter(|pair| pair[0] <= 0.0 && pair[1] > 0.0).count();
    assert!((49..=50).contains(&rising), "{rising} periods in a second");
}
