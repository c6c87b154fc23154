//! State feedback with an observer, from the model of the drive.
//!
//! The model has the two masses with their coupling, servo amplifier and tacho with their lags, and a varying load
//! torque. A torque computed from a sample acts from the next one on: the observer predicts the states for that
//! instant, with the torque that acts until then, so that the feedback has no delay.
//!
//!   x̂ = x̄ + L·(y − C·x̄),   x̄⁺ = Φ·x̂ + Γ·M₋ + Γ_c·M_c₋,   M = M_r − K·(x̄⁺ − x_r⁺) − K_z·∑ T·(φ − r)
//!
//! The torque added by the compensation of friction, M_c, acts on the motor and is balanced by the friction on the
//! load: together they twist the coupling. An observer without this information corrects the twist, and friction is
//! compensated more than once.
//!
//! An elastic arm on the carriage has a separate, decentralised observer: it has no sensor, the observed motion of the
//! carriage drives it, and for the observer of the drive it is a load. The gains are those of drive and arm together.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};
use stickslip_core::control::{INPUTS, LinearController, STATES};

use super::drive_observer::{MOTION, motion, sampled_noise, slow_tacho, tacho_lag};
use super::{kalman_filter, linear_controller, linear_quadratic_regulator, place_poles, zero_order_hold};
use crate::linear::size;
use stickslip_base::Error;
use stickslip_base::preset::{
    ArmDamping, ControllerMatrices, DampedArm, Model, Observation, Poles, Quadratic, Regulation, StateFeedback,
};

/// Angle, twist, motor velocity and velocity as in [`motion`]; then load torque, tacho and torque of the drive motor.
pub(super) const ANGLE: usize = 0;
const TWIST: usize = 1;
const MOTOR_VELOCITY: usize = 2;
pub(super) const VELOCITY: usize = 3;
const LOAD: usize = 4;
pub(super) const TACHO: usize = 5;
const TORQUE: usize = 6;
/// Number of states of the drive; an arm has two more: its twist and the rate of it.
const ORDER: usize = 7;
const ARM_TWIST: usize = 7;
const ARM_RATE: usize = 8;

/// States that the controller can move, without those of an arm.
const MOVED: [usize; 5] = [ANGLE, TWIST, MOTOR_VELOCITY, VELOCITY, TORQUE];

/// Share of the encoder's variance for an angle that is used without filtering.
const EXACT: f64 = 1e-6;

/// The drive over a sample of the controller.
#[derive(Clone, Debug)]
pub(crate) struct SampledDrive {
    /// System matrix.
    pub(crate) phi: DMatrix<f64>,
    /// Input vector of the commanded torque.
    pub(crate) gamma: DVector<f64>,
    /// Covariance of the process noise.
    noise: DMatrix<f64>,
}

impl SampledDrive {
    /// The drive with an arm as a load; the arm's inertia on the carriage is modelled.
    pub(crate) fn new(choice: &StateFeedback<f64>, model: &Model<f64>, dt: f64) -> Result<Self, Error> {
        let (a, b) = rates(choice, model);
        let (a, b) = (a.view((0, 0), (ORDER, ORDER)).into_owned(), b.rows(0, ORDER).into_owned());
        Self::over(&a, &b, choice, model, dt)
    }

    /// Drive and arm as they move together.
    fn whole(choice: &StateFeedback<f64>, model: &Model<f64>, dt: f64) -> Result<Self, Error> {
        let (a, b) = rates(choice, model);
        Self::over(&a, &b, choice, model, dt)
    }

    fn over(
        a: &DMatrix<f64>,
        b: &DMatrix<f64>,
        choice: &StateFeedback<f64>,
        model: &Model<f64>,
        dt: f64,
    ) -> Result<Self, Error> {
        let disturbances = choice.observer.disturbances();
        let mut density = DMatrix::<f64>::zeros(a.nrows(), a.nrows());
        density[(MOTOR_VELOCITY, MOTOR_VELOCITY)] = (disturbances.motor_torque / model.drive.motor_inertia).powi(2);
        density[(LOAD, LOAD)] = disturbances.load_torque.powi(2);
        let noise = sampled_noise(a, &density, dt)?;
        let (phi, gamma) = zero_order_hold(a, b, dt)?;
        Ok(SampledDrive { phi, gamma: gamma.column(0).into_owned(), noise })
    }

