//! A bench whose machine differs from its data sheet identifies its parameters.

#[path = "../../examples/calibration/study.rs"]
mod study;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::Value;
use stickslip::bench::VirtualBench;
use stickslip::calibrate::{CalibrationPlan, calibrate};
use stickslip::experiment::home;
use stickslip::{Error, Preset, Watch, parameters};
use study::{PRESETS, experiment, scores};

fn committed() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies/calibration.json");
    let text = std::fs::read_to_string(file).expect("the study is committed");
    serde_json::from_str(&text).expect("a study is written as JSON")
}

#[test]
fn the_committed_intervals_contain_the_true_value_as_often_as_stated() {
    let results = &committed()["results"];
    let value = |name: String| results[&name]["value"].as_f64().unwrap_or_else(|| panic!("{name}"));
    for (preset, machines) in PRESETS {
        assert_eq!(value(format!("{preset}.experiments")), machines as f64);
        let coverage = value(format!("{preset}.coverage"));
        assert!((0.93..=0.97).contains(&coverage), "{preset}: {coverage}");
    }
}

#[test]
fn a_random_machine_is_identified_as_accurately_as_in_the_committed_study() {
    let committed = committed();
    let rows = committed["rows"].as_array().unwrap();
    let row = rows.iter().find(|row| row["preset"] == "prototype" && row["seed"] == 3).unwrap();
    let (preset, calibration) = experiment("prototype", 3).unwrap();
    assert!(calibration.duration < 60.0, "{} s", calibration.duration);
    // Required by the laws: scale and inertia of the torques to 0.25 %, the load's to 1 %, and so on; [model] was up to
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
    let scores = scores(&preset, &calibration).unwrap();
    for (key, share) in needed {
        let score = scores.iter().find(|score| score.key == key).unwrap_or_else(|| panic!("{key} is missing"));
        assert!(score.error.abs() < share * score.truth, "{key}: {} instead of {}", score.value, score.truth);
        // None of 12 numbers has an error of twice its interval by chance.
        assert!(score.error.abs() < 2.0 * score.half, "{key}: {} ± {}, truth {}", score.value, score.half, score.truth);
    }
    for score in &scores {
        let then = row[score.key].as_f64().unwrap();
        // A start some bits off moves a number by up to a third of its interval, as another noise would.
        let off = (score.value - then).abs();
        assert!(
            off <= 0.5 * score.half,
            "{}: {}, was {then}: run `cargo xtask study calibration`",
            score.key,
            score.value
        );
    }
    assert_eq!(calibration.model.drive.load_inertia, calibration.value("load_inertia").unwrap().value);
    assert_eq!(calibration.tacho_ripple_order, preset.plant.tacho.ripple_periods as usize);
}

fn bench(name: &str) -> VirtualBench {
    let preset: Preset<f64> =
        parameters::presets::find(name).and_then(|source| source.read()).expect("a preset that reads");
    VirtualBench::new(&preset, 1).expect("a preset that can be prepared")
}

#[test]
fn a_bench_that_is_not_homed_is_not_calibrated() {
    let refused = calibrate(&CalibrationPlan::default(), &mut bench("clm-bench"), &Watch::silent());
    assert!(matches!(refused, Err(Error::NotHomed)));
}

#[test]
fn an_axis_without_a_load_motor_is_refused_with_an_alternative() {
    let refused = calibrate(&CalibrationPlan::default(), &mut bench("emps"), &Watch::silent()).unwrap_err();
    assert!(refused.to_string().contains("identify the axis from a recording"), "{refused}");
}

#[test]
fn a_machine_with_a_rippling_load_motor_gives_a_warning() {
    let mut bench = bench("clm-real");
    home(&mut bench, &Watch::silent()).unwrap();
    let plan = CalibrationPlan { duration: 1.0, rest_duration: 1.0, ..CalibrationPlan::default() };
    let calibration = calibrate(&plan, &mut bench, &Watch::silent()).unwrap();
    assert!(
        calibration.warnings.iter().any(|warning| warning.contains("ripple of a motor")),
        "{:?}",
        calibration.warnings
    );
}

#[test]
fn a_calibration_that_is_cancelled_ends() {
    let mut bench = bench("clm-bench");
    home(&mut bench, &Watch::silent()).unwrap();
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    let watch = Watch::new(cancelled, move |_, _| flag.store(true, Ordering::Relaxed));
    assert!(matches!(calibrate(&CalibrationPlan::default(), &mut bench, &watch), Err(Error::Cancelled)));
}
