use stickslip_core::block::Block as _;
use stickslip_core::control::{ControllerInput, LimitStepInput, LimitStepState, Limited, LinearState};

use super::super::state_feedback::SampledDrive;
use super::*;
use stickslip_base::parameters::presets;
use stickslip_base::preset::{Disturbances, Observation, Preset, Quadratic, Regulation, StateFeedback};

const DT: f64 = 1e-3;

fn preset() -> Preset<f64> {
    presets::find("prototype").unwrap().read().unwrap()
}

/// A fast regulator on the tacho and the encoder, within these limits of rate and speed.
fn stated(compensates_load: f64, torque_rate_limit: f64, speed_limit: f64) -> PredictiveFeedback<f64> {
    let regulator = Regulation::Quadratic(Quadratic { angle: 0.05, ..Quadratic::default() });
    let observer = Observation::Full(Disturbances::default());
    let feedback =
        StateFeedback { regulator, observer, compensates_load, torque_limit: 2.0, ..StateFeedback::default() };
    PredictiveFeedback { feedback, torque_rate_limit, speed_limit }
}

/// The modelled drive with a torque delay of one sample, and its encoder and tacho.
struct Drive {
    sampled: SampledDrive,
    states: DVector<f64>,
}

impl Drive {
    fn new(choice: &PredictiveFeedback<f64>) -> Self {
        let sampled = SampledDrive::new(&choice.feedback, &preset().model, DT).unwrap();
        let states = DVector::zeros(sampled.phi.nrows());
        Drive { sampled, states }
    }

    fn input(&self, reference: f64) -> ControllerInput<f64> {
        ControllerInput {
            reference_position: reference,
            measured_angle: self.states[ANGLE],
            measured_velocity: self.states[TACHO],
            ..ControllerInput::default()
        }
    }

    /// One sample with the active torque.
    fn step(&mut self, torque: f64) {
        self.states = &self.sampled.phi * &self.states + &self.sampled.gamma * torque;
    }
}

/// Angle, velocity and torque after each sample of a step of the set-point.
fn step_response(controller: &Predictive<f64>, choice: &PredictiveFeedback<f64>, height: f64) -> Vec<[f64; 3]> {
    let (mut drive, mut state) = (Drive::new(choice), at_rest(controller));
    (0..500)
        .map(|_| {
            let active_torque = state.torque;
            let torque = controller.step(&mut state, drive.input(height), DT).torque;
            drive.step(active_torque);
            [drive.states[ANGLE], drive.states[VELOCITY], torque]
        })
        .collect()
}

/// At rest after one sample: the next set-point is away from there.
fn at_rest(controller: &Predictive<f64>) -> LinearState<f64> {
    let mut state = LinearState::default();
    controller.step(&mut state, ControllerInput::default(), DT);
    state
}

/// The same controller without prediction: torques above a limit are clipped.
fn short_sighted(controller: &Predictive<f64>) -> Predictive<f64> {
    let step = LimitStep { resolvent: [[0.0; HORIZON]; HORIZON], ..controller.steps.step };
    Predictive { steps: LimitSteps { step }, ..*controller }
}

#[test]
fn without_an_active_limit_it_is_the_linear_controller_to_the_bit() {
    for compensates_load in [0.0, 1.0] {
        let choice = stated(compensates_load, 1e6, 1e3);
        let controller = predictive(&choice, &preset().model, DT).unwrap();
        let (mut one, mut other) = (LinearState::default(), LinearState::default());
        let mut drive = Drive::new(&choice);
        for k in 0..400 {
            let time = f64::from(k) * DT;
            let noise = 1e-4 * libm::sin(f64::from(k * k));
            let input = ControllerInput {
                reference_velocity: libm::cos(9.0 * time),
                reference_acceleration: -9.0 * libm::sin(9.0 * time),
                added_torque: 0.1 * libm::cos(5.0 * time),
                measured_angle: drive.states[ANGLE] + noise,
                ..drive.input(libm::sin(9.0 * time) / 9.0)
            };
            let active_torque = one.torque;
            let torque = controller.step(&mut one, input, DT).torque;
            assert_eq!(torque, controller.linear.step(&mut other, input, DT).torque, "sample {k}");
            assert_eq!(one, other, "sample {k}");
            assert!(torque != 0.0 && torque.abs() < 1.5);
            drive.step(active_torque);
        }
    }
}