    /// Both observers, of the drive and of the arm, as one: the arm swings freely while the carriage moves steadily
    /// from the observed velocity to the predicted one; corrections of the carriage leave the arm unchanged.
    fn with_arm(&self, gain: &DMatrix<f64>, arm: &ArmDamping<f64>, dt: f64) -> Result<(Self, DMatrix<f64>), Error> {
        let order = ARM_RATE + 1;
        let mut phi = self.phi.clone().resize(order, order, 0.0);
        let mut gamma = self.gamma.clone().resize_vertically(order, 0.0);
        let arm = &arm.believed;
        let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -arm.stiffness / arm.inertia, -arm.damping / arm.inertia]);
        let (swings, dragged) = zero_order_hold(&a, &DMatrix::from_column_slice(2, 1, &[0.0, -1.0 / dt]), dt)?;
        phi.view_mut((ARM_TWIST, ARM_TWIST), (2, 2)).copy_from(&swings);
        let mut gained = self.phi.row(VELOCITY).into_owned();
        gained[VELOCITY] -= 1.0;
        phi.view_mut((ARM_TWIST, 0), (2, ORDER)).copy_from(&(&dragged * gained));
        gamma.rows_mut(ARM_TWIST, 2).copy_from(&(dragged.column(0) * self.gamma[VELOCITY]));
        let mut gain = gain.clone().resize_vertically(order, 0.0);
        for (of_arm, of_carriage) in [(ARM_TWIST, ANGLE), (ARM_RATE, VELOCITY)] {
            let moved = -gain.row(of_carriage);
            gain.row_mut(of_arm).copy_from(&moved);
        }
        Ok((SampledDrive { phi, gamma, noise: self.noise.clone() }, gain))
    }

    /// The gain L of the observer: one row for each state, one column each for encoder and tacho.
    fn observer(&self, choice: &Observation<f64>, model: &Model<f64>) -> Result<DMatrix<f64>, Error> {
        let count = (TAU / model.encoder.counts_per_revolution).powi(2) / 12.0;
        let sensors = [count, slow_tacho(model).powi(2)];
        // The filter of these states with these sensors.
        let filter = |states: &[usize], measured: &[(usize, usize, f64)]| {
            let a = self.phi.select_rows(states).select_columns(states);
            let q = self.noise.select_rows(states).select_columns(states);
            let mut c = DMatrix::zeros(measured.len(), states.len());
            let mut r = DMatrix::zeros(measured.len(), measured.len());
            for (row, &(sensor, state, share)) in measured.iter().enumerate() {
                c[(row, state - states[0])] = 1.0;
                r[(row, row)] = share * sensors[sensor];
            }
            let gain = kalman_filter(&a, &c, &q, &r)?.gain;
            let mut all = DMatrix::zeros(ORDER, sensors.len());
            for (column, &(sensor, ..)) in measured.iter().enumerate() {
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
        let moved = [&MOVED[..], &[ARM_TWIST, ARM_RATE][..self.phi.nrows() - ORDER]].concat();
        let order = moved.len() + usize::from(integrates);
        let mut a = DMatrix::zeros(order, order);
        a.view_mut((0, 0), (moved.len(), moved.len())).copy_from(&self.phi.select_rows(&moved).select_columns(&moved));
        let mut b = DVector::zeros(order);
        b.rows_mut(0, moved.len()).copy_from(&self.gamma.select_rows(&moved));
        if integrates {
            (a[(order - 1, order - 1)], a[(order - 1, ANGLE)]) = (1.0, dt);
        }
        let gains = match &choice.regulator {
            Regulation::Quadratic(target) => least_squares(&a, &b, target, choice)?,
            Regulation::Poles(target) => place_poles(&a, &b, &poles(target, choice, model, dt))?,
        };
        let mut all = DVector::zeros(self.phi.nrows());
        for (gain, state) in gains.iter().zip(moved) {
            all[state] = *gain;
        }
        if integrates {
            return Ok((all, gains[order - 1]));
        }
        // The observed load torque is compensated; the arm's part of it is not a load to the regulator.
        all[LOAD] = -1.0;
        if let DampedArm::Elastic(arm) = &choice.arm {
            all[ARM_TWIST] -= arm.believed.stiffness;
            all[ARM_RATE] -= arm.believed.damping;
        }
        Ok((all, 0.0))
    }
}

/// Lag of the drive motor's torque [s]. A delay counts as lag: up to the frequencies of a stable loop both have the same
/// phase, and the observer needs no state for each sample of delay.
fn torque_lag(model: &Model<f64>) -> f64 {
    model.servo_lag + model.servo_delay
}

/// Rates of all states, and effect of the commanded torque on them; an arm's states follow those of the drive.
fn rates(choice: &StateFeedback<f64>, model: &Model<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let arm = if let DampedArm::Elastic(arm) = &choice.arm { Some(&arm.believed) } else { None };
    let mut drive = model.drive;
    drive.load_inertia += arm.map_or(0.0, |arm| arm.rigid_inertia);
    let order = ORDER + arm.map_or(0, |_| 2);
    let mut a = DMatrix::<f64>::zeros(order, order);
    a.view_mut((0, 0), (MOTION, MOTION)).copy_from(&motion(&drive));
    a[(MOTOR_VELOCITY, TORQUE)] = 1.0 / drive.motor_inertia;
    a[(VELOCITY, LOAD)] = -1.0 / drive.load_inertia;
    let lag = tacho_lag(model);
    (a[(TACHO, MOTOR_VELOCITY)], a[(TACHO, TACHO)]) = (1.0 / lag, -1.0 / lag);
    a[(TORQUE, TORQUE)] = -1.0 / torque_lag(model);
    if let Some(arm) = arm {
        a[(VELOCITY, ARM_TWIST)] = arm.stiffness / drive.load_inertia;
        a[(VELOCITY, ARM_RATE)] = arm.damping / drive.load_inertia;
        a[(ARM_TWIST, ARM_RATE)] = 1.0;
        // Relative to the moving carriage.
        let carriage = a.row(VELOCITY).into_owned();
        a.row_mut(ARM_RATE).copy_from(&-carriage);
        a[(ARM_RATE, ARM_TWIST)] -= arm.stiffness / arm.inertia;
        a[(ARM_RATE, ARM_RATE)] -= arm.damping / arm.inertia;
    }
    let mut b = DMatrix::<f64>::zeros(order, 1);
    b[TORQUE] = 1.0 / torque_lag(model);
    (a, b)
}

/// The feedback with the least sum of squares of the weighted deviations, as a share of the torque limit.
fn least_squares(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    weights: &Quadratic<f64>,
    choice: &StateFeedback<f64>,
) -> Result<DVector<f64>, Error> {
    let mut q = DMatrix::zeros(a.nrows(), a.nrows());
    let square = |tolerance: f64| 1.0 / (tolerance * tolerance);
    q[(ANGLE, ANGLE)] = square(weights.angle);
    q[(VELOCITY, VELOCITY)] = square(weights.velocity);
    let vibration = square(weights.vibration);
    for (row, column, sign) in [
        (MOTOR_VELOCITY, MOTOR_VELOCITY, 1.0),
        (MOTOR_VELOCITY, VELOCITY, -1.0),
        (VELOCITY, MOTOR_VELOCITY, -1.0),
        (VELOCITY, VELOCITY, 1.0),
    ] {
        q[(row, column)] += sign * vibration;
    }
    if let DampedArm::Elastic(arm) = &choice.arm {
        q[(MOVED.len(), MOVED.len())] = square(arm.twist);
    }
    if choice.compensates_load < 0.5 {
        let integral = a.nrows() - 1;
        q[(integral, integral)] = square(weights.angle * weights.integral_time);
    }
    let r = DMatrix::from_element(1, 1, square(choice.torque_limit));
    let b = DMatrix::from_column_slice(b.len(), 1, b.as_slice());
    Ok(linear_quadratic_regulator(a, &b, &q, &r, None)?.gain.row(0).transpose())
}

/// The poles in z: drive and load together, the vibration at its own frequency, the arm at its own with the same
/// damping, the servo amplifier, the integral.
fn poles(target: &Poles<f64>, choice: &StateFeedback<f64>, model: &Model<f64>, dt: f64) -> Vec<Complex<f64>> {
    let drive = &model.drive;
    let mut poles = pair(target.bandwidth, target.damping, dt);
    poles.extend(pair(drive.vibration(), target.vibration_damping, dt));
    let real = |rate: f64| Complex::new(libm::exp(-rate * dt), 0.0);
    poles.push(real(1.0 / torque_lag(model)));
    if let DampedArm::Elastic(arm) = &choice.arm {
        poles.extend(pair(arm.believed.angular_frequency(), target.vibration_damping, dt));
    }
    if choice.compensates_load < 0.5 {
        poles.push(real(target.integral_rate));
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

/// The controller of a state feedback, sampled with `dt` [s].
///
/// # Errors
/// Errors of [`kalman_filter`], [`linear_quadratic_regulator`] and [`place_poles`]: poles that the torque does not
/// reach. [`Error::NotSolvable`] if the two separate observers make an arm unstable.
pub fn state_feedback(
    choice: &StateFeedback<f64>,
    model: &Model<f64>,
    dt: f64,
) -> Result<LinearController<f64>, Error> {
    let drive = SampledDrive::new(choice, model, dt)?;
    let gain = drive.observer(&choice.observer, model)?;
    let DampedArm::Elastic(arm) = &choice.arm else {
        let (k, integral_gain) = drive.regulator(choice, model, dt)?;
        return Ok(controller(&drive, &gain, &k, integral_gain, choice, model, dt));
    };
    let whole = SampledDrive::whole(choice, model, dt)?;
    let (k, integral_gain) = whole.regulator(choice, model, dt)?;
    let (drive, gain) = drive.with_arm(&gain, arm, dt)?;
    let controller = controller(&drive, &gain, &k, integral_gain, choice, model, dt);
    let slowest = whole.under(&controller).complex_eigenvalues().iter().map(|&pole| size(pole)).fold(0.0, f64::max);
    if slowest < 1.0 {
        return Ok(controller);
    }
    Err(Error::NotSolvable {
        what: "a state feedback with two observers, of the drive and of the arm, that is stable with the arm",
        remedy: "Reduce the weight of the arm's twist (bench.controller.arm.twist), or make the observer of the drive \
         faster (bench.controller.observer.load_torque).",
    })
}

/// The matrices of these gains.
fn controller(
    drive: &SampledDrive,
    l: &DMatrix<f64>,
    k: &DVector<f64>,
    integral_gain: f64,
    choice: &StateFeedback<f64>,
    model: &Model<f64>,
    dt: f64,
) -> LinearController<f64> {
    let SampledDrive { phi, gamma, .. } = drive;
    let order = phi.nrows();
    let mut uncorrected = DMatrix::<f64>::identity(order, order);
    for (sensor, state) in [ANGLE, TACHO].into_iter().enumerate() {
        let mut column = uncorrected.column_mut(state);
        column -= l.column(sensor);
    }
    let a = phi * uncorrected;
    let mut b = DMatrix::zeros(order, INPUTS);
    b.view_mut((0, 0), (order, 2)).copy_from(&(phi * l));
    // The angle is relative to the set-point, which moved.
    b.set_column(2, &-a.column(ANGLE));
    b.set_column(5, gamma);
    let mut balanced = gamma + phi.column(LOAD);
    balanced[LOAD] -= 1.0;
    b.set_column(6, &balanced);

    let c = -(k.transpose() * &a);
    let mut d = -(k.transpose() * &b);
    // The integral includes this sample.
    d[0] -= integral_gain * dt;
    // The predicted set-point, and the torque for its acceleration, also for an arm and its twist.
    let drive = &model.drive;
    let velocities = k[VELOCITY] + k[MOTOR_VELOCITY];
    let arm = if let DampedArm::Elastic(arm) = &choice.arm { Some(&arm.believed) } else { None };
    let carried = arm.map_or(0.0, |arm| arm.inertia + arm.rigid_inertia);
    d[3] += k[ANGLE] * dt + velocities;
    d[4] += k[ANGLE] * 0.5 * dt * dt
        + velocities * dt
        + k[TWIST] * (drive.load_inertia + carried) / drive.coupling_stiffness
        + (k[TORQUE] + 1.0) * (drive.inertia() + carried)
        - arm.map_or(0.0, |arm| k[ARM_TWIST] * arm.inertia / arm.stiffness);
    // The compensated friction requires its twist and its torque.
    d[7] += k[TWIST] / drive.coupling_stiffness + k[TORQUE];

    let padded = |row: usize, column: usize, of: &DMatrix<f64>| of.get((row, column)).copied().unwrap_or(0.0);
    linear_controller(&ControllerMatrices {
        system: std::array::from_fn(|i| std::array::from_fn(|j| padded(i, j, &a))),
        input: std::array::from_fn(|i| std::array::from_fn(|j| padded(i, j, &b))),
        output: std::array::from_fn(|j| c.get(j).copied().unwrap_or(0.0)),
        direct: std::array::from_fn(|j| d[j]),
        integral_gain,
        sampling_time: dt,
        torque_limit: choice.torque_limit,
    })
}

impl SampledDrive {
    /// The whole closed system, with a torque delay of one sample: drive, controller, integral, active torque.
    fn under(&self, controller: &LinearController<f64>) -> DMatrix<f64> {
        let n = self.phi.nrows();
        let (integral, torque) = (n + STATES, n + STATES + 1);
        let mut all = DMatrix::zeros(torque + 1, torque + 1);
        all.view_mut((0, 0), (n, n)).copy_from(&self.phi);
        all.view_mut((0, torque), (n, 1)).copy_from(&self.gamma);
        // The varying load torque is not controlled.
        all[(LOAD, LOAD)] = 0.0;
        for row in 0..STATES {
            for column in 0..STATES {
                all[(n + row, n + column)] = controller.system[column][row];
            }
            for (input, column) in [(0, ANGLE), (1, TACHO), (5, torque)] {
                all[(n + row, column)] += controller.input[input][row];
            }
            all[(torque, n + row)] = controller.output[row];
        }
        for (input, column) in [(0, ANGLE), (1, TACHO), (5, torque)] {
            all[(torque, column)] += controller.direct[input];
        }
        let gain = controller.integral_gain * controller.sampling_time;
        (all[(integral, integral)], all[(integral, ANGLE)], all[(torque, integral)]) = (1.0, -gain, 1.0);
        if gain == 0.0 {
            all[(integral, integral)] = 0.0;
        }
        all
    }
}

// The block has room for drive and arm.
const _: () = assert!(ARM_RATE < STATES);

#[cfg(test)]
mod tests;
