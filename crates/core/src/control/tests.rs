//! Tests of every position controller.

use std::vec;

use super::*;
use crate::block::Block;

const DT: f64 = 1e-3;
const INERTIA: f64 = 1.01e-3;

fn all() -> [PositionController<f64>; 6] {
    [
        PositionController::Cascade(Cascade::default()),
        PositionController::Pid(Pid::default()),
        PositionController::Pid(Pid { use_tacho: 0.0, ..Pid::default() }),
        PositionController::Linear(LinearController::without_states()),
        PositionController::Linear(LinearController::observing()),
        PositionController::Predictive(Predictive::foreseeing()),
    ]
}

impl LinearController<f64> {
    /// The gains of a PID controller with the tacho.
    pub(super) fn without_states() -> Self {
        let Pid { proportional_gain, derivative_gain, integral_gain, .. } = Pid::<f64>::default();
        let direct = [-proportional_gain, -derivative_gain, 0.0, derivative_gain, 0.0, 0.0, 0.0, 0.0];
        LinearController { direct, integral_gain, ..LinearController::default() }
    }

    /// The same gains on angle and velocity of the axis below as an observer predicts them for the time when the torque
    /// is active. Its error halves in a sample.
    pub(super) fn observing() -> Self {
        let Pid { proportional_gain, derivative_gain, integral_gain, .. } = Pid::<f64>::default();
        let (push, way) = (DT / INERTIA, 0.5 * DT * DT / INERTIA);
        let mut it = LinearController { integral_gain, ..LinearController::default() };
        // x⁺ = Φ·(½·(x − Δr) + ½·y) + Γ·M
        let rows = [([0.5, 0.5 * DT], way), ([0.0, 0.5], push)];
        for (row, ([angle, velocity], torque)) in rows.into_iter().enumerate() {
            (it.system[0][row], it.system[1][row]) = (angle, velocity);
            for (column, of) in [angle, velocity, -angle, 0.0, 0.0, torque, 0.0, 0.0].into_iter().enumerate() {
                it.input[column][row] = of;
            }
        }
        // M = −K·x⁺ but for the set-point's velocity.
        for (gain, row) in [proportional_gain, derivative_gain].into_iter().zip(0..) {
            for column in 0..STATES {
                it.output[column] -= gain * it.system[column][row];
            }
            for column in 0..INPUTS {
                it.direct[column] -= gain * it.input[column][row];
            }
        }
        it.direct[3] += derivative_gain + proportional_gain * DT;
        // x = Φ·(½·(x − (Ω·T, 0)) + ½·(φ, Ω)) + Γ·M
        it.settled[0][0] = 1.0;
        (it.settled[1][0], it.settled[1][1]) = (DT, 1.0);
        (it.settled[2][0], it.settled[2][1]) = (2.0 * (way + DT * push), 2.0 * push);
        it
    }
}

impl Predictive<f64> {
    /// The same within limits; it looks ahead as far as the sample that it computes.
    pub(super) fn foreseeing() -> Self {
        let mut it = Predictive { linear: LinearController::observing(), ..Predictive::default() };
        it.free_torque[STATES + 1][0] = 1.0;
        for k in 0..HORIZON {
            it.steps.step.resolvent[k][k] = 0.3;
        }
        it
    }
}

/// A rigid screw without friction behind one sample of delay.
#[derive(Clone, Copy, Default)]
struct Axis {
    angle: f64,
    velocity: f64,
    waiting: f64,
}

impl Axis {
    fn input(&self, reference_position: f64) -> ControllerInput<f64> {
        ControllerInput {
            reference_position,
            reference_velocity: 0.0,
            reference_acceleration: 0.0,
            measured_angle: self.angle,
            measured_velocity: self.velocity,
            ..ControllerInput::default()
        }
    }

    fn period(&mut self, torque: f64, load: f64) {
        let acceleration = (self.waiting - load) / INERTIA;
        self.angle += DT * (self.velocity + 0.5 * DT * acceleration);
        self.velocity += DT * acceleration;
        self.waiting = torque;
    }
}

/// Largest and last angle of a number of periods towards a reference position.
fn approach(controller: &PositionController<f64>, reference: f64, load: f64, periods: u32) -> (f64, f64) {
    let (mut axis, mut state, mut peak) = (Axis::default(), PositionControllerState::default(), 0.0f64);
    for _ in 0..periods {
        let torque = controller.step(&mut state, axis.input(reference), DT).torque;
        axis.period(torque, load);
        peak = peak.max(axis.angle);
    }
    (peak, axis.angle)
}

#[test]
fn every_controller_holds_a_position_against_a_load() {
    for controller in all() {
        let (_, last) = approach(&controller, 0.1, 0.2, 3000);
        // The slowest pole of K_i/K_v = 20 1/s and K_pos = 15 1/s leaves e^-45 of the step.
        assert!((last - 0.1).abs() < 1e-6, "{controller:?}: {last}");
    }
}