#[test]
fn its_predicted_course_is_that_of_the_linear_controller() {
    for compensates_load in [0.0, 1.0] {
        let choice = stated(compensates_load, 1e6, 1e3);
        let controller = predictive(&choice, &preset().model, DT).unwrap();
        let linear = controller.linear;
        let (mut drive, mut state) = (Drive::new(&choice), at_rest(&controller));
        let mut torques = Vec::new();
        let mut velocities = Vec::new();
        let mut predicted = None;
        for k in 0..60 {
            // From sample 30 on with a steady acceleration of the set-point, as predicted.
            let time = DT * (f64::from(k) - 30.0);
            let input = ControllerInput {
                reference_velocity: 20.0 * time,
                reference_acceleration: 20.0,
                ..drive.input(0.02 + 10.0 * time * time)
            };
            let (before, active_torque) = (state, state.torque);
            let torque = linear.step(&mut state, input, DT).torque;
            if k == 30 {
                let mut causes = [0.0; CAUSES];
                causes[..STATES].copy_from_slice(&state.states);
                causes[STATES] = before.integral + linear.integral_gain * (0.02 - drive.states[ANGLE]) * DT;
                causes[STATES + 1] = torque;
                causes[STATES + 3] = 20.0;
                let sum = |columns: &dyn Fn(usize) -> f64| (0..CAUSES).map(|j| columns(j) * causes[j]).sum::<f64>();
                predicted = Some((
                    (0..HORIZON).map(|i| sum(&|j| controller.free_torque[j][i])).collect::<Vec<_>>(),
                    (0..SPEEDS).map(|i| sum(&|j| controller.free_velocity[j][i])).collect::<Vec<_>>(),
                ));
            }
            drive.step(active_torque);
            torques.push(torque);
            velocities.push(drive.states[VELOCITY]);
        }
        let (torque, velocity) = predicted.unwrap();
        for (k, expected) in torque.iter().enumerate() {
            assert!((torques[30 + k] - expected).abs() < 1e-9, "torque {k}: {} {expected}", torques[30 + k]);
        }
        for (j, expected) in velocity.iter().enumerate() {
            // The torque of a sample acts in the next one.
            let velocity_there = velocities[30 + (j + 1) * STRIDE];
            assert!((velocity_there - expected).abs() < 1e-9, "velocity {j}: {velocity_there} {expected}");
        }
    }
}

/// The nearest course by Hildreth's method, one limit after the other, until convergence.
fn nearest(controller: &Predictive<f64>, free: &Limited<f64>, limits: &[f64; 3]) -> Vec<f64> {
    let resolvent = DMatrix::from_fn(HORIZON, HORIZON, |i, j| controller.steps.step.resolvent[j][i]);
    let mut rows = DMatrix::zeros(2 * HORIZON + SPEEDS, HORIZON);
    let mut free_and_limit = Vec::new();
    for k in 0..HORIZON {
        rows[(k, k)] = 1.0;
        (rows[(HORIZON + k, k)], rows[(HORIZON + k, k.saturating_sub(1))]) =
            if k > 0 { (1.0, -1.0) } else { (1.0, 1.0) };
    }
    for j in 0..SPEEDS {
        let last = (j + 1) * STRIDE - 1;
        for k in 0..=last {
            rows[(2 * HORIZON + j, k)] = controller.steps.step.answer[last - k];
        }
    }
    free_and_limit.extend(free.torque.map(|value| (value, limits[0])));
    free_and_limit.extend(free.change.map(|value| (value, limits[1])));
    free_and_limit.extend(free.velocity.map(|value| (value, limits[2])));
    let distance = (resolvent.try_inverse().unwrap() - rows.transpose() * &rows) * PENALTY;
    let back = distance.try_inverse().unwrap();
    let mut price = vec![0.0; rows.nrows()];
    let mut moved = DVector::zeros(HORIZON);
    for _ in 0..200_000 {
        let mut changed = 0.0f64;
        for (i, (free, limit)) in free_and_limit.iter().enumerate() {
            let row = rows.row(i).transpose();
            let direction = &back * &row;
            let stiffness = row.dot(&direction);
            // Optimum for this limit alone.
            let at = free + row.dot(&moved) - price[i] * stiffness;
            let multiplier = (at.clamp(-limit, *limit) - at) / stiffness;
            let step = multiplier - price[i];
            moved += direction * step;
            price[i] = multiplier;
            changed = changed.max(step.abs());
        }
        if changed < 1e-12 {
            break;
        }
    }
    moved.iter().copied().collect()
}

