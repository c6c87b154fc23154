//! State feedback with an observer, from what is believed of the drive.
//!
//! The model has the two masses with their coupling, servo amplifier and tacho with their lags, and a load torque that
//! wanders. A torque computed from a sample is in force from the next one on: the observer predicts the states for that
//! instant, with the torque that acts until then, so the feedback knows no delay.
//!
//!   x̂ = x̄ + L·(y − C·x̄),   x̄⁺ = Φ·x̂ + Γ·M₋ + Γ_c·M_c₋,   M = M_r − K·(x̄⁺ − x_r⁺) − K_z·∑ T·(φ − r)
//!
//! What compensation of friction adds, M_c, acts on the motor and is met by that friction on the load: between both it
//! twists the coupling. An observer that is not told so corrects the twist, and friction is compensated more than once.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};
use stickslip_core::control::{INPUTS, LinearController, STATES};

use super::drive_observer::{MOTION, motion, sampled_noise, slow_tacho, tacho_lag};
use super::{kalman_filter, linear_controller, linear_quadratic_regulator, place_poles, zero_order_hold};
use crate::Error;
use crate::preset::{ControllerMatrices, Model, Observation, Poles, Quadratic, Regulation, StateFeedback};

/// Angle, twist, motor velocity and velocity as in [`motion`]; then load torque, tacho and torque of the drive motor.
const ANGLE: usize = 0;
const TWIST: usize = 1;
const MOTOR_VELOCITY: usize = 2;
const VELOCITY: usize = 3;
const LOAD: usize = 4;
const TACHO: usize = 5;
const TORQUE: usize = 6;
const ORDER: usize = 7;

/// States that the controller moves.
const MOVED: [usize; 5] = [ANGLE, TWIST, MOTOR_VELOCITY, VELOCITY, TORQUE];

/// Share of the encoder's variance that counts where its angle is taken as it is.
const EXACT: f64 = 1e-6;

/// The drive over a sample of the controller.
#[derive(Clone, Debug)]
pub(crate) struct SampledDrive {
    /// What becomes of each state.
    pub(crate) phi: DMatrix<f64>,
    /// What a torque asked of the servo amplifier does.
    pub(crate) gamma: DVector<f64>,
    /// Covariance of what is added to the states.
    noise: DMatrix<f64>,
}

impl SampledDrive {
    pub(crate) fn new(choice: &StateFeedback<f64>, model: &Model<f64>, dt: f64) -> Result<Self, Error> {
        let drive = &model.drive;
        let mut a = DMatrix::<f64>::zeros(ORDER, ORDER);
        a.view_mut((0, 0), (MOTION, MOTION)).copy_from(&motion(drive));
        a[(MOTOR_VELOCITY, TORQUE)] = 1.0 / drive.motor_inertia;
        a[(VELOCITY, LOAD)] = -1.0 / drive.load_inertia;
        let lag = tacho_lag(model);
        (a[(TACHO, MOTOR_VELOCITY)], a[(TACHO, TACHO)]) = (1.0 / lag, -1.0 / lag);
        a[(TORQUE, TORQUE)] = -1.0 / model.servo_lag;
        let mut b = DMatrix::<f64>::zeros(ORDER, 1);
        b[TORQUE] = 1.0 / model.servo_lag;
        let believed = choice.observer.disturbances();
        let mut density = DMatrix::<f64>::zeros(ORDER, ORDER);
        density[(MOTOR_VELOCITY, MOTOR_VELOCITY)] = (believed.motor_torque / drive.motor_inertia).powi(2);
        density[(LOAD, LOAD)] = believed.load_torque.powi(2);
        let noise = sampled_noise(&a, &density, dt)?;
        let (phi, gamma) = zero_order_hold(&a, &b, dt)?;
        Ok(SampledDrive { phi, gamma: gamma.column(0).into_owned(), noise })
    }

