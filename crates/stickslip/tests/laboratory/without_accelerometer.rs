//! A bench without accelerometer and tacho (`bench.observer.kind = "model"`): encoder, torques and model replace them.

use stickslip::bench::{Bench, VirtualBench};
use stickslip::calibrate::{CalibrationPlan, calibrate};
use stickslip::experiment::{FrictionPlan, home, measure_friction};
use stickslip::{DriveModelTrust, ObserverChoice, Preset, Watch, parameters, true_friction};
use stickslip_core::sensor::Fault;

/// A preset with this observer, and with instruments that give NaN.
fn deaf(name: &str, observer: ObserverChoice<f64>) -> Preset<f64> {
    let source = parameters::presets::find(name).expect("a preset");
    let mut preset: Preset<f64> = source.read().expect("a sound one");
    preset.bench.observer = observer;
    preset.plant.accelerometer.fault = Fault::NotANumber;
    preset.plant.tacho.fault = Fault::NotANumber;
    preset
}

#[test]
fn friction_is_measured_without_the_instruments() {
    for name in ["clm-bench", "prototype"] {
        let mut bench = VirtualBench::new(&deaf(name, ObserverChoice::Model(DriveModelTrust::default())), 1).unwrap();
        home(&mut bench, &Watch::silent()).unwrap();
        let curve = measure_friction(&FrictionPlan::quick(), &mut bench, false, &Watch::silent()).unwrap();
        assert_eq!(curve.dropped().count(), 0, "{name}: every plateau slides");
        let breakaway = bench.model().own.breakaway_torque;
        for plateau in &curve.plateaus {
            let exact = true_friction::own_friction(bench.true_plant(), plateau.velocity);
            // As with the instruments: 0.5 % of M_S for a systematic error, three standard errors for noise.
            let allowed = 5e-3 * breakaway + 3.0 * plateau.standard_error;
            assert!((plateau.torque - exact).abs() <= allowed, "{name}: {plateau:?}: {exact}");
        }
    }
    // The other observer needs them.
    let mut bench = VirtualBench::new(&deaf("clm-bench", ObserverChoice::Accelerometer), 1).unwrap();
    let error = home(&mut bench, &Watch::silent()).unwrap_err().to_string();
    assert!(error.contains("not finite"), "{error}");
}

#[test]
fn a_calibration_needs_encoder_and_current_alone() {
    let mut preset = deaf("prototype", ObserverChoice::Model(DriveModelTrust::default()));
    preset.model.drive.load_inertia *= 1.2;
    preset.model.drive.coupling_stiffness *= 0.7;
    preset.model.scaling.torque_per_volt *= 1.03;
    let mut bench = VirtualBench::new(&preset, 1).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    let calibration = calibrate(&CalibrationPlan::default(), &mut bench, &Watch::silent()).unwrap();
    let plant = &preset.plant;
    for (key, truth, share) in [
        ("load_inertia", plant.drive.load_inertia, 0.01),
        ("motor_inertia", plant.drive.motor_inertia, 0.01),
        ("coupling_stiffness", plant.drive.coupling_stiffness, 0.02),
        ("torque_per_volt", plant.servo.torque_per_volt, 0.0025),
    ] {
        let identified = calibration.value(key).unwrap_or_else(|| panic!("{key} is missing"));
        assert!((identified.value / truth - 1.0).abs() < share, "{key}: {identified:?} instead of {truth}");
    }
    assert!(calibration.value("tacho").is_none() && calibration.value("accelerometer").is_none());
    assert!(calibration.traces.iter().all(|trace| ["angle", "current of the load motor"].contains(&trace.channel)));
    assert_eq!(calibration.model.scaling.tacho, preset.model.scaling.tacho);
}