#[test]
fn the_torque_keeps_its_limit() {
    for controller in all() {
        for angle in [-1e6, -10.0, 10.0, 1e6] {
            let axis = Axis { angle, ..Axis::default() };
            let torque = controller.step(&mut PositionControllerState::default(), axis.input(0.0), DT).torque;
            assert_eq!(torque, -1.4 * angle.signum(), "{controller:?}");
        }
    }
}

#[test]
fn a_long_saturation_leaves_no_wind_up() {
    for controller in all() {
        let (mut axis, mut state) = (Axis::default(), PositionControllerState::default());
        // 10 s blocked against a stop, then the reference returns to where the axis is.
        for _ in 0..10_000 {
            controller.step(&mut state, axis.input(10.0), DT);
        }
        let mut worst = 0.0f64;
        for _ in 0..2000 {
            let torque = controller.step(&mut state, axis.input(0.0), DT).torque;
            axis.period(torque, 0.0);
            worst = worst.max(axis.angle.abs());
        }
        // Blocked, an unlimited integrator would have gathered 10 rad · 45 N m/(rad s) · 10 s = 4500 N m.
        assert!(worst < 0.5, "{controller:?} runs {worst} rad away");
    }
}

#[test]
fn a_saturated_step_overshoots_less_than_with_an_integrator_that_winds_up() {
    // The same law with unlimited torque inside and the limit outside winds up.
    let limited = PositionController::Pid(Pid { torque_limit: 0.2, ..Pid::default() });
    let windup = PositionController::Pid(Pid { torque_limit: 1e4, ..Pid::default() });
    let (peak, _) = approach(&limited, 3.0, 0.05, 3000);
    let (mut axis, mut state, mut wound) = (Axis::default(), PositionControllerState::default(), 0.0f64);
    for _ in 0..3000 {
        let torque = windup.step(&mut state, axis.input(3.0), DT).torque.clamp(-0.2, 0.2);
        axis.period(torque, 0.05);
        wound = wound.max(axis.angle);
    }
    assert!(wound - 3.0 > 2.0 * (peak - 3.0), "with {peak}, without {wound}");
}

#[test]
fn a_non_finite_input_gives_no_torque_and_leaves_the_state_usable() {
    for controller in all() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for place in 0..5 {
                let mut state = PositionControllerState::default();
                let axis = Axis { angle: 0.01, ..Axis::default() };
                for _ in 0..5 {
                    controller.step(&mut state, axis.input(0.02), DT);
                }
                let mut broken = axis.input(0.02);
                let numbers = [
                    &mut broken.reference_position,
                    &mut broken.reference_velocity,
                    &mut broken.reference_acceleration,
                    &mut broken.measured_angle,
                    &mut broken.measured_velocity,
                ];
                *numbers.into_iter().nth(place).unwrap() = bad;
                let before = controller.step(&mut { state }, axis.input(0.02), DT).torque;
                assert_eq!(controller.step(&mut state, broken, DT).torque, 0.0);
                let after = controller.step(&mut state, axis.input(0.02), DT).torque;
                // One integration step more or less; and a controller that uses the active torque compensates the
                // missing one now.
                let knows = matches!(controller, PositionController::Linear(_) | PositionController::Predictive(_));
                let allowed = if knows { 1e-3 + 0.16 * before.abs() } else { 1e-3 };
                assert!((after - before).abs() < allowed, "{controller:?}: {before} before, {after} after");
            }
        }
    }
}

#[test]
fn a_take_over_continues_the_torque() {
    for controller in all() {
        let axis = Axis { angle: 1.3, velocity: 4.0, waiting: 0.0 };
        let input = ControllerInput { reference_velocity: 4.2, reference_acceleration: 30.0, ..axis.input(1.31) };
        for torque in [-1.3, -0.2, 0.0, 0.7] {
            let mut state = controller.take_over(torque, input);
            // Rounding of a difference of torques below 10 N m.
            assert!((controller.step(&mut state, input, DT).torque - torque).abs() < 1e-12, "{controller:?}");
        }
        let mut state = controller.take_over(9.0, input);
        assert!((controller.step(&mut state, input, DT).torque - 1.4).abs() < 1e-12, "beyond the limit");
        let mut state = controller.take_over(f64::NAN, input);
        assert!(controller.step(&mut state, input, DT).torque.abs() < 1e-12);
    }
}