    /// The gain L of the observer: a row a state, a column for encoder and tacho each.
    fn observer(&self, choice: &Observation<f64>, model: &Model<f64>) -> Result<DMatrix<f64>, Error> {
        let count = (TAU / model.encoder.counts_per_revolution).powi(2) / 12.0;
        let sensors = [count, slow_tacho(model).powi(2)];
        // The filter that sees these states by these sensors.
        let filter = |states: &[usize], seen: &[(usize, usize, f64)]| {
            let a = self.phi.select_rows(states).select_columns(states);
            let q = self.noise.select_rows(states).select_columns(states);
            let mut c = DMatrix::zeros(seen.len(), states.len());
            let mut r = DMatrix::zeros(seen.len(), seen.len());
            for (row, &(sensor, state, share)) in seen.iter().enumerate() {
                c[(row, state - states[0])] = 1.0;
                r[(row, row)] = share * sensors[sensor];
            }
            let gain = kalman_filter(&a, &c, &q, &r)?.gain;
            let mut all = DMatrix::zeros(ORDER, sensors.len());
            for (column, &(sensor, ..)) in seen.iter().enumerate() {
                for (row, &state) in states.iter().enumerate() {
                    all[(state, sensor)] = gain[(row, column)];
                }
            }
            Ok(all)
        };
        const ALL: [usize; ORDER] = [ANGLE, TWIST, MOTOR_VELOCITY, VELOCITY, LOAD, TACHO, TORQUE];
        match choice {
            Observation::Full(_) => filter(&ALL, &[(0, ANGLE, 1.0), (1, TACHO, 1.0)]),
            Observation::Reduced(_) => filter(&ALL, &[(0, ANGLE, EXACT), (1, TACHO, 1.0)]),
            Observation::LoadSide(_) => filter(&ALL, &[(0, ANGLE, 1.0)]),
            Observation::MotorSide(_) => {
                let mut gain = filter(&ALL[1..], &[(1, TACHO, 1.0)])?;
                gain[(ANGLE, 0)] = 1.0;
                Ok(gain)
            }
        }
    }

    /// The gains K of the states, and that of the integral.
    fn regulator(
        &self,
        choice: &StateFeedback<f64>,
        model: &Model<f64>,
        dt: f64,
    ) -> Result<(DVector<f64>, f64), Error> {
        let integrates = choice.compensates_load < 0.5;
        let order = MOVED.len() + usize::from(integrates);
        let mut a = DMatrix::zeros(order, order);
        a.view_mut((0, 0), (MOVED.len(), MOVED.len())).copy_from(&self.phi.select_rows(&MOVED).select_columns(&MOVED));
        let mut b = DVector::zeros(order);
        b.rows_mut(0, MOVED.len()).copy_from(&self.gamma.select_rows(&MOVED));
        if integrates {
            (a[(order - 1, order - 1)], a[(order - 1, ANGLE)]) = (1.0, dt);
        }
        let gains = match &choice.regulator {
            Regulation::Quadratic(wanted) => least_squares(&a, &b, wanted, choice.torque_limit)?,
            Regulation::Poles(wanted) => place_poles(&a, &b, &poles(wanted, model, dt, integrates))?,
        };
        let mut all = DVector::zeros(ORDER);
        for (gain, state) in gains.iter().zip(MOVED) {
            all[state] = *gain;
        }
        // A load torque that is known is met.
        all[LOAD] = if integrates { 0.0 } else { -1.0 };
        Ok((all, if integrates { gains[order - 1] } else { 0.0 }))
    }
}

