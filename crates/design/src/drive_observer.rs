//! The observer with the drive's model inside: its step, and its gains by a stationary Kalman filter.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use nalgebra::DMatrix;
use stickslip_core::drive::{Delay, TwoMass, Winding};
use stickslip_core::estimate::{AccelerationSensor, DriveModel, DriveObserver, MotionObserver, ObserverGains};
use stickslip_core::friction::Friction;

use super::{discrete_lyapunov, kalman_filter, velocity_observer, zero_order_hold};
use stickslip_base::Error;
use stickslip_base::preset::{DriveModelTrust, Model, ObserverChoice, Settings, delay};

/// Uncertainty of the model, as white noise on its rates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// Rate of change of the torque that the model lacks [N m/√s].
    pub missing_torque: f64,
    /// Torque noise of the drive motor [N m/√Hz].
    pub motor_torque: f64,
    /// Rate of change of the accelerometer's offset [m/s²/√s].
    pub offset: f64,
}

impl Default for Trust {
    fn default() -> Self {
        Trust { missing_torque: 0.03, motor_torque: 1e-4, offset: 1e-3 }
    }
}

/// Design speed of the gains for high speed [rad/s].
const FAST: f64 = 30.0;

/// Longest step of the observer's model [s], for rendering and for the compensation of friction in position control.
/// The latter requires less accuracy, but at least two steps in a sample: with one, the deviation of a sine of 2 Hz at
/// 4 kHz is half as large again.
const LONGEST_STEP: f64 = 125e-6;
const LONGEST_FOR_CONTROL: f64 = 250e-6;

/// Noise of a reading [V RMS]: a converter of 16 bits over ±10 V with one step of noise, and its own rounding.
pub(super) const CONVERTER_NOISE: f64 = 20.0 / 65536.0 * 1.04;

/// Order of the states of the linear filter.
const STATES: usize = 9;

/// Sensors that correct an observer.
#[derive(Clone, Copy)]
enum Sensors {
    Encoder,
    EncoderAndTacho,
    All,
}

impl Sensors {
    /// Those of a bench.
    fn of(settings: &Settings<f64>) -> Self {
        match settings.observer {
            ObserverChoice::Accelerometer => Sensors::All,
            ObserverChoice::Model(_) => Sensors::Encoder,
        }
    }

    /// Number of rows of the output matrix.
    fn outputs(self) -> usize {
        match self {
            Sensors::Encoder => 1,
            Sensors::EncoderAndTacho => 2,
            Sensors::All => 3,
        }
    }

    /// States that they make observable.
    fn states(self) -> &'static [usize] {
        match self {
            Sensors::Encoder => &[0, 1, 2, 3, 4],
            Sensors::EncoderAndTacho => &[0, 1, 2, 3, 4, 6],
            Sensors::All => &[0, 1, 2, 3, 4, 5, 6, 7, 8],
        }
    }
}

/// The observer of the modelled drive.
///
/// # Errors
/// As the design functions.
pub fn drive_observer(
    model: &Model<f64>,
    settings: &Settings<f64>,
    trust: &Trust,
) -> Result<DriveObserver<f64>, Error> {
    let model = &settings.model_with_amplifier(model);
    corrected_drive(model, (settings.tick_time(), LONGEST_STEP), trust, Sensors::of(settings))
}

/// The observer of the bench's velocities.
///
/// # Errors
/// As the design functions.
pub fn motion_observer(model: &Model<f64>, settings: &Settings<f64>) -> Result<MotionObserver<f64>, Error> {
    Ok(match settings.observer {
        ObserverChoice::Accelerometer => {
            let poles = settings.observer_poles;
            MotionObserver::Accelerometer(velocity_observer(poles, model.drive.screw_lead, settings.tick_time())?)
        }
        ObserverChoice::Model(DriveModelTrust { missing_torque }) => {
            MotionObserver::Model(drive_observer(model, settings, &Trust { missing_torque, ..Trust::default() })?)
        }
    })
}

