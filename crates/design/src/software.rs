//! The software of the bench for a model of the machine.

use stickslip_core::control::CurrentControl;
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{Correction, DifferenceTorque, Law};
use stickslip_core::tick::Tick;
use stickslip_software::cycle::Parameters;
use stickslip_software::supervise::Brake;

use super::drive_observer::load_delay;
use super::{arm_rendering, axis_control, current_control, motion_observer, predictive_current_control, velocity_gain};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// Share of a current's deviation corrected in a sample.
const SHARE: f64 = 0.7;

/// The software for the model of the machine and the settings of the bench; the rendering law is off.
///
/// # Errors
/// Errors of [`motion_observer`], [`current_control`] and [`arm_rendering`].
pub fn software(model: &Model<f64>, settings: &Settings<f64>) -> Result<Tick<f64>, Error> {
    Ok(Tick {
        scaling: model.scaling,
        decoder: model.encoder,
        observer: motion_observer(model, settings)?,
        law: Law::Off,
        correction: Correction::Nothing,
        arm: arm_rendering(model, settings)?,
        current: load_current_control(&Law::Off, model, settings)?,
        control: axis_control(model, settings)?,
        control_period: settings.control_period(),
    })
}

/// All parameters of the software for the model of the machine and the settings of the bench; the rendering law is off.
///
/// # Errors
/// As [`software`] and [`brake`].
pub fn parameters(model: &Model<f64>, settings: &Settings<f64>) -> Result<Parameters<f64>, Error> {
    Ok(Parameters {
        tick: software(model, settings)?,
        safety: settings.safety,
        brake: brake(model, settings)?,
        drive_torque_constant: model.motor.torque_constant,
        load_delay: load_delay(model, settings.tick_time())?,
    })
}

/// The brake of supervision, as stiff at the tacho as the control of a constant speed without its notch. The encoder is
/// behind the coupling: there the loop crosses at a tenth of the coupling's resonance, whose peak then stays below 1 down
/// to a damping of 5 %.
///
/// # Errors
/// Errors of a sampling time.
pub fn brake(model: &Model<f64>, settings: &Settings<f64>) -> Result<Brake<f64>, Error> {
    let Model { drive, scaling, .. } = model;
    let tacho_gain = velocity_gain(model, settings.tick_time());
    let resonance = drive.vibration();
    Ok(Brake {
        inertia: drive.inertia(),
        tacho_gain,
        encoder_gain: tacho_gain.min(0.1 * drive.inertia() * resonance),
        torque_limit: scaling.servo_limit * scaling.torque_per_volt,
    })
}

/// Current control of the load motor under a law: predictive where the law's observer predicts the current, else PI. An
/// amplifier that takes a torque has its own: its input is the reference of the current, 1 V for 1 A.
///
/// # Errors
/// Errors of [`current_control`].
pub fn load_current_control(
    law: &Law<f64>,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> Result<CurrentControl<f64>, Error> {
    let Model { load_motor: winding, load_amplifier: amplifier, .. } = settings.model_with_amplifier(model);
    let dt = settings.tick_time();
    let base = CurrentControl {
        torque_constant: winding.torque_constant,
        current_limit: amplifier.current_limit,
        voltage_limit: amplifier.supply_voltage,
        amplifier_gain: amplifier.gain,
        ..CurrentControl::default()
    };
    if settings.torque_amplifier > 0.5 {
        // u = K_p·(i_ref − i) + R·i with K_p = R: the reference itself.
        return Ok(CurrentControl {
            proportional_gain: winding.resistance,
            resistance: winding.resistance,
            integral_gain: 0.0,
            converter_limit: amplifier.current_limit,
            ..base
        });
    }
    match law {
        Law::Bristle(_) | Law::Admittance(_) => {
            predictive_current_control(base, winding.resistance, winding.inductance, SHARE, dt)
        }
        Law::Off | Law::Paper(_) | Law::Smooth(_) | Law::Karnopp(_) => {
            current_control(base, winding.resistance, winding.inductance, dt)
        }
    }
}

/// The paper's law for this desired characteristic, up to the torque of the load motor's largest current.
pub fn difference_torque(
    desired: &Stribeck<f64>,
    model: &Model<f64>,
    settings: &Settings<f64>,
) -> DifferenceTorque<f64> {
    DifferenceTorque {
        desired: *desired,
        own: model.own,
        fade_velocity: settings.fade_velocity,
        torque_limit: model.load_amplifier.current_limit * model.load_motor.torque_constant,
    }
}