/// The feedback with the least sum of squares of what is wanted small, as a share of the torque limit.
fn least_squares(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    wanted: &Quadratic<f64>,
    torque_limit: f64,
) -> Result<DVector<f64>, Error> {
    let mut q = DMatrix::zeros(a.nrows(), a.nrows());
    let square = |tolerance: f64| 1.0 / (tolerance * tolerance);
    q[(ANGLE, ANGLE)] = square(wanted.angle);
    q[(VELOCITY, VELOCITY)] = square(wanted.velocity);
    let vibration = square(wanted.vibration);
    for (row, column, sign) in [
        (MOTOR_VELOCITY, MOTOR_VELOCITY, 1.0),
        (MOTOR_VELOCITY, VELOCITY, -1.0),
        (VELOCITY, MOTOR_VELOCITY, -1.0),
        (VELOCITY, VELOCITY, 1.0),
    ] {
        q[(row, column)] += sign * vibration;
    }
    if let Some(integral) = (MOVED.len()..a.nrows()).next() {
        q[(integral, integral)] = square(wanted.angle * wanted.integral_time);
    }
    let r = DMatrix::from_element(1, 1, square(torque_limit));
    let b = DMatrix::from_column_slice(b.len(), 1, b.as_slice());
    Ok(linear_quadratic_regulator(a, &b, &q, &r, None)?.gain.row(0).transpose())
}

/// The poles in z: drive and load together, the vibration at its own frequency, the servo amplifier, the integral.
fn poles(wanted: &Poles<f64>, model: &Model<f64>, dt: f64, integrates: bool) -> Vec<Complex<f64>> {
    let drive = &model.drive;
    let mut poles = pair(wanted.bandwidth, wanted.damping, dt);
    poles.extend(pair(drive.vibration(), wanted.vibration_damping, dt));
    let real = |rate: f64| Complex::new(libm::exp(-rate * dt), 0.0);
    poles.push(real(1.0 / model.servo_lag));
    if integrates {
        poles.push(real(wanted.integral_rate));
    }
    poles
}

/// The two poles in z of a natural frequency [rad/s] and a damping ratio.
fn pair(frequency: f64, damping: f64, dt: f64) -> Vec<Complex<f64>> {
    let decay = libm::exp(-damping * frequency * dt);
    if damping < 1.0 {
        let angle = frequency * libm::sqrt(1.0 - damping * damping) * dt;
        let pole = Complex::new(decay * libm::cos(angle), decay * libm::sin(angle));
        vec![pole, pole.conj()]
    } else {
        let apart = frequency * libm::sqrt(damping * damping - 1.0) * dt;
        vec![Complex::new(decay * libm::exp(apart), 0.0), Complex::new(decay * libm::exp(-apart), 0.0)]
    }
}

/// The controller that a state feedback is, sampled with `dt` [s].
///
/// # Errors
/// What [`kalman_filter`], [`linear_quadratic_regulator`] and [`place_poles`] refuse: poles that the torque does not
/// reach.
pub fn state_feedback(
    choice: &StateFeedback<f64>,
    model: &Model<f64>,
    dt: f64,
) -> Result<LinearController<f64>, Error> {
    let sampled = SampledDrive::new(choice, model, dt)?;
    let (k, integral_gain) = sampled.regulator(choice, model, dt)?;
    let l = sampled.observer(&choice.observer, model)?;
    let SampledDrive { phi, gamma, .. } = &sampled;

    let mut kept = DMatrix::<f64>::identity(ORDER, ORDER);
    for (sensor, state) in [ANGLE, TACHO].into_iter().enumerate() {
        let mut column = kept.column_mut(state);
        column -= l.column(sensor);
    }
    let a = phi * kept;
    let mut b = DMatrix::zeros(ORDER, INPUTS);
    b.view_mut((0, 0), (ORDER, 2)).copy_from(&(phi * &l));
    // The angle is counted from the set-point, which moved.
    b.set_column(2, &-a.column(ANGLE));
    b.set_column(5, gamma);
    let mut met = gamma + phi.column(LOAD);
    met[LOAD] -= 1.0;
    b.set_column(6, &met);

    let c = -(k.transpose() * &a);
    let mut d = -(k.transpose() * &b);
    // The integral of this very sample counts.
    d[0] -= integral_gain * dt;
    // Where the set-point will be, and what its acceleration asks for.
    let drive = &model.drive;
    let velocities = k[VELOCITY] + k[MOTOR_VELOCITY];
    d[3] += k[ANGLE] * dt + velocities;
    d[4] += k[ANGLE] * 0.5 * dt * dt
        + velocities * dt
        + k[TWIST] * drive.load_inertia / drive.coupling_stiffness
        + (k[TORQUE] + 1.0) * drive.inertia();
    // The friction that is compensated wants its twist and its torque.
    d[7] += k[TWIST] / drive.coupling_stiffness + k[TORQUE];

    let padded = |row: usize, column: usize, of: &DMatrix<f64>| of.get((row, column)).copied().unwrap_or(0.0);
    Ok(linear_controller(&ControllerMatrices {
        system: std::array::from_fn(|i| std::array::from_fn(|j| padded(i, j, &a))),
        input: std::array::from_fn(|i| std::array::from_fn(|j| padded(i, j, &b))),
        output: std::array::from_fn(|j| c.get(j).copied().unwrap_or(0.0)),
        direct: std::array::from_fn(|j| d[j]),
        integral_gain,
        sampling_time: dt,
        torque_limit: choice.torque_limit,
    }))
}