/// The observer sampled at the rate of the position controller by encoder and tacho, if the bench has one, of a load
/// with this friction and without load motor.
///
/// # Errors
/// As the design functions.
pub(super) fn unloaded_drive(
    model: &Model<f64>,
    friction: Friction<f64>,
    settings: &Settings<f64>,
    trust: &Trust,
) -> Result<DriveObserver<f64>, Error> {
    let sensors = match Sensors::of(settings) {
        Sensors::All => Sensors::EncoderAndTacho,
        fewer => fewer,
    };
    let dt = settings.control_period();
    let mut observer = corrected_drive(model, (dt, LONGEST_FOR_CONTROL.min(0.5 * dt)), trust, sensors)?;
    observer.model = without_load_motor(model, friction, dt / observer.steps as f64);
    observer.gains.current = 0.0;
    observer.fast_gains.current = 0.0;
    Ok(observer)
}

/// The same without any correction, in steps of at most `longest` [s]: the modelled drive itself.
pub(super) fn simulated_drive(
    model: &Model<f64>,
    friction: Friction<f64>,
    dt: f64,
    longest: f64,
) -> Result<DriveObserver<f64>, Error> {
    let steps = steps_within(dt, longest);
    let step = dt / steps as f64;
    let observer = modelled_drive(model, step)?;
    let model_without = without_load_motor(model, friction, step);
    Ok(DriveObserver { steps, motor_delay: motor_delay(model, dt)?, model: model_without, ..observer })
}

/// The delay of the drive motor's torque in samples of `dt` [s].
fn motor_delay(model: &Model<f64>, dt: f64) -> Result<Delay<f64>, Error> {
    delay("delay of the servo amplifier in the model", model.servo_delay, dt)
}

/// The delay of the load motor's command in samples of `dt` [s].
pub(super) fn load_delay(model: &Model<f64>, dt: f64) -> Result<Delay<f64>, Error> {
    delay("delay of the load amplifier in the model", model.load_amplifier.delay, dt)
}

/// The modelled drive with this friction on the load, in steps of this length [s], without current in the load motor.
fn without_load_motor(model: &Model<f64>, friction: Friction<f64>, step: f64) -> DriveModel<f64> {
    let winding = Winding { torque_constant: 0.0, ..model.load_motor };
    DriveModel::new(model.drive, winding, model.servo_lag, model.motor_friction, friction, step)
}

/// Number of steps of at most `longest` in `dt` [s].
fn steps_within(dt: f64, longest: f64) -> usize {
    (dt / longest - 1e-9).ceil().max(1.0) as usize
}

/// The observer of the drive, corrected by these sensors, sampled with `dt` in steps of at most `longest` [s].
fn corrected_drive(
    model: &Model<f64>,
    (dt, longest): (f64, f64),
    trust: &Trust,
    sensors: Sensors,
) -> Result<DriveObserver<f64>, Error> {
    let steps = steps_within(dt, longest);
    let observer = modelled_drive(model, dt / steps as f64)?;
    let linear = Linear::new(model, dt, trust)?;
    let [gains, fast_gains] = [0.0, FAST].map(|speed| linear.gains(model, speed, sensors));
    // The speed at which the ripple is as large as the tacho's error at standstill; without ripple both sets are equal.
    let ripple_velocity = (slow_tacho(model) / model.tacho_ripple).min(1e6);
    Ok(DriveObserver {
        steps,
        motor_delay: motor_delay(model, dt)?,
        load_delay: load_delay(model, dt)?,
        gains: gains?,
        fast_gains: fast_gains?,
        ripple_velocity,
        ..observer
    })
}

/// Lag of the tacho, the rest of the common lag after the servo amplifier [s].
pub(super) fn tacho_lag(model: &Model<f64>) -> f64 {
    (model.drive_lag - model.servo_lag).max(1e-6)
}

