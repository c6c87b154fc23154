use stickslip_core::drive::ElasticArm;

use super::*;
use crate::PositionLoop;
use crate::linear::{StateSpace, size};
use stickslip_base::Preset;
use stickslip_base::parameters::presets;
use stickslip_base::preset::Disturbances;
use stickslip_core::block::Block as _;
use stickslip_core::control::{ControllerInput, PositionController};

fn model(name: &str) -> Model<f64> {
    let preset: Preset<f64> = presets::find(name).unwrap().read().unwrap();
    preset.model
}

/// All kinds of it.
fn kinds() -> Vec<StateFeedback<f64>> {
    let disturbances = Disturbances::default();
    let mut kinds = Vec::new();
    for regulator in [Regulation::Quadratic(Quadratic::default()), Regulation::Poles(Poles::default())] {
        for observer in [Observation::Full, Observation::Reduced, Observation::LoadSide, Observation::MotorSide] {
            for compensates_load in [0.0, 1.0] {
                let observer = observer(disturbances);
                kinds.push(StateFeedback { regulator, observer, compensates_load, ..StateFeedback::default() });
            }
        }
    }
    kinds
}

/// The axis of the design: torque delay of one sample, angle and tacho.
fn modelled_axis(choice: &StateFeedback<f64>, model: &Model<f64>, dt: f64) -> StateSpace {
    let drive = SampledDrive::new(choice, model, dt).unwrap();
    // Its load torque is an input, not a state.
    let states = [ANGLE, TWIST, MOTOR_VELOCITY, VELOCITY, TACHO, TORQUE];
    let a = drive.phi.select_rows(&states).select_columns(&states);
    let b = DMatrix::from_columns(&[
        drive.gamma.select_rows(&states),
        drive.phi.column(LOAD).into_owned().select_rows(&states),
    ]);
    let mut c = DMatrix::zeros(3, states.len());
    (c[(0, 0)], c[(1, 4)], c[(2, 3)]) = (1.0, 1.0, 1.0);
    StateSpace::new(a, b, c, DMatrix::zeros(3, 2), Some(dt)).unwrap().late_input(0).unwrap()
}

#[test]
fn the_closed_loop_has_the_poles_of_regulator_and_observer_and_no_others() {
    for (name, dt) in [("clm-bench", 1e-3), ("prototype", 2.5e-4), ("clm-soft", 1e-3)] {
        let model = model(name);
        for choice in kinds() {
            let drive = SampledDrive::new(&choice, &model, dt).unwrap();
            let (k, integral) = drive.regulator(&choice, &model, dt).unwrap();
            let l = drive.observer(&choice.observer, &model).unwrap();
            // Regulator: the moved states and the integral.
            let order = MOVED.len() + usize::from(choice.compensates_load < 0.5);
            let mut closed = DMatrix::zeros(order, order);
            closed.view_mut((0, 0), (5, 5)).copy_from(&drive.phi.select_rows(&MOVED).select_columns(&MOVED));
            let push = drive.gamma.select_rows(&MOVED);
            let moved = closed.view((0, 0), (5, 5)) - &push * k.select_rows(&MOVED).transpose();
            closed.view_mut((0, 0), (5, 5)).copy_from(&moved);
            if order == 6 {
                (closed[(5, ANGLE)], closed[(5, 5)]) = (dt, 1.0);
                closed.view_mut((0, 5), (5, 1)).copy_from(&(-push * integral));
            }
            let mut expected: Vec<Complex<f64>> = closed.complex_eigenvalues().iter().copied().collect();
            // The tacho's lag, without effect.
            expected.push(Complex::new(drive.phi[(TACHO, TACHO)], 0.0));
            // Observer: Φ·(I − L·C).
            let mut error = drive.phi.clone();
            for (sensor, state) in [ANGLE, TACHO].into_iter().enumerate() {
                let of = &drive.phi * l.column(sensor);
                let mut column = error.column_mut(state);
                column -= of;
            }
            if matches!(choice.observer, Observation::LoadSide(_)) {
                // It does not use the tacho.
                error = error.remove_row(TACHO).remove_column(TACHO);
            }
            expected.extend(error.complex_eigenvalues().iter());

            let controller = PositionController::Linear(state_feedback(&choice, &model, dt).unwrap());
            let closes = PositionLoop::over(modelled_axis(&choice, &model, dt), controller, 0.0).unwrap();
            let poles = closes.closed().unwrap().poles().unwrap();
            // Poles close together are exact to a root of the rounding only: the polynomials are compared, at points
            // where they are large.
            for point in 0..24 {
                let z = {
                    let angle = f64::from(point) * TAU / 24.0;
                    Complex::new(1.1 * libm::cos(angle), 1.1 * libm::sin(angle))
                };
                let product = |poles: &[Complex<f64>]| poles.iter().map(|pole| z - pole).product::<Complex<f64>>();
                // Poles without other input: the active torque, twice, once as the drive's.
                let at_rest = z.powi(poles.len() as i32 - expected.len() as i32);
                let (one, other) = (product(&poles), product(&expected) * at_rest);
                assert!(size(one - other) < 1e-9 * size(other), "{name} {choice:?}: {poles:?} {expected:?}");
            }
            assert!(expected.iter().all(|pole| size(*pole) < 1.0), "{name} {choice:?}: {expected:?}");
        }
    }
}

