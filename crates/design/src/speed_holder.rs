//! The controller that holds a constant speed for a measurement.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use stickslip_core::control::{AxisControl, Cascade, PositionController, TorqueFilter};

use super::{notch, sampling_time};
use stickslip_base::Error;
use stickslip_base::preset::Model;

/// Largest gain of the velocity loop at the peak of the coupling's resonance, if its phase there exceeds 90°.
const PEAK: f64 = 0.7;
/// Damping ratios of the notch's zeros and poles: wide, since the resonance may be known poorly.
const NOTCH: [f64; 2] = [0.1, 1.0];
/// Its gain for a resonance that is 30 % off.
const BESIDE: f64 = 0.36;
/// Least damping of the coupling's vibration: friction damps it, too.
const DAMPING: f64 = 0.02;

/// P-PI cascade that holds a constant speed for a friction measurement, with this torque limit [N m], sampled with `dt`
/// [s].
///
/// As stiff as half the phase of its delays permits: the velocity loop crosses at K_v/J_M = (π/4)/(1.5·T + τ), with the
/// sampling time T and the lag τ of servo amplifier and tacho, delay included. Above the coupling's resonance only the
/// motor's inertia J_M counts. Integral action at 20 1/s, position loop at 15 1/s: fast enough to settle in 0.3 s.
///
/// Drives that act so late that the phase at the resonance exceeds 90° would excite it. Then a notch attenuates it, the
/// loop crosses below it, at K_v/J, and the outer loops are at most a third as fast.
///
/// # Errors
/// Errors of a sampling time.
pub fn speed_holder(torque_limit: f64, model: &Model<f64>, dt: f64) -> Result<AxisControl<f64>, Error> {
    sampling_time(dt)?;
    let (drive, inertia) = (&model.drive, model.drive.inertia());
    let resonance = drive.vibration();
    let (velocity_gain, filter) = if is_late(model, dt) {
        let [depth, width] = NOTCH;
        let delay = delay(model, dt) + 2.0 * width / resonance;
        let gain = (inertia * FRAC_PI_4 / delay).min(largest_gain(model) / BESIDE);
        (gain, TorqueFilter::Notch(notch(resonance, [depth, width], torque_limit, dt)))
    } else {
        (stiffest(model, dt), TorqueFilter::Nothing)
    };
    let third = velocity_gain / inertia / 3.0;
    let cascade = Cascade {
        position_gain: third.min(15.0),
        velocity_gain,
        integral_gain: third.min(20.0) * velocity_gain,
        inertia,
        torque_limit,
    };
    Ok(AxisControl { filter, ..PositionController::Cascade(cascade).into() })
}

/// Gain of a velocity loop at the tacho without a notch [N m s/rad].
pub(crate) fn velocity_gain(model: &Model<f64>, dt: f64) -> f64 {
    let stiffest = stiffest(model, dt);
    if is_late(model, dt) { stiffest.min(largest_gain(model)) } else { stiffest }
}

/// Delay of a velocity loop [s].
fn delay(model: &Model<f64>, dt: f64) -> f64 {
    1.5 * dt + model.loop_lag()
}

fn is_late(model: &Model<f64>, dt: f64) -> bool {
    model.drive.vibration() * delay(model, dt) > FRAC_PI_2
}

fn stiffest(model: &Model<f64>, dt: f64) -> f64 {
    model.drive.motor_inertia * FRAC_PI_4 / delay(model, dt)
}

/// Gain that has [`PEAK`] at the resonance, whose peak from the motor's torque to its velocity is (J_L/J)²/d.
fn largest_gain(model: &Model<f64>) -> f64 {
    let drive = &model.drive;
    let reduced = drive.motor_inertia * drive.load_inertia / drive.inertia();
    let damping = drive.coupling_damping.max(2.0 * DAMPING * drive.vibration() * reduced);
    PEAK * damping * (drive.inertia() / drive.load_inertia).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{Operating, axis, port};
    use nalgebra::Complex;
    use stickslip_base::Preset;
    use stickslip_base::parameters::presets;

    #[test]
    fn late_drives_do_not_excite_the_coupling() {
        for late in [0.0, 0.5e-3, 3e-3, 6e-3] {
            let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
            (preset.bench.tick_rate, preset.bench.torque_amplifier) = (1000.0, 1.0);
            preset.model.servo_delay = late;
            let holder = speed_holder(1.0, &preset.model, 1e-3).unwrap();
            let PositionController::Cascade(cascade) = holder.controller else { panic!("{holder:?}") };
            assert_eq!(matches!(holder.filter, TorqueFilter::Notch(_)), late > 1e-3, "{late} s");
            // The loop gain at the resonance, from the axis that the design has.
            let axis = axis(&preset.model, &preset.bench, Operating::Sliding(10.0)).unwrap();
            let tacho = axis.channel(port::TORQUE, port::TACHO).unwrap();
            let resonance = preset.model.drive.vibration();
            let peak = (70..130)
                .map(|share| {
                    let omega = 0.01 * f64::from(share) * resonance;
                    let gain = magnitude(tacho.at(on_circle(omega)).unwrap()[(0, 0)]);
                    cascade.velocity_gain * gain * filtered(&holder.filter, omega)
                })
                .fold(0.0, f64::max);
            assert!(late < 1e-3 || peak < 1.0, "{late} s: {peak}");
        }
    }

    /// Gain of the filter at a frequency [rad/s], sampled with a millisecond.
    fn filtered(filter: &TorqueFilter<f64>, omega: f64) -> f64 {
        let TorqueFilter::Notch(notch) = filter else { return 1.0 };
        let z = on_circle(-omega);
        let [b0, b1, b2] = notch.numerator;
        let [a1, a2] = notch.denominator;
        magnitude((z * z * b2 + z * b1 + b0) / (z * z * a2 + z * a1 + 1.0))
    }

    /// e^(jω·1 ms).
    fn on_circle(omega: f64) -> Complex<f64> {
        let (sin, cos) = libm::sincos(omega * 1e-3);
        Complex::new(cos, sin)
    }

    fn magnitude(z: Complex<f64>) -> f64 {
        libm::hypot(z.re, z.im)
    }
}