/// The modelled drive and its pickups, in steps of this length [s], without correction and without delays.
pub fn modelled_drive(model: &Model<f64>, step: f64) -> Result<DriveObserver<f64>, Error> {
    let own = model.own_bristles.under(model.own);
    let prepared = DriveModel::new(model.drive, model.load_motor, model.servo_lag, model.motor_friction, own, step);
    let omega = TAU * model.accelerometer_bandwidth;
    let damping = 2.0 * model.accelerometer_damping * omega;
    let a = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, -omega * omega, -damping]);
    let (phi, gamma) = zero_order_hold(&a, &DMatrix::from_row_slice(2, 1, &[0.0, omega * omega]), step)?;
    let row = |i: usize| [phi[(i, 0)], phi[(i, 1)], gamma[(i, 0)]];
    Ok(DriveObserver {
        model: prepared,
        steps: 1,
        motor_delay: Delay::default(),
        load_delay: Delay::default(),
        tacho_share: 1.0 - libm::exp(-step / tacho_lag(model)),
        accelerometer: AccelerationSensor { carriage_ratio: model.drive.carriage_ratio(), flow: [row(0), row(1)] },
        gains: ObserverGains { current: 0.0, ..ObserverGains::default() },
        fast_gains: ObserverGains { current: 0.0, ..ObserverGains::default() },
        ripple_velocity: 1.0,
    })
}

/// Deviation of the encoder's counts while the screw turns [rad].
fn count_noise(model: &Model<f64>) -> f64 {
    TAU / model.encoder.counts_per_revolution / 12f64.sqrt()
}

/// Corrections by the encoder of the states that it makes observable.
fn encoder_gain(gains: &ObserverGains<f64>) -> DMatrix<f64> {
    let rows = [gains.angle, gains.twist, gains.motor_velocity, gains.velocity, gains.torque];
    DMatrix::from_fn(rows.len(), 1, |row, _| rows[row][0])
}

/// Standard deviation of the velocity of the screw by encoder and exact model alone [rad/s].
///
/// P = F·P·Fᵀ + K·R·Kᵀ with F = (I − K·C)·Φ.
///
/// # Errors
/// As the design functions.
pub(super) fn encoder_noise(model: &Model<f64>, dt: f64, trust: &Trust) -> Result<f64, Error> {
    let linear = Linear::new(model, dt, trust)?;
    let gains = linear.gains(model, 0.0, Sensors::Encoder)?;
    let gain = encoder_gain(&gains);
    let Linear { phi, outputs, .. } = linear.part(Sensors::Encoder);
    let uncorrected = DMatrix::identity(gain.nrows(), gain.nrows()) - &gain * outputs;
    let pulled = gain * count_noise(model);
    let covariance = discrete_lyapunov(&(uncorrected * phi), &(&pulled * pulled.transpose()))?;
    Ok(covariance[(VELOCITY, VELOCITY)].sqrt())
}

/// Deviation of the tacho's readings at standstill [rad/s].
pub(super) fn slow_tacho(model: &Model<f64>) -> f64 {
    libm::hypot(model.tacho_noise, CONVERTER_NOISE) / model.scaling.tacho
}

/// Order of the states of the drive's masses: φ, δ, Ω_M, Ω.
pub(super) const MOTION: usize = 4;
/// Place of Ω among them.
const VELOCITY: usize = 3;

/// The rates of angle, twist, motor velocity and velocity from these four; torques are added.
pub(super) fn motion(drive: &TwoMass<f64>) -> DMatrix<f64> {
    let (c, d) = (drive.coupling_stiffness, drive.coupling_damping);
    let (per_motor, per_load) = (1.0 / drive.motor_inertia, 1.0 / drive.load_inertia);
    let mut a = DMatrix::<f64>::zeros(MOTION, MOTION);
    a[(0, 3)] = 1.0;
    (a[(1, 2)], a[(1, 3)]) = (1.0, -1.0);
    (a[(2, 1)], a[(2, 2)], a[(2, 3)]) = (-c * per_motor, -d * per_motor, d * per_motor);
    (a[(3, 1)], a[(3, 2)], a[(3, 3)]) = (c * per_load, d * per_load, -d * per_load);
    a
}

/// Covariance of the states after `dt` [s] by white noise of these densities on the rates.
pub(super) fn sampled_noise(a: &DMatrix<f64>, density: &DMatrix<f64>, dt: f64) -> Result<DMatrix<f64>, Error> {
    let nothing = DMatrix::zeros(a.nrows(), 1);
    let (whole, half) = (zero_order_hold(a, &nothing, dt)?.0, zero_order_hold(a, &nothing, 0.5 * dt)?.0);
    // Simpson's rule of ∫ e^(A·s)·N·e^(Aᵀ·s) ds.
    Ok((density + 4.0 * &half * density * half.transpose() + &whole * density * whole.transpose()) * (dt / 6.0))
}

