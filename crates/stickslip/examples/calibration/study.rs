//! One calibration of a machine drawn at random, compared with the true machine.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use stickslip::bench::VirtualBench;
use stickslip::calibrate::{Calibration, CalibrationPlan, calibrate};
use stickslip::experiment::{FrictionCurve, home};
use stickslip::fit::{CurvePoint, fit_stribeck};
use stickslip::noise::Normals;
use stickslip::{Error, Preset, Watch, parameters, true_friction};
use stickslip_core::friction::{Friction, Model};

/// The benches, and how many machines the study draws about each.
#[allow(dead_code, reason = "the test uses some machines only")]
pub(crate) const PRESETS: [(&str, u64); 2] = [("prototype", 100), ("clm-bench", 40)];

/// A number drawn evenly from −1 … 1, one for each channel of a seed.
fn even(seed: u64, channel: u32) -> f64 {
    libm::erf(FRAC_1_SQRT_2 * Normals::new(seed).pair(channel, 0)[0])
}

/// A preset whose machine is drawn at random about its data sheet, whose values remain in the software.
pub(crate) fn machine(name: &str, seed: u64) -> Result<Preset<f64>, Error> {
    let mut preset: Preset<f64> = parameters::presets::find(name)?.read()?;
    let plant = &mut preset.plant;
    let mut channel = 100;
    let mut draw = || {
        channel += 1;
        even(seed, channel)
    };
    plant.servo.torque_per_volt *= 1.0 + 0.05 * draw();
    plant.servo.lag *= 1.0 + 0.5 * draw();
    plant.drive.motor_inertia *= 1.0 + 0.2 * draw();
    plant.drive.load_inertia *= 1.0 + 0.2 * draw();
    plant.drive.coupling_stiffness *= 1.0 + 0.2 * draw();
    plant.drive.coupling_damping *= 1.0 + 0.5 * draw();
    plant.load_motor.winding.torque_constant *= 1.0 + 0.05 * draw();
    plant.load_motor.winding.resistance *= 1.0 + 0.2 * draw();
    plant.load_motor.winding.inductance *= 1.0 + 0.2 * draw();
    // Ripple of a typical commutator.
    plant.tacho.ripple = 0.01;
    plant.tacho.bandwidth /= 1.0 + 0.5 * draw();
    plant.tacho.constant *= 1.0 + 0.02 * draw();
    plant.accelerometer.sensitivity *= 1.0 + 0.02 * draw();
    plant.accelerometer.offset = 0.5 * draw();
    plant.current_sensor.offset = 0.05 * draw();
    let factors: [f64; 6] = std::array::from_fn(|_| 1.0 + 0.2 * draw());
    scale(&mut plant.screw_friction, factors);
    scale(&mut plant.wheel.friction, factors);
    Ok(preset)
}

fn scale(friction: &mut Friction<f64>, [breakaway, kinetic, velocity, viscous, stiffness, damping]: [f64; 6]) {
    if let Model::ElastoPlastic(model) = &mut friction.model {
        let lugre = &mut model.lugre;
        lugre.sliding.kinetic_torque *= kinetic;
        // Never without a drop.
        lugre.sliding.breakaway_torque =
            (lugre.sliding.breakaway_torque * breakaway).max(1.02 * lugre.sliding.kinetic_torque);
        lugre.sliding.stribeck_velocity *= velocity;
        lugre.sliding.viscous_friction *= viscous;
        lugre.bristle_stiffness *= stiffness;
        lugre.bristle_damping *= damping;
    }
}