#[test]
fn compensated_friction_causes_neither_an_observed_load_nor_a_deviation() {
    for (name, dt) in [("clm-bench", 1e-3), ("prototype", 2.5e-4)] {
        let model = model(name);
        for choice in kinds() {
            let drive = SampledDrive::new(&choice, &model, dt).unwrap();
            let controller = state_feedback(&choice, &model, dt).unwrap();
            // The drive slides steadily, pushed by the compensation against friction of the same size.
            let (velocity, steady) = (3.0, 0.2);
            let mut x = DVector::zeros(ORDER);
            x[TWIST] = steady / model.drive.coupling_stiffness;
            (x[MOTOR_VELOCITY], x[VELOCITY], x[TACHO], x[TORQUE]) = (velocity, velocity, velocity, steady);
            let input = |x: &DVector<f64>, reference_position, added_torque| ControllerInput {
                reference_position,
                reference_velocity: velocity,
                measured_angle: x[ANGLE],
                measured_velocity: x[TACHO],
                added_torque,
                ..ControllerInput::default()
            };
            let mut state = controller.take_over(0.0, input(&x, 0.0, steady));
            for sample in 0..400 {
                // At first it is constant; then friction varies, and compensation follows it.
                let added = if sample < 200 { steady } else { 0.2 * libm::sin(0.7 * f64::from(sample * sample % 97)) };
                let reference = velocity * dt * f64::from(sample);
                let balanced = state.added_torque;
                let pushed = state.torque + balanced;
                let torque = controller.step(&mut state, input(&x, reference, added), dt).torque;
                assert!(sample >= 200 || torque.abs() < 1e-9, "{name} {choice:?} {sample}: {torque}");
                x[LOAD] = balanced;
                x = &drive.phi * &x + &drive.gamma * pushed;
                x[LOAD] = 0.0;
                for (index, (&estimate, is)) in state.states.iter().zip(x.iter()).enumerate() {
                    let is = is - if index == ANGLE { reference } else { 0.0 };
                    // A load-side observer does not use the tacho.
                    let used = index != TACHO || !matches!(choice.observer, Observation::LoadSide(_));
                    assert!(
                        !used || (estimate - is).abs() < 1e-8,
                        "{name} {choice:?} {sample}, {index}: {estimate} {is}"
                    );
                }
            }
        }
    }
}

