//! Tests of controller and compensation together.

use std::vec::Vec;

use super::compensation::{
    AdaptiveStribeck, Compensation, CurveFeedforward, DisturbanceObserver, FrictionFeedforward, FrictionObserver,
    FriedlandPark, Network, NetworkFeedforward,
};
use super::reference::Setpoint;
use super::*;
use crate::block::Block;
use crate::estimate::DriveObserver;
use crate::friction::{Bristles, Stribeck};

const DT: f64 = 1e-3;
const INERTIA: f64 = 1.01e-3;

fn curve() -> Stribeck<f64> {
    Stribeck { breakaway_torque: 0.2, kinetic_torque: 0.1, stribeck_velocity: 1.0, ..Stribeck::default() }
}

/// At 80 Hz.
fn notch() -> Notch<f64> {
    let numerator = [0.8487, -1.4875, 0.8487];
    Notch { numerator, denominator: [-1.4875, 0.6974], torque_limit: 1.4 }
}

#[test]
fn a_notch_passes_a_constant_and_stops_its_frequency() {
    let filter = TorqueFilter::Notch(notch());
    let mut state = filter.settled(0.3);
    let pass = |state: &mut FilterState<f64>, torque| {
        notch().step(state, FilterInput { torque, added_torque: 0.0 }, DT).torque
    };
    assert!((0..100).all(|_| (pass(&mut state, 0.3) - 0.3).abs() < 1e-12));
    for (frequency, most, least) in [(80.0, 0.01, 0.0), (10.0, 1.0, 0.97), (300.0, 1.0, 0.9)] {
        let mut state = FilterState::default();
        let wave = |k: u32| (core::f64::consts::TAU * frequency * f64::from(k) * DT).sin();
        let peak = (0..2000).map(|k| (k, pass(&mut state, wave(k)))).filter(|(k, _)| *k > 1000);
        let peak = peak.fold(0.0f64, |peak, (_, torque)| peak.max(torque.abs()));
        assert!((least..=most + 1e-3).contains(&peak), "{peak} at {frequency} Hz");
    }
    // No non-finite number stays in it.
    let mut state = filter.settled(0.3);
    pass(&mut state, f64::NAN);
    assert!((0..200).map(|_| pass(&mut state, 0.3)).last().is_some_and(|torque| (torque - 0.3).abs() < 1e-9));
}

fn all() -> Vec<AxisControl<f64>> {
    let (friction, bristles) = (curve(), Bristles::default());
    let controllers = [
        PositionController::Cascade(Cascade::default()),
        PositionController::Pid(Pid::default()),
        PositionController::Pid(Pid { use_tacho: 0.0, ..Pid::default() }),
        PositionController::Linear(LinearController::observing()),
    ];
    let compensations = [
        Compensation::Nothing,
        Compensation::Curve(CurveFeedforward { friction, ..CurveFeedforward::default() }),
        Compensation::Feedforward(FrictionFeedforward {
            friction: bristles.under(friction),
            ..FrictionFeedforward::default()
        }),
        Compensation::Adaptive(AdaptiveStribeck { friction, bristles, ..AdaptiveStribeck::default() }),
        Compensation::FriedlandPark(FriedlandPark { rate: 30.0, ..FriedlandPark::default() }),
        Compensation::DisturbanceObserver(DisturbanceObserver {
            velocity_gain: 0.06,
            torque_gain: 0.0009,
            ..DisturbanceObserver::default()
        }),
        Compensation::FrictionObserver(FrictionObserver {
            observer: DriveObserver::unhurried(INERTIA, bristles.under(friction), DT),
            ..FrictionObserver::default()
        }),
        // Untrained: the fallback is active.
        Compensation::Network(NetworkFeedforward {
            network: Network::default(),
            fallback: FrictionFeedforward { friction: bristles.under(friction), ..FrictionFeedforward::default() },
        }),
    ];
    let joined =
        |controller| compensations.map(|compensation| AxisControl { compensation, ..AxisControl::from(controller) });
    let filter = TorqueFilter::Notch(notch());
    let filtered = AxisControl { filter, ..AxisControl::from(controllers[0]) };
    controllers.into_iter().flat_map(joined).chain([filtered]).collect()
}