/// True value of the machine for a result; `None` for a number without a counterpart in the machine.
pub(crate) fn true_value(preset: &Preset<f64>, calibration: &Calibration, key: &str) -> Result<Option<f64>, Error> {
    let plant = &preset.plant;
    let bristles = |friction: &Friction<f64>| match friction.model {
        Model::ElastoPlastic(model) => [model.lugre.bristle_stiffness, model.lugre.bristle_damping],
        _ => [0.0; 2],
    };
    let viscous =
        |friction: &Friction<f64>| friction.steady_torque(101.0, 0.0, 0.0) - friction.steady_torque(100.0, 0.0, 0.0);
    let [screw, wheel] = [&plant.screw_friction, &plant.wheel.friction];
    let both = |value: &dyn Fn(&Friction<f64>) -> f64| value(screw) + plant.wheel.preload * value(wheel);
    let own = |index: usize| -> Result<f64, Error> {
        let measured = calibration.curve.points().into_iter();
        let true_points: Vec<CurvePoint> = measured
            .map(|point| CurvePoint { torque: true_friction::own_friction(plant, point.velocity), ..point })
            .collect();
        Ok(fit_stribeck(&true_points, &FrictionCurve::FIT)?.parameters[index])
    };
    Ok(Some(match key {
        "torque_per_volt" => plant.servo.torque_per_volt,
        "motor_inertia" => plant.drive.motor_inertia,
        "load_inertia" => plant.drive.load_inertia,
        "coupling_stiffness" => plant.drive.coupling_stiffness,
        "coupling_damping" => plant.drive.coupling_damping,
        "servo_lag" => plant.servo.lag,
        "tacho" => plant.tacho.constant,
        "tacho_lag" => 1.0 / (TAU * plant.tacho.bandwidth),
        "accelerometer" => plant.accelerometer.sensitivity,
        "accelerometer_frequency" => TAU * plant.accelerometer.bandwidth,
        "accelerometer_damping" => plant.accelerometer.damping,
        "accelerometer_offset" => plant.accelerometer.offset,
        "torque_constant" => plant.load_motor.winding.torque_constant,
        "resistance" => plant.load_motor.winding.resistance,
        "inductance" => plant.load_motor.winding.inductance,
        "current_offset" => plant.current_sensor.offset,
        "drive_lag" => plant.servo.lag + 1.0 / (TAU * plant.tacho.bandwidth),
        "sliding_slope" => both(&viscous),
        "bristle_stiffness" => both(&|friction| bristles(friction)[0]),
        "bristle_damping" => both(&|friction| bristles(friction)[1]),
        "breakaway_torque" => own(0)?,
        "kinetic_torque" => own(1)?,
        "stribeck_velocity" => own(2)?,
        "viscous_friction" => own(3)?,
        _ => return Ok(None),
    }))
}

/// Homes a machine drawn at random, with steps short enough to be that of its equations, and calibrates it.
pub(crate) fn experiment(name: &str, seed: u64) -> Result<(Preset<f64>, Calibration), Error> {
    let mut preset = machine(name, seed)?;
    preset.bench.plant_step = 1e-5;
    let mut bench = VirtualBench::in_short_steps(&preset, seed)?;
    home(&mut bench, &Watch::silent())?;
    let calibration = calibrate(&CalibrationPlan::default(), &mut bench, &Watch::silent())?;
    Ok((preset, calibration))
}

/// One number of one experiment compared with its true value.
#[allow(dead_code, reason = "the test does not score all of it")]
pub(crate) struct Score {
    pub(crate) key: &'static str,
    pub(crate) value: f64,
    pub(crate) truth: f64,
    pub(crate) error: f64,
    /// Half of the 95 % interval.
    pub(crate) half: f64,
}

/// All numbers of a calibration with a known true value.
pub(crate) fn scores(preset: &Preset<f64>, calibration: &Calibration) -> Result<Vec<Score>, Error> {
    let mut scores = Vec::new();
    for number in &calibration.values {
        if let Some(truth) = true_value(preset, calibration, number.key)? {
            // Intervals of the friction curve are not symmetric: the side of the true value is relevant.
            let half = if truth < number.value { number.value - number.ci95[0] } else { number.ci95[1] - number.value };
            scores.push(Score { key: number.key, value: number.value, truth, error: number.value - truth, half });
        }
    }
    Ok(scores)
}