#[test]
fn poles_are_at_their_targets() {
    let (model, dt) = (model("clm-bench"), 1e-3);
    let target = Poles { bandwidth: 50.0, damping: 0.7, vibration_damping: 0.4, integral_rate: 25.0 };
    let choice = StateFeedback { regulator: Regulation::Poles(target), ..StateFeedback::default() };
    let controller = PositionController::Linear(state_feedback(&choice, &model, dt).unwrap());
    let closes = PositionLoop::over(modelled_axis(&choice, &model, dt), controller, 0.0).unwrap();
    let placed = closes.closed().unwrap().poles().unwrap();
    for pole in poles(&target, &choice, &model, dt) {
        let nearest = placed.iter().map(|other| size(other - pole)).fold(f64::INFINITY, f64::min);
        // The servo amplifier's pole is the observer's as well: a double one is exact to a root of the rounding.
        assert!(nearest < 1e-6, "{pole} in {placed:?}");
    }
}

#[test]
fn a_motor_side_observer_ignores_the_encoder_and_a_load_side_one_the_tacho() {
    let model = model("clm-bench");
    let gain = |observer: Observation<f64>| {
        let choice = StateFeedback { observer, ..StateFeedback::default() };
        SampledDrive::new(&choice, &model, 1e-3).unwrap().observer(&observer, &model).unwrap()
    };
    let disturbances = Disturbances { load_torque: 1.0, motor_torque: 1e-3 };
    let motor = gain(Observation::MotorSide(disturbances));
    assert_eq!((motor[(ANGLE, 0)], motor[(ANGLE, 1)]), (1.0, 0.0));
    assert!((1..ORDER).all(|state| motor[(state, 0)] == 0.0) && motor[(VELOCITY, 1)] > 0.0);
    let load = gain(Observation::LoadSide(disturbances));
    assert!((0..ORDER).all(|state| load[(state, 1)] == 0.0) && load[(VELOCITY, 0)] > 0.0);
    let (full, reduced) = (gain(Observation::Full(disturbances)), gain(Observation::Reduced(disturbances)));
    assert!((reduced[(ANGLE, 0)] - 1.0).abs() < 1e-3 && full[(ANGLE, 0)] < 0.9, "{full} {reduced}");
}

/// An arm of a fifth of the load inertia on a spring of 10 Hz, and a tenth that moves with the carriage.
fn with_arm(model: &Model<f64>, compensates_load: f64) -> StateFeedback<f64> {
    let (inertia, omega) = (0.2 * model.drive.load_inertia, TAU * 10.0);
    let arm_model = ElasticArm {
        inertia,
        stiffness: inertia * omega * omega,
        damping: 0.02 * inertia * omega,
        rigid_inertia: 0.1 * model.drive.load_inertia,
    };
    let arm = DampedArm::Elastic(ArmDamping { believed: arm_model, ..ArmDamping::default() });
    StateFeedback { arm, compensates_load, ..StateFeedback::default() }
}

/// Largest twist of the arm [rad] in each half second after a knock on the carriage, under a controller.
fn twists(whole: &SampledDrive, controller: &LinearController<f64>, dt: f64) -> [f64; 4] {
    let mut x = DVector::zeros(ARM_RATE + 1);
    // The carriage is pushed, the arm remains in place.
    (x[VELOCITY], x[ARM_RATE]) = (2.0, -2.0);
    let mut state = controller.take_over(0.0, ControllerInput::default());
    let mut largest = [0.0f64; 4];
    let samples = (0.5 / dt) as usize;
    for k in 0..4 * samples {
        let input =
            ControllerInput { measured_angle: x[ANGLE], measured_velocity: x[TACHO], ..ControllerInput::default() };
        let active_torque = state.torque;
        controller.step(&mut state, input, dt);
        x = &whole.phi * &x + &whole.gamma * active_torque;
        largest[k / samples] = largest[k / samples].max(x[ARM_TWIST].abs());
    }
    largest
}

#[test]
fn a_modelled_arm_comes_to_rest_and_an_unmodelled_one_keeps_swinging() {
    for (name, dt) in [("clm-bench", 1e-3), ("prototype", 1e-3), ("prototype", 2.5e-4)] {
        let model = model(name);
        for compensates_load in [0.0, 1.0] {
            let knows = with_arm(&model, compensates_load);
            let whole = SampledDrive::whole(&knows, &model, dt).unwrap();
            let [modelled, unmodelled] = [knows.arm, DampedArm::Nothing].map(|arm| {
                let controller = state_feedback(&StateFeedback { arm, ..knows }, &model, dt).unwrap();
                twists(&whole, &controller, dt)
            });
            // An unmodelled arm is damped only by its coupling to a controlled drive.
            assert!(
                modelled[0] < unmodelled[0] && modelled[1] < 0.01 * modelled[0],
                "{name} {dt} {compensates_load}: {modelled:?}"
            );
            assert!(unmodelled[1] > 50.0 * modelled[1], "{name} {dt} {compensates_load}: {modelled:?} {unmodelled:?}");
        }
    }
}