#[test]
fn the_default_pid_is_the_default_cascade() {
    let mut cascade = Axis::default();
    let mut pid = Axis::default();
    let (mut a, mut b) = (PositionControllerState::default(), PositionControllerState::default());
    let [cascade_control, pid_control, ..] = all();
    let (mut apart, mut moved) = (0.0f64, 0.0f64);
    for k in 0..1000 {
        // ∫(ṙ − ω) = r − φ holds from rest with a consistent reference.
        let (r, v) = (0.05 * f64::from(k) * DT, 0.05);
        let with_velocity = |axis: &Axis| ControllerInput { reference_velocity: v, ..axis.input(r) };
        let torque = cascade_control.step(&mut a, with_velocity(&cascade), DT).torque;
        cascade.period(torque, 0.1);
        let torque = pid_control.step(&mut b, with_velocity(&pid), DT).torque;
        pid.period(torque, 0.1);
        apart = apart.max((cascade.angle - pid.angle).abs());
        moved = moved.max((cascade.angle - r).abs());
    }
    // ∫ω is a left sum in one, the measured angle in the other: K_v differs by K_i·T/2, 1 % of it; thrice that allowed.
    assert!(apart < 0.03 * moved, "{apart} apart, {moved} off the reference");
}

#[test]
fn the_derivative_of_the_encoder_is_filtered() {
    let pid = Pid::<f64> { use_tacho: 0.0, proportional_gain: 0.0, integral_gain: 0.0, ..Pid::default() };
    let mut state = PidState::default();
    let mut velocity = 0.0;
    for k in 0..40 {
        let axis = Axis { angle: 2.0 * f64::from(k) * DT, ..Axis::default() };
        let torque = pid.step(&mut state, axis.input(0.0), DT).torque;
        velocity = -torque / pid.derivative_gain;
        // Backward Euler of T_f = 2 ms: (2/3)^k of the step is left.
        assert!((velocity - 2.0 * (1.0 - (2.0f64 / 3.0).powi(k))).abs() < 1e-9, "{k}: {velocity}");
    }
    assert!((velocity - 2.0).abs() < 1e-5);
}

#[test]
fn single_precision_and_lanes_control_as_double_precision_does() {
    use crate::fields::Fields;
    use crate::scalar::Lanes;
    for controller in all() {
        let single = controller.map(&mut |x: f64| x as f32);
        let wide = controller.map(&mut Lanes::<f64, 2>::of);
        let (mut axis, mut state) = (Axis::default(), PositionControllerState::default());
        let (mut single_state, mut wide_state) = Default::default();
        for _ in 0..100 {
            let input = axis.input(0.1);
            let torque = controller.step(&mut state, input, DT).torque;
            let narrow = single.step(&mut single_state, input.map(&mut |x: f64| x as f32), DT as f32).torque;
            // 100 steps at 2⁻²⁴ relative, of a torque of 1 N m behind gains that amplify differences of angles.
            assert!((f64::from(narrow) - torque).abs() < 1e-3, "{controller:?}: {narrow} {torque}");
            let lanes = wide.step(&mut wide_state, input.map(&mut Lanes::of), Lanes::of(DT)).torque;
            assert_eq!(lanes.0, [torque; 2]);
            axis.period(torque, 0.0);
        }
    }
}

#[test]
fn a_controller_with_states_starts_in_its_steady_state() {
    // An axis that slides against a load: nothing changes but the angle.
    let controller =
        PositionController::Linear(LinearController { integral_gain: 0.0, ..LinearController::observing() });
    let velocity = 3.0;
    let mut axis = Axis { angle: 0.99, velocity, waiting: 0.2 };
    let moving = |axis: &Axis, reference| ControllerInput { reference_velocity: velocity, ..axis.input(reference) };
    let mut state = controller.take_over(0.2, moving(&axis, 1.0));
    let start = state.linear.states;
    for k in 0..50 {
        let reference = 1.0 + velocity * DT * f64::from(k);
        let torque = controller.step(&mut state, moving(&axis, reference), DT).torque;
        assert!((torque - 0.2).abs() < 1e-12, "{k}: {torque}");
        axis.period(0.2, 0.2);
    }
    for (one, other) in start.iter().zip(state.linear.states) {
        assert!((one - other).abs() < 1e-12, "{start:?} {:?}", state.linear.states);
    }
}

#[test]
fn far_from_its_origin_a_controller_with_states_does_the_same() {
    use crate::fields::Fields;
    let controller = PositionController::Linear(LinearController::observing()).map(&mut |x: f64| x as f32);
    // A step of the set-point by 32 counts of 2⁻¹¹ rad, about 0 and about 1024 rad, where single precision has steps of
    // 2⁻¹³ rad.
    let torques = |origin: f32| {
        let (mut axis, mut state) = (Axis::default(), PositionControllerState::default());
        let mut torques = vec![];
        for k in 0..300 {
            let measured = origin + ((axis.angle * 2048.0).floor() / 2048.0) as f32;
            let input = ControllerInput {
                reference_position: origin + if k < 10 { 0.0 } else { 32.0 / 2048.0 },
                measured_angle: measured,
                measured_velocity: axis.velocity as f32,
                ..ControllerInput::default()
            };
            let torque = controller.step(&mut state, input, DT as f32).torque;
            axis.period(f64::from(torque), 0.0);
            torques.push(torque);
        }
        torques
    };
    let torques = [0.0, 1024.0].map(torques);
    assert_eq!(torques[0], torques[1]);
    assert!(torques[0].iter().any(|torque| torque.abs() > 0.01));
}
