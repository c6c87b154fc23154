//! The observer of the screw's velocity: its gains and its noise.

use nalgebra::{DMatrix, DVector};
use stickslip_core::control::VelocityObserver;

use super::drive_observer::{Trust, encoder_noise};
use super::{discrete_lyapunov, sampling_time, within};
use stickslip_base::Error;
use stickslip_base::preset::{DriveModelTrust, Model, ObserverChoice, Settings};

/// The observer with the poles of its error at −p_i [1/s], that is e^(−p_i·T), for a screw of this lead [m/rev] and a
/// sampling time `dt` [s].
///
/// In closed form with d_i = 1 − e^(−p_i·T), which keeps all digits at a short sampling time, and the elementary
/// symmetric polynomials e₁, e₂, e₃ of the d_i:
///
///   l_φ = e₁ − e₂ + e₃,   l_Ω = (e₂ − 3/2·e₃)/T,   l_a = −e₃/(i_h·T²)
///
/// Poles of one value damp best for a given noise; 250 1/s is a good start on a bench, 50 … 2000 1/s are usual.
pub fn velocity_observer(poles: [f64; 3], screw_lead: f64, dt: f64) -> Result<VelocityObserver<f64>, Error> {
    sampling_time(dt)?;
    within("the screw lead", screw_lead, "m", (1e-4, 1.0), "Give metres per revolution: 5 mm are 0.005.")?;
    for pole in poles {
        let remedy = "The decay rate must be positive and slower than the sampling.";
        within("the observer pole", pole, "1/s", (1e-3, 3.0 / dt), remedy)?;
    }
    let [a, b, c] = poles.map(|pole| -libm::expm1(-pole * dt));
    let (e1, e2, e3) = (a + b + c, a * b + b * c + c * a, a * b * c);
    let screw_ratio = std::f64::consts::TAU / screw_lead;
    Ok(VelocityObserver {
        screw_ratio,
        angle_gain: e1 - e2 + e3,
        velocity_gain: (e2 - 1.5 * e3) / dt,
        offset_gain: -e3 / (screw_ratio * dt * dt),
    })
}

/// Matrices of the observer's model: x⁺ = A·x + b·a, y = cᵀ·x, with x = (φ, Ω, a₀).
fn model(screw_ratio: f64, dt: f64) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
    let (step, jump) = (screw_ratio * dt, 0.5 * screw_ratio * dt * dt);
    let a = DMatrix::from_row_slice(3, 3, &[1.0, dt, -jump, 0.0, 1.0, -step, 0.0, 0.0, 1.0]);
    (a, DVector::from_column_slice(&[jump, step, 0.0]), DVector::from_column_slice(&[1.0, 0.0, 0.0]))
}

/// Standard deviation of the estimated velocity [rad/s]: from the encoder's counts per revolution, taken as uniform
/// noise of one count (white while the screw turns by a count a sample or more), and from the accelerometer's noise
/// [m/s² rms a sample, white].
///
/// P = F·P·Fᵀ + G·R_a·Gᵀ + L·R_y·Lᵀ with F = (I − L·c)·A, G = (I − L·c)·b. Compare it with a fade-out velocity.
pub fn velocity_noise(
    gains: &VelocityObserver<f64>,
    encoder_counts: f64,
    accelerometer_noise: f64,
    dt: f64,
) -> Result<f64, Error> {
    sampling_time(dt)?;
    within("the encoder", encoder_counts, "counts", (4.0, 1e9), "Count all four edges of a line, per revolution.")?;
    within("the accelerometer noise", accelerometer_noise, "m/s^2", (0.0, 1e3), "Give the rms of a sample.")?;
    let (a, b, c) = model(gains.screw_ratio, dt);
    let correction = DVector::from_column_slice(&[gains.angle_gain, gains.velocity_gain, gains.offset_gain]);
    let uncorrected = DMatrix::identity(3, 3) - &correction * c.transpose();
    let count = std::f64::consts::TAU / encoder_counts;
    let pushed = &uncorrected * b * accelerometer_noise;
    let pulled = correction * (count / 12f64.sqrt());
    let covariance =
        discrete_lyapunov(&(uncorrected * a), &(&pushed * pushed.transpose() + &pulled * pulled.transpose()))?;
    Ok(covariance[(1, 1)].sqrt())
}

/// Standard deviation of the estimated velocity [rad/s] by the bench's observer, from the data sheet. A model of the
/// drive is taken as exact.
///
/// # Errors
/// As [`velocity_observer`] and [`velocity_noise`].
pub fn predicted_velocity_noise(model: &Model<f64>, settings: &Settings<f64>) -> Result<f64, Error> {
    let dt = settings.tick_time();
    if let ObserverChoice::Model(DriveModelTrust { missing_torque }) = settings.observer {
        return encoder_noise(model, dt, &Trust { missing_torque, ..Trust::default() });
    }
    let gains = velocity_observer(settings.observer_poles, model.drive.screw_lead, dt)?;
    // One-sided density over half the tick rate.
    let acceleration = model.accelerometer_noise * libm::sqrt(0.5 / dt);
    velocity_noise(&gains, model.encoder.counts_per_revolution, acceleration, dt)
}