/// A rigid screw behind one sample of delay, with friction in four steps a sample and stuck where that suffices.
#[derive(Clone, Copy, Default)]
struct Axis {
    angle: f64,
    velocity: f64,
    waiting: f64,
}

impl Axis {
    fn input(&self, reference: Setpoint<f64>) -> AxisControlInput<f64> {
        AxisControlInput { reference, measured_angle: self.angle, measured_velocity: self.velocity }
    }

    fn period(&mut self, torque: f64, load: f64) {
        for _ in 0..4 {
            let dt = 0.25 * DT;
            let free = self.velocity + dt / INERTIA * (self.waiting - load);
            let braked = dt / INERTIA * curve().magnitude(self.velocity.abs());
            self.velocity = free - free.clamp(-braked, braked);
            self.angle += dt * self.velocity;
        }
        self.waiting = torque;
    }
}

/// The sine that is followed.
fn sine(k: u32) -> Setpoint<f64> {
    let phase = 3.0 * f64::from(k) * DT;
    Setpoint { position: 2.0 * phase.sin(), velocity: 6.0 * phase.cos(), acceleration: -18.0 * phase.sin() }
}

/// Largest error in the 0.2 s after sample `at`, and the jump of the torque there, where `to` takes over.
fn follow(from: &AxisControl<f64>, to: Option<&AxisControl<f64>>, at: u32) -> (f64, f64) {
    let (mut axis, mut state, mut before) = (Axis::default(), AxisControlState::default(), 0.0);
    let (mut active, mut worst, mut jump) = (from, 0.0f64, 0.0f64);
    let mut last = axis.input(sine(0));
    for k in 0..at + 200 {
        let input = axis.input(sine(k));
        if let (true, Some(to)) = (k == at, to) {
            state = to.take_over(before, last, &state, Some(from));
            // The step of the first sample itself: the set-point has moved on.
            let asked = to.controller.step(&mut { state.controller }, input.controller(), DT).torque;
            let same = to.controller.step(&mut { state.controller }, last.controller(), DT).torque;
            active = to;
            let torque = to.step(&mut { state }, input, DT).torque;
            jump = (torque - before - (asked - same)).abs();
        }
        before = active.step(&mut state, input, DT).torque;
        axis.period(before, 0.02);
        worst = if k < at { worst } else { worst.max((axis.angle - input.reference.position).abs()) };
        last = input;
    }
    (worst, jump)
}

#[test]
fn a_swap_of_controllers_and_compensations_in_motion_is_bumpless() {
    // In full motion, and shortly before a reversal.
    for at in [1300, 1450] {
        let alone: Vec<f64> = all().iter().map(|control| follow(control, None, at).0).collect();
        for (i, from) in all().iter().enumerate() {
            for (j, to) in all().iter().enumerate() {
                let (swapped, jump) = follow(from, Some(to), at);
                assert!(jump < 0.01 * 1.4, "{jump} N m from {from:?} to {to:?}");
                let larger = alone[i].max(alone[j]);
                // An observer that has just started is less exact at a reversal than a running one.
                assert!(swapped <= 1.3 * larger, "{swapped} instead of {larger} rad from {from:?} to {to:?} at {at}");
            }
        }
    }
}

#[test]
fn a_swap_that_resets_the_state_would_give_a_bump() {
    let control = AxisControl::from(PositionController::Cascade(Cascade::default()));
    let (mut axis, mut state, mut before) = (Axis::default(), AxisControlState::default(), 0.0);
    for k in 0..1300 {
        before = control.step(&mut state, axis.input(sine(k)), DT).torque;
        axis.period(before, 0.02);
    }
    let reset = control.step(&mut AxisControlState::default(), axis.input(sine(1300)), DT).torque;
    assert!((reset - before).abs() > 0.05, "{reset} after {before}");
}