/// The linear drive over a tick: φ, δ, Ω_M, Ω, missing torque, offset, tacho, accelerometer value and rate.
struct Linear {
    /// System matrix.
    phi: DMatrix<f64>,
    /// Output matrix of encoder, tacho and accelerometer.
    outputs: DMatrix<f64>,
    /// Covariance of the process noise.
    q: DMatrix<f64>,
}

impl Linear {
    fn new(model: &Model<f64>, dt: f64, trust: &Trust) -> Result<Self, Error> {
        let drive = &model.drive;
        let omega = TAU * model.accelerometer_bandwidth;
        let ratio = drive.carriage_ratio();
        let tacho_lag = tacho_lag(model);
        let mut a = DMatrix::<f64>::zeros(STATES, STATES);
        a.view_mut((0, 0), (MOTION, MOTION)).copy_from(&motion(drive));
        a[(3, 4)] = -1.0 / drive.load_inertia;
        (a[(6, 2)], a[(6, 6)]) = (1.0 / tacho_lag, -1.0 / tacho_lag);
        a[(7, 8)] = 1.0;
        // The sensor measures the load's acceleration: its row of the rates.
        for column in 0..STATES {
            a[(8, column)] = omega * omega * ratio * a[(3, column)];
        }
        a[(8, 7)] -= omega * omega;
        a[(8, 8)] -= 2.0 * model.accelerometer_damping * omega;

        let mut noise = DMatrix::<f64>::zeros(STATES, STATES);
        noise[(2, 2)] = (trust.motor_torque / drive.motor_inertia).powi(2);
        noise[(4, 4)] = trust.missing_torque.powi(2);
        noise[(5, 5)] = trust.offset.powi(2);
        // One-sided density S: white noise of S²/2.
        noise[(8, 8)] = 0.5 * (omega * omega * model.accelerometer_noise).powi(2);
        let (phi, _) = zero_order_hold(&a, &DMatrix::zeros(STATES, 1), dt)?;
        let q = sampled_noise(&a, &noise, dt)?;

        let mut outputs = DMatrix::<f64>::zeros(3, STATES);
        outputs[(0, 0)] = 1.0;
        outputs[(1, 6)] = 1.0;
        (outputs[(2, 5)], outputs[(2, 7)]) = (1.0, 1.0);
        Ok(Linear { phi, outputs, q })
    }

    /// The part with the states and outputs of these sensors.
    fn part(&self, sensors: Sensors) -> Linear {
        let states = sensors.states();
        let among = |matrix: &DMatrix<f64>| matrix.select_rows(states).select_columns(states);
        Linear {
            phi: among(&self.phi),
            outputs: self.outputs.rows(0, sensors.outputs()).select_columns(states),
            q: among(&self.q),
        }
    }

    /// Gains of the stationary filter for these sensors at a speed [rad/s]; 0 for the other sensors and states.
    fn gains(&self, model: &Model<f64>, speed: f64, sensors: Sensors) -> Result<ObserverGains<f64>, Error> {
        let states = sensors.states();
        let deviations = [
            count_noise(model),
            libm::hypot(slow_tacho(model), model.tacho_ripple * speed * FRAC_1_SQRT_2),
            CONVERTER_NOISE / model.scaling.accelerometer,
        ];
        let variances = deviations[..sensors.outputs()].iter().map(|deviation| deviation * deviation);
        let r = DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(sensors.outputs(), variances));
        let part = self.part(sensors);
        let filter = kalman_filter(&part.phi, &part.outputs, &part.q, &r)?;
        let row = |state: usize| {
            let place = states.iter().position(|&other| other == state);
            std::array::from_fn(|sensor| place.and_then(|row| filter.gain.get((row, sensor))).copied().unwrap_or(0.0))
        };
        Ok(ObserverGains {
            angle: row(0),
            twist: row(1),
            motor_velocity: row(2),
            velocity: row(3),
            torque: row(4),
            offset: row(5),
            tacho: row(6),
            acceleration: row(7),
            acceleration_rate: row(8),
            current: 0.3,
        })
    }
}

#[cfg(test)]
mod tests;
