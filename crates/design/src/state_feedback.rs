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
//!
//! An elastic arm on the carriage has an observer of its own, decentralised: nothing is measured at it, the observed motion
//! of the carriage drives it, and to the observer of the drive it is a load. The gains are those of drive and arm together.

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
/// So many states has the drive; an arm has two more: its twist and the rate of it.
const ORDER: usize = 7;
const ARM_TWIST: usize = 7;
const ARM_RATE: usize = 8;

/// States that the controller moves; those of an arm besides.
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
    /// The drive, to which an arm is a load; what of the arm moves with the carriage is known.
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
        let believed = choice.observer.disturbances();
        let mut density = DMatrix::<f64>::zeros(a.nrows(), a.nrows());
        density[(MOTOR_VELOCITY, MOTOR_VELOCITY)] = (believed.motor_torque / model.drive.motor_inertia).powi(2);
        density[(LOAD, LOAD)] = believed.load_torque.powi(2);
        let noise = sampled_noise(a, &density, dt)?;
        let (phi, gamma) = zero_order_hold(a, b, dt)?;
        Ok(SampledDrive { phi, gamma: gamma.column(0).into_owned(), noise })
    }

    /// The two observers, that of the drive and that of the arm, as one: the arm swings on while the carriage goes steadily
    /// from the velocity that is observed to the one that is predicted; what corrects the carriage leaves the arm where
    /// it is.
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
            Regulation::Quadratic(wanted) => least_squares(&a, &b, wanted, choice)?,
            Regulation::Poles(wanted) => place_poles(&a, &b, &poles(wanted, choice, model, dt))?,
        };
        let mut all = DVector::zeros(self.phi.nrows());
        for (gain, state) in gains.iter().zip(moved) {
            all[state] = *gain;
        }
        if integrates {
            return Ok((all, gains[order - 1]));
        }
        // A load torque that is known is met; of it, what the arm makes is no load to the regulator.
        all[LOAD] = -1.0;
        if let DampedArm::Elastic(arm) = &choice.arm {
            all[ARM_TWIST] -= arm.believed.stiffness;
            all[ARM_RATE] -= arm.believed.damping;
        }
        Ok((all, 0.0))
    }
}

/// Rates of all states, and what the torque that is asked for does to them; an arm's states stand behind the drive's.
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
    a[(TORQUE, TORQUE)] = -1.0 / model.servo_lag;
    if let Some(arm) = arm {
        a[(VELOCITY, ARM_TWIST)] = arm.stiffness / drive.load_inertia;
        a[(VELOCITY, ARM_RATE)] = arm.damping / drive.load_inertia;
        a[(ARM_TWIST, ARM_RATE)] = 1.0;
        // Relative to a carriage that moves away.
        let carriage = a.row(VELOCITY).into_owned();
        a.row_mut(ARM_RATE).copy_from(&-carriage);
        a[(ARM_RATE, ARM_TWIST)] -= arm.stiffness / arm.inertia;
        a[(ARM_RATE, ARM_RATE)] -= arm.damping / arm.inertia;
    }
    let mut b = DMatrix::<f64>::zeros(order, 1);
    b[TORQUE] = 1.0 / model.servo_lag;
    (a, b)
}

/// The feedback with the least sum of squares of what is wanted small, as a share of the torque limit.
fn least_squares(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    wanted: &Quadratic<f64>,
    choice: &StateFeedback<f64>,
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
    if let DampedArm::Elastic(arm) = &choice.arm {
        q[(MOVED.len(), MOVED.len())] = square(arm.twist);
    }
    if choice.compensates_load < 0.5 {
        let integral = a.nrows() - 1;
        q[(integral, integral)] = square(wanted.angle * wanted.integral_time);
    }
    let r = DMatrix::from_element(1, 1, square(choice.torque_limit));
    let b = DMatrix::from_column_slice(b.len(), 1, b.as_slice());
    Ok(linear_quadratic_regulator(a, &b, &q, &r, None)?.gain.row(0).transpose())
}