// The block has room for the drive.
const _: () = assert!(ORDER <= STATES);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;
    use crate::design::PositionLoop;
    use crate::linear::{StateSpace, size};
    use crate::parameters::presets;
    use crate::preset::Disturbances;
    use stickslip_core::block::Block as _;
    use stickslip_core::control::{ControllerInput, PositionController};

    fn model(name: &str) -> Model<f64> {
        let preset: Preset<f64> = presets::find(name).unwrap().read().unwrap();
        preset.model
    }

    /// All kinds of it.
    fn kinds() -> Vec<StateFeedback<f64>> {
        let believed = Disturbances::default();
        let mut kinds = Vec::new();
        for regulator in [Regulation::Quadratic(Quadratic::default()), Regulation::Poles(Poles::default())] {
            for observer in [Observation::Full, Observation::Reduced, Observation::LoadSide, Observation::MotorSide] {
                for compensates_load in [0.0, 1.0] {
                    let observer = observer(believed);
                    kinds.push(StateFeedback { regulator, observer, compensates_load, ..StateFeedback::default() });
                }
            }
        }
        kinds
    }

    /// The axis that the design believes: the torque a sample late, angle and tacho.
    fn believed_axis(choice: &StateFeedback<f64>, model: &Model<f64>, dt: f64) -> StateSpace {
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
                // Regulator: the states that are moved, and the integral.
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
                // The tacho's lag, which moves nothing.
                expected.push(Complex::new(drive.phi[(TACHO, TACHO)], 0.0));
                // Observer: Φ·(I − L·C).
                let mut error = drive.phi.clone();
                for (sensor, state) in [ANGLE, TACHO].into_iter().enumerate() {
                    let of = &drive.phi * l.column(sensor);
                    let mut column = error.column_mut(state);
                    column -= of;
                }
                if matches!(choice.observer, Observation::LoadSide(_)) {
                    // Nobody asks it what the tacho shows.
                    error = error.remove_row(TACHO).remove_column(TACHO);
                }
                expected.extend(error.complex_eigenvalues().iter());

                let controller = PositionController::Linear(state_feedback(&choice, &model, dt).unwrap());
                let closes = PositionLoop::over(believed_axis(&choice, &model, dt), controller, 0.0).unwrap();
                let found = closes.closed().unwrap().poles().unwrap();
                // Poles that lie close together are known to a root of the rounding only: the polynomials are compared,
                // at points where they are as large as they get.
                for point in 0..24 {
                    let z = {
                        let angle = f64::from(point) * TAU / 24.0;
                        Complex::new(1.1 * libm::cos(angle), 1.1 * libm::sin(angle))
                    };
                    let product = |poles: &[Complex<f64>]| poles.iter().map(|pole| z - pole).product::<Complex<f64>>();
                    // What is not moved by anything else: the torque in force, twice, once as the drive's.
                    let at_rest = z.powi(found.len() as i32 - expected.len() as i32);
                    let (one, other) = (product(&found), product(&expected) * at_rest);
                    assert!(size(one - other) < 1e-9 * size(other), "{name} {choice:?}: {found:?} {expected:?}");
                }
                assert!(expected.iter().all(|pole| size(*pole) < 1.0), "{name} {choice:?}: {expected:?}");
            }
        }
    }

    #[test]
    fn friction_that_is_compensated_is_no_load_to_the_observer_and_no_deviation_to_the_feedback() {
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
                    // At first it stays as it is; then friction changes as it likes, and compensation knows it.
                    let added =
                        if sample < 200 { steady } else { 0.2 * libm::sin(0.7 * f64::from(sample * sample % 97)) };
                    let reference = velocity * dt * f64::from(sample);
                    let met = state.added_torque;
                    let pushed = state.torque + met;
                    let given = controller.step(&mut state, input(&x, reference, added), dt).torque;
                    assert!(sample >= 200 || given.abs() < 1e-9, "{name} {choice:?} {sample}: {given}");
                    x[LOAD] = met;
                    x = &drive.phi * &x + &drive.gamma * pushed;
                    x[LOAD] = 0.0;
                    for (index, (&seen, is)) in state.states.iter().zip(x.iter()).enumerate() {
                        let is = is - if index == ANGLE { reference } else { 0.0 };
                        // Nobody asks a load-side observer what the tacho shows.
                        let asked = index != TACHO || !matches!(choice.observer, Observation::LoadSide(_));
                        assert!(!asked || (seen - is).abs() < 1e-8, "{name} {choice:?} {sample}, {index}: {seen} {is}");
                    }
                }
            }
        }
    }

    #[test]
    fn poles_are_where_they_are_wanted() {
        let (model, dt) = (model("clm-bench"), 1e-3);
        let wanted = Poles { bandwidth: 50.0, damping: 0.7, vibration_damping: 0.4, integral_rate: 25.0 };
        let choice = StateFeedback { regulator: Regulation::Poles(wanted), ..StateFeedback::default() };
        let controller = PositionController::Linear(state_feedback(&choice, &model, dt).unwrap());
        let closes = PositionLoop::over(believed_axis(&choice, &model, dt), controller, 0.0).unwrap();
        let found = closes.closed().unwrap().poles().unwrap();
        for pole in poles(&wanted, &model, dt, true) {
            let nearest = found.iter().map(|other| size(other - pole)).fold(f64::INFINITY, f64::min);
            // The servo amplifier's pole is the observer's as well: a double one is known to a root of the rounding.
            assert!(nearest < 1e-6, "{pole} in {found:?}");
        }
    }

    #[test]
    fn a_motor_side_observer_does_not_hear_the_encoder_and_a_load_side_one_not_the_tacho() {
        let model = model("clm-bench");
        let gain = |observer: Observation<f64>| {
            let choice = StateFeedback { observer, ..StateFeedback::default() };
            SampledDrive::new(&choice, &model, 1e-3).unwrap().observer(&observer, &model).unwrap()
        };
        let believed = Disturbances { load_torque: 1.0, motor_torque: 1e-3 };
        let motor = gain(Observation::MotorSide(believed));
        assert_eq!((motor[(ANGLE, 0)], motor[(ANGLE, 1)]), (1.0, 0.0));
        assert!((1..ORDER).all(|state| motor[(state, 0)] == 0.0) && motor[(VELOCITY, 1)] > 0.0);
        let load = gain(Observation::LoadSide(believed));
        assert!((0..ORDER).all(|state| load[(state, 1)] == 0.0) && load[(VELOCITY, 0)] > 0.0);
        let (full, reduced) = (gain(Observation::Full(believed)), gain(Observation::Reduced(believed)));
        assert!((reduced[(ANGLE, 0)] - 1.0).abs() < 1e-3 && full[(ANGLE, 0)] < 0.9, "{full} {reduced}");
    }
}