#[test]
fn its_course_is_the_nearest_within_the_limits() {
    let choice = stated(1.0, 200.0, 20.0);
    let controller = predictive(&choice, &preset().model, DT).unwrap();
    let weight = controller.velocity_weight;
    let limits = [2.0, 200.0 * DT, weight * 20.0];
    // Courses with too much torque, change and speed, each alone and together.
    for (torque, speed) in [(0.1, 2.0), (1.0, 5.0), (3.0, 5.0), (0.1, 20.1), (1.5, 19.0)] {
        let torque: [f64; HORIZON] = std::array::from_fn(|k| torque * libm::cos(0.3 * k as f64));
        let change = std::array::from_fn(|k| if k == 0 { torque[0] } else { torque[k] - torque[k - 1] });
        let velocity = std::array::from_fn(|k| weight * speed * (1.0 + 0.005 * k as f64));
        let free = Limited { torque, change, velocity };
        let expected = nearest(&controller, &free, &limits);
        let mut state = LimitStepState { point: free };
        let mut moved = [0.0; HORIZON];
        for _ in 0..3000 {
            moved = controller.steps.step.step(&mut state, LimitStepInput { free, limits }, DT).moved;
        }
        for (k, (moved, expected)) in moved.iter().zip(&expected).enumerate() {
            assert!((moved - expected).abs() < 1e-6, "{speed} rad/s, sample {k}: {moved} {expected}");
        }
        // The limits were active.
        let exceeded = torque[0].abs() > limits[0] || change[0].abs() > limits[1] || speed > 20.0;
        assert_eq!(exceeded, expected.iter().any(|moved| moved.abs() > 1e-9));
    }
}

#[test]
fn it_brakes_before_a_speed_limit_and_is_stable_under_a_limit_of_the_torques_rate() {
    // Speed: half a turn as a raw step. Without prediction the speed is three times the limit, with overshoot.
    let choice = stated(1.0, 1e6, 20.0);
    let controller = predictive(&choice, &preset().model, DT).unwrap();
    let fastest = |course: &[[f64; 3]]| course.iter().map(|it| it[1].abs()).fold(0.0, f64::max);
    let farthest = |course: &[[f64; 3]]| course.iter().map(|it| it[0]).fold(0.0, f64::max);
    let seeing = step_response(&controller, &choice, 3.0);
    let blind = step_response(&short_sighted(&controller), &choice, 3.0);
    assert!(fastest(&seeing) < 1.02 * 20.0 && farthest(&seeing) < 3.0 + 0.05, "{}", fastest(&seeing));
    assert!(fastest(&blind) > 50.0 && farthest(&blind) > 4.0, "{} {}", fastest(&blind), farthest(&blind));
    assert!((seeing[499][0] - 3.0).abs() < 1e-3);
    assert!(seeing.iter().all(|it| it[2].abs() <= 2.0));
    // Rate: clipping makes the loop oscillate.
    let choice = stated(1.0, 50.0, 1e3);
    let controller = predictive(&choice, &preset().model, DT).unwrap();
    let seeing = step_response(&controller, &choice, 0.05);
    let blind = step_response(&short_sighted(&controller), &choice, 0.05);
    let last = |course: &[[f64; 3]]| course[400..].iter().map(|it| (it[0] - 0.05).abs()).fold(0.0, f64::max);
    assert!(last(&seeing) < 1e-5 && last(&blind) > 0.1, "{} {}", last(&seeing), last(&blind));
    for pair in seeing.windows(2) {
        assert!((pair[1][2] - pair[0][2]).abs() <= 50.0 * DT + 1e-12);
    }
}

#[test]
fn a_non_finite_input_gives_no_torque_and_is_not_stored() {
    let choice = stated(0.0, 200.0, 20.0);
    let controller = predictive(&choice, &preset().model, DT).unwrap();
    let mut state = LinearState::default();
    for _ in 0..20 {
        controller.step(&mut state, Drive::new(&choice).input(1.0), DT);
    }
    for angle in [f64::NAN, f64::INFINITY, -f64::INFINITY] {
        let input = ControllerInput { measured_angle: angle, ..ControllerInput::default() };
        let before = state;
        assert_eq!(controller.step(&mut state, input, DT).torque, 0.0);
        assert_eq!((state.states, state.integral), (before.states, before.integral));
    }
}