#[test]
fn controller_and_compensation_keep_the_limit_together_and_do_not_wind_up() {
    for control in all() {
        let (mut axis, mut state) = (Axis::default(), AxisControlState::default());
        // Blocked while the set-point runs away, then it returns to where the axis is.
        for k in 0..3000 {
            let velocity = 5.0;
            let reference = Setpoint { position: velocity * DT * f64::from(k), velocity, acceleration: 0.0 };
            let torque = control.step(&mut state, axis.input(reference), DT).torque;
            assert!(torque.abs() <= 1.4 + 1e-12, "{torque} of {control:?}");
        }
        let mut worst = 0.0f64;
        for _ in 0..3000 {
            let torque = control.step(&mut state, axis.input(Setpoint::default()), DT).torque;
            axis.period(torque, 0.0);
            worst = worst.max(axis.angle.abs());
        }
        assert!(worst < 0.5, "{control:?} runs {worst} rad away");
    }
}

#[test]
fn a_disturbance_observer_takes_the_place_of_the_integral() {
    for observes in [true, false] {
        let observer = DisturbanceObserver::default();
        let compensation = if observes { Compensation::DisturbanceObserver(observer) } else { Compensation::Nothing };
        let controller = PositionController::Cascade(Cascade::default());
        let control = AxisControl { compensation, ..AxisControl::from(controller) };
        let (mut axis, mut state) = (Axis::default(), AxisControlState::default());
        for k in 0..4000 {
            let position = 3.0 * DT * f64::from(k);
            let reference = Setpoint { position, velocity: 3.0, acceleration: 0.0 };
            let torque = control.step(&mut state, axis.input(reference), DT).torque;
            axis.period(torque, 0.05);
        }
        let integral = state.controller.cascade.integral;
        let total = 0.05 + curve().magnitude(3.0);
        let error = 3.0 * DT * 4000.0 - axis.angle;
        assert!((state.torque - total).abs() < 1e-3 && error.abs() < 2e-3, "{} N m, {error} rad", state.torque);
        if observes {
            assert!(integral.abs() < 0.02 * total, "{integral}");
        } else {
            assert!((integral - total).abs() < 0.05 * total, "{integral}");
        }
    }
}

#[test]
fn a_non_finite_input_gives_no_torque() {
    for control in all() {
        let (axis, mut state) = (Axis { velocity: 3.0, ..Axis::default() }, AxisControlState::default());
        for k in 0..50 {
            control.step(&mut state, axis.input(sine(k)), DT);
        }
        let broken = AxisControlInput { measured_angle: f64::NAN, ..axis.input(sine(50)) };
        assert_eq!(control.step(&mut state, broken, DT).torque, 0.0, "{control:?}");
        assert!(control.step(&mut state, axis.input(sine(51)), DT).torque.is_finite());
    }
}

#[test]
fn single_precision_and_lanes_agree() {
    use crate::fields::Fields as _;
    use crate::scalar::Lanes;
    for control in all() {
        let single = control.map(&mut |x: f64| x as f32);
        let wide = control.map(&mut Lanes::<f64, 2>::of);
        let (mut axis, mut state) = (Axis::default(), AxisControlState::default());
        let (mut single_state, mut wide_state) = Default::default();
        for k in 0..100 {
            let input = axis.input(sine(k));
            let torque = control.step(&mut state, input, DT).torque;
            let narrow = single.step(&mut single_state, input.map(&mut |x: f64| x as f32), DT as f32).torque;
            assert!((f64::from(narrow) - torque).abs() < 5e-3, "{control:?}: {narrow} {torque}");
            let lanes = wide.step(&mut wide_state, input.map(&mut Lanes::of), Lanes::of(DT)).torque;
            assert_eq!(lanes.0, [torque; 2]);
            axis.period(torque, 0.0);
        }
    }
}