/// The poles in z: drive and load together, the vibration at its own frequency, the arm at its own with the same damping,
/// the servo amplifier, the integral.
fn poles(wanted: &Poles<f64>, choice: &StateFeedback<f64>, model: &Model<f64>, dt: f64) -> Vec<Complex<f64>> {
    let drive = &model.drive;
    let mut poles = pair(wanted.bandwidth, wanted.damping, dt);
    poles.extend(pair(drive.vibration(), wanted.vibration_damping, dt));
    let real = |rate: f64| Complex::new(libm::exp(-rate * dt), 0.0);
    poles.push(real(1.0 / model.servo_lag));
    if let DampedArm::Elastic(arm) = &choice.arm {
        poles.extend(pair(arm.believed.angular_frequency(), wanted.vibration_damping, dt));
    }
    if choice.compensates_load < 0.5 {
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
/// reach. [`Error::NotSolvable`] where two observers that do not know each other let an arm swing up.
pub fn state_feedback(
    choice: &StateFeedback<f64>,
    model: &Model<f64>,
    dt: f64,
) -> Result<LinearController<f64>, Error> {
    let seen = SampledDrive::new(choice, model, dt)?;
    let gain = seen.observer(&choice.observer, model)?;
    let DampedArm::Elastic(arm) = &choice.arm else {
        let (k, integral_gain) = seen.regulator(choice, model, dt)?;
        return Ok(controller(&seen, &gain, &k, integral_gain, choice, model, dt));
    };
    let whole = SampledDrive::whole(choice, model, dt)?;
    let (k, integral_gain) = whole.regulator(choice, model, dt)?;
    let (seen, gain) = seen.with_arm(&gain, arm, dt)?;
    let controller = controller(&seen, &gain, &k, integral_gain, choice, model, dt);
    let slowest = whole.under(&controller).complex_eigenvalues().iter().map(|&pole| size(pole)).fold(0.0, f64::max);
    if slowest < 1.0 {
        return Ok(controller);
    }
    Err(Error::NotSolvable {
        what: "a state feedback whose two observers, of the drive and of the arm, hold the arm together",
        remedy: "Let the arm's twist be worth less (bench.controller.arm.twist), or the observer of the drive be faster \
                 (bench.controller.observer.load_torque).",
    })
}

/// The matrices of these gains.
fn controller(
    seen: &SampledDrive,
    l: &DMatrix<f64>,
    k: &DVector<f64>,
    integral_gain: f64,
    choice: &StateFeedback<f64>,
    model: &Model<f64>,
    dt: f64,
) -> LinearController<f64> {
    let SampledDrive { phi, gamma, .. } = seen;
    let order = phi.nrows();
    let mut kept = DMatrix::<f64>::identity(order, order);
    for (sensor, state) in [ANGLE, TACHO].into_iter().enumerate() {
        let mut column = kept.column_mut(state);
        column -= l.column(sensor);
    }
    let a = phi * kept;
    let mut b = DMatrix::zeros(order, INPUTS);
    b.view_mut((0, 0), (order, 2)).copy_from(&(phi * l));
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
    // Where the set-point will be, and what its acceleration asks for: of an arm, too, and its twist.
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
    // The friction that is compensated wants its twist and its torque.
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
    /// All that moves where this controller holds it, its torque a sample late: drive, controller, integral, torque in force.
    fn under(&self, controller: &LinearController<f64>) -> DMatrix<f64> {
        let n = self.phi.nrows();
        let (integral, torque) = (n + STATES, n + STATES + 1);
        let mut all = DMatrix::zeros(torque + 1, torque + 1);
        all.view_mut((0, 0), (n, n)).copy_from(&self.phi);
        all.view_mut((0, torque), (n, 1)).copy_from(&self.gamma);
        // A load that wanders is not held by anybody.
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