#[test]
fn the_observer_of_the_arm_follows_an_unmeasured_twist() {
    let (model, dt) = (model("prototype"), 1e-3);
    let choice = with_arm(&model, 0.0);
    let whole = SampledDrive::whole(&choice, &model, dt).unwrap();
    let controller = state_feedback(&choice, &model, dt).unwrap();
    let mut x = DVector::zeros(ARM_RATE + 1);
    let mut state = controller.take_over(0.0, ControllerInput::default());
    let (mut largest, mut off) = (0.0f64, 0.0f64);
    for k in 0..1000 {
        let time = f64::from(k) * dt;
        let input = ControllerInput {
            reference_position: libm::sin(20.0 * time),
            reference_velocity: 20.0 * libm::cos(20.0 * time),
            reference_acceleration: -400.0 * libm::sin(20.0 * time),
            measured_angle: x[ANGLE],
            measured_velocity: x[TACHO],
            ..ControllerInput::default()
        };
        let active_torque = state.torque;
        controller.step(&mut state, input, dt);
        x = &whole.phi * &x + &whole.gamma * active_torque;
        if k > 300 {
            // The prediction for this sample.
            largest = largest.max(x[ARM_TWIST].abs());
            off = off.max((state.states[ARM_TWIST] - x[ARM_TWIST]).abs());
        }
    }
    // For the observer of the drive the torque of the arm is a varying load, which it follows with a delay.
    assert!(largest > 0.05 && off < 0.15 * largest, "{off} of {largest} rad");
}

#[test]
fn two_observers_that_make_the_arm_unstable_are_refused() {
    // A mode near the coupling's, which the observer of the drive attributes to the coupling.
    let model = model("clm-bench");
    let mut choice = with_arm(&model, 0.0);
    assert!(state_feedback(&choice, &model, 1e-3).is_ok());
    if let DampedArm::Elastic(arm) = &mut choice.arm {
        arm.believed.stiffness *= 100.0;
    }
    let refused = state_feedback(&choice, &model, 1e-3).unwrap_err().to_string();
    assert!(refused.contains("two observers") && refused.contains("bench.controller.arm.twist"), "{refused}");
}

#[test]
fn the_feedforward_alone_follows_a_motion_with_the_modelled_arm() {
    // Steady acceleration: the arm lags by a constant twist, and no feedback is needed.
    let (model, dt) = (model("prototype"), 1e-3);
    let choice = with_arm(&model, 0.0);
    let whole = SampledDrive::whole(&choice, &model, dt).unwrap();
    let controller = state_feedback(&choice, &model, dt).unwrap();
    let mut x = DVector::zeros(ARM_RATE + 1);
    let mut state = controller.take_over(0.0, ControllerInput::default());
    let mut deviation = 0.0f64;
    for k in 0..3000 {
        let time = f64::from(k) * dt;
        let input = ControllerInput {
            reference_position: 10.0 * time * time,
            reference_velocity: 20.0 * time,
            reference_acceleration: 20.0,
            measured_angle: x[ANGLE],
            measured_velocity: x[TACHO],
            ..ControllerInput::default()
        };
        let active_torque = state.torque;
        let torque = controller.step(&mut state, input, dt).torque;
        deviation = x[ANGLE] - input.reference_position;
        assert!(torque.abs() < 1.0);
        x = &whole.phi * &x + &whole.gamma * active_torque;
    }
    assert!(deviation.abs() < 1e-5 && state.integral.abs() < 1e-3, "{deviation} rad, {} N m", state.integral);
}
