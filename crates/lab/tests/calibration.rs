//! A bench whose machine is not that of its data sheet finds out what it is.

#[path = "../examples/calibration/study.rs"]
mod study;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use stickslip::bench::VirtualBench;
use stickslip::calibrate::{CalibrationPlan, calibrate};
use stickslip::experiment::home;
use stickslip::{Error, Preset, Watch, parameters};
use study::{experiment, true_value};

#[test]
fn a_machine_drawn_at_random_is_identified_better_than_an_admittance_law_needs() {
    let (preset, calibration) = experiment("prototype", 3).unwrap();
    assert!(calibration.duration < 60.0, "{} s", calibration.duration);
    // What the laws need: scale and inertia of the torques to 0.25 %, the load's to 1 %, and so on; [model] was up to
    // 5, 20 and 50 % off.
    let needed = [
        ("torque_per_volt", 0.0025),
        ("load_inertia", 0.01),
        ("motor_inertia", 0.01),
        ("coupling_stiffness", 0.02),
        ("coupling_damping", 0.05),
        ("servo_lag", 0.05),
        ("tacho_lag", 0.05),
        ("torque_constant", 0.0025),
        ("resistance", 0.01),
        ("inductance", 0.01),
        ("bristle_stiffness", 0.05),
        ("breakaway_torque", 0.01),
    ];
    for (key, share) in needed {
        let found = calibration.value(key).unwrap_or_else(|| panic!("{key} is missing"));
        let truth = true_value(&preset, key).unwrap().unwrap_or_else(|| panic!("{key} has no truth"));
        assert!((found.value / truth - 1.0).abs() < share, "{key}: {} instead of {truth}", found.value);
        // Of 12 numbers none lies beyond five standard uncertainties by chance.
        assert!((found.value - truth).abs() < 5.0 * found.standard_uncertainty, "{key}: {found:?}, truth {truth}");
    }
    assert_eq!(calibration.model.drive.load_inertia, calibration.value("load_inertia").unwrap().value);
    assert_eq!(calibration.tacho_ripple_order, preset.plant.tacho.ripple_periods as usize);
}

fn bench() -> VirtualBench {
    let preset: Preset<f64> =
        parameters::presets::find("clm-bench").and_then(|source| source.read()).expect("a preset that reads");
    VirtualBench::new(&preset, 1).expect("a preset that can be prepared")
}

#[test]
fn a_bench_that_is_not_homed_is_not_calibrated() {
    let refused = calibrate(&CalibrationPlan::default(), &mut bench(), &Watch::silent());
    assert!(matches!(refused, Err(Error::NotHomed)));
}

#[test]
fn a_calibration_that_is_cancelled_ends() {
    let mut bench = bench();
    home(&mut bench, &Watch::silent()).unwrap();
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    let watch = Watch::new(cancelled, move |_, _| flag.store(true, Ordering::Relaxed));
    assert!(matches!(calibrate(&CalibrationPlan::default(), &mut bench, &watch), Err(Error::Cancelled)));
}
