//! Drives that take a torque and act late, as on a fieldbus: delays are identified, and laws and loops allow for them.

use stickslip::bench::{Bench as _, Command, VirtualBench};
use stickslip::calibrate::{CalibrationPlan, calibrate};
use stickslip::experiment::{PreslidingPlan, home, measure_presliding};
use stickslip::simulation::{Simulation, simulate};
use stickslip::workflow::calibrate::CalibrationRun;
use stickslip::{ControllerChoice, Error, FilterChoice, LawChoice, NotchChoice, Preset, Residual, Watch, parameters};
use stickslip_core::control::Cascade;
use stickslip_core::control::reference::{Generator, Reference, Setpoint, Sine};

/// Delays of drive motor and load motor [s].
const LATE: [f64; 2] = [2.4e-3, 3.0e-3];

/// A preset at 1 kHz with drives that take a torque; the model assumes these delays.
fn fieldbus(name: &str, assumed: [f64; 2]) -> Preset<f64> {
    let source = parameters::presets::find(name).expect("a preset");
    let mut preset: Preset<f64> = source.read().expect("a sound one");
    (preset.bench.tick_rate, preset.bench.torque_amplifier) = (1000.0, 1.0);
    // Delays reduce the margins of a controller: a third of its gains, and a notch at the resonance of the coupling.
    let ControllerChoice::Cascade(cascade) = &mut preset.bench.controller else { panic!("a cascade") };
    (cascade.position_gain, cascade.velocity_gain, cascade.integral_gain) = (5.0, 0.05, 1.0);
    preset.bench.filter = FilterChoice::Notch(NotchChoice::default());
    [preset.plant.servo.delay, preset.plant.load_motor.amplifier.delay] = LATE;
    [preset.model.servo_delay, preset.model.load_amplifier.delay] = assumed;
    preset
}

#[test]
fn the_delays_of_both_drives_are_identified() {
    let mut preset = fieldbus("clm-bench", [5e-3; 2]);
    preset.model.drive.load_inertia *= 1.15;
    preset.model.drive.coupling_stiffness *= 0.8;
    let mut bench = VirtualBench::new(&preset, 1).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    let calibration = calibrate(&CalibrationPlan::default(), &mut bench, &Watch::silent()).unwrap();
    let plant = &preset.plant;
    for (key, truth, share) in [
        ("servo_delay", LATE[0], 0.03),
        ("load_delay", LATE[1], 0.005),
        ("load_lag", plant.load_motor.amplifier.lag, 0.1),
        ("load_inertia", plant.drive.load_inertia, 0.01),
        ("motor_inertia", plant.drive.motor_inertia, 0.01),
        ("coupling_stiffness", plant.drive.coupling_stiffness, 0.02),
    ] {
        let identified = calibration.value(key).unwrap_or_else(|| panic!("{key} is missing"));
        assert!((identified.value / truth - 1.0).abs() < share, "{key}: {identified:?} instead of {truth}");
    }
    assert_eq!(calibration.model.servo_delay, calibration.value("servo_delay").unwrap().value);
    assert_eq!(calibration.model.load_amplifier.delay, calibration.value("load_delay").unwrap().value);
    // A drive that takes a torque has no voltage that could calibrate it.
    for absent in ["torque_constant", "resistance", "inductance"] {
        assert!(calibration.value(absent).is_none(), "{absent}");
    }
    let report = CalibrationRun { preset, seed: Some(1), calibration }.report("").html();
    assert!(report.contains("the torque constant of the load motor in the data sheet"), "the scale of all torques");
}

#[test]
fn presliding_is_identified_behind_a_late_drive() {
    let mut preset = fieldbus("clm-bench", LATE);
    preset.plant.encoder.counts_per_revolution = 200_000.0;
    preset.model.encoder.counts_per_revolution = 200_000.0;
    let mut bench = VirtualBench::new(&preset, 1).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    let presliding = measure_presliding(&PreslidingPlan::default(), &mut bench, &Watch::silent()).unwrap();
    let (stiffness, [low, high]) = presliding.stiffness.unwrap();
    assert!(low <= 300.0 && 300.0 <= high, "{stiffness}: {low} … {high}");
    // A delay of 2.4 ms that is not subtracted looks like a damping of 0.72 N m s/rad on bristles of 300 N m/rad.
    let (damping, [low, high]) = presliding.damping.unwrap();
    assert!(low <= 0.85 && (0.85..1.3).contains(&high), "{damping}: {low} … {high}");
}

/// Deviation of the rendered from the desired friction [N m RMS] while a carriage follows a sine of 2 Hz.
fn deviation(preset: &Preset<f64>) -> f64 {
    let sine = Reference::Sine(Sine { amplitude: 1.0, frequency: 2.0, fade_time: 0.5 });
    let setpoints = Generator::new(sine, preset.bench.tick_rate);
    let simulation = Simulation { preset, setpoints, duration: 4.0, rest: 0.5, render: true, seed: 1 };
    let simulated = simulate::<Error>(&simulation, None, &Watch::silent()).unwrap();
    let signal = |name: &str| &simulated.columns.iter().find(|column| column.name == name).expect("a signal").values;
    let [friction, load, velocity] = ["true_friction_torque", "true_load_torque", "true_velocity"].map(signal);
    let desired = preset.bench.desired;
    let squares = (0..friction.len()).filter(|&k| velocity[k].abs() > 2.0).map(|k| {
        let due = desired.magnitude(velocity[k].abs()).copysign(velocity[k]);
        (friction[k] + load[k] - due).powi(2)
    });
    let count = squares.clone().count();
    (squares.sum::<f64>() / count as f64).sqrt()
}

#[test]
fn a_law_that_knows_the_delays_renders_better() {
    let render = |assumed| {
        let mut preset = fieldbus("clm-bench", assumed);
        preset.bench.law = LawChoice::Residual(Residual::default());
        deviation(&preset)
    };
    let (known, unknown) = (render(LATE), render([0.0; 2]));
    assert!(known < 0.7 * unknown, "{known} N m with the delays in the model, {unknown} N m without");
}

/// Largest deviation from rest after a push of 0.05 N m for 0.1 s [rad], from 1 s after it on.
fn remaining_deviation(bench: &mut VirtualBench) -> Result<f64, Error> {
    home(bench, &Watch::silent())?;
    let at = bench.step(Command::default())?.angle;
    let setpoint = Setpoint { position: at, ..Setpoint::default() };
    let mut largest = 0f64;
    for tick in 0..2500 {
        let added_torque = if tick < 100 { 0.05 } else { 0.0 };
        let frame = bench.step(Command { setpoint, added_torque, ..Command::default() })?;
        if tick > 1100 {
            largest = largest.max((frame.angle - at).abs());
        }
    }
    Ok(largest)
}

#[test]
fn a_controller_that_is_unstable_with_the_delays_is_refused_and_a_slower_one_holds_the_axis() {
    let mut preset = fieldbus("clm-bench", LATE);
    preset.bench.filter = FilterChoice::Nothing;
    let slow = preset.bench.controller;
    preset.bench.controller = ControllerChoice::Cascade(Cascade::default());
    let refused = VirtualBench::new(&preset, 1).err().expect("it is unstable").to_string();
    assert!(
        refused.contains("the delay of 2.4 ms of the servo amplifier") && refused.contains("velocity_gain"),
        "{refused}"
    );
    // A model without the delays cannot be checked: the axis runs into a fault, or oscillates.
    let mut unknown = preset;
    [unknown.model.servo_delay, unknown.model.load_amplifier.delay] = [0.0; 2];
    let ended = remaining_deviation(&mut VirtualBench::new(&unknown, 1).unwrap());
    let count = std::f64::consts::TAU / preset.model.encoder.counts_per_revolution;
    assert!(!matches!(ended, Ok(deviation) if deviation < 20.0 * count), "{ended:?}");
    preset.bench.controller = slow;
    let ControllerChoice::Cascade(cascade) = &mut preset.bench.controller else { panic!("a cascade") };
    cascade.velocity_gain = 0.03;
    let deviation = remaining_deviation(&mut VirtualBench::new(&preset, 1).unwrap()).unwrap();
    assert!(deviation < 20.0 * count, "{deviation} rad");
}
