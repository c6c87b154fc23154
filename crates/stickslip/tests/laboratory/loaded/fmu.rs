//! FMUs written by stickslip, and one in the style of another tool: a good one, and one for each fault.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use stickslip::bench::external::{External, Role};
use stickslip::generate::{Version, fmu};
use stickslip::load::{Loaded, load};
use stickslip::run::{Record, replay};
use stickslip::{Watch, design};
use stickslip_core::block::Block as _;
use stickslip_core::control::{ControllerInput, PositionControllerState};
use stickslip_rt::ModuleSample;
use stickslip_software::supervise::ExternalFault;

use super::fixture::{MAP, SIMULATION, description, library_path, map, packed, servo};
use super::{here, preset};

/// As in `servo.c`.
const FAULTS: usize = 14;

fn of(loaded: &Loaded, name: &str) -> f64 {
    loaded.summary().value(name).expect("the summary has it")
}

#[test]
fn an_exported_built_in_controller_is_imported_unchanged() {
    let preset = preset();
    let period = preset.bench.control_period();
    let controller = design::software(&preset.model, &preset.bench).unwrap().control.controller;
    let folder = tempfile::tempdir().unwrap();
    for version in [Version::Two, Version::Three] {
        let exported = fmu("position_controller", &preset, version, None, None).unwrap();
        let path = folder.path().join(&exported.file);
        fs::write(&path, &exported.bytes).unwrap();
        let mut external = External::trusted(&path, Role::Controller).unwrap();
        let described = external.description();
        assert_eq!(described.kind, format!("FMU {}.0", version.number()));
        assert_eq!((described.signals.len(), described.signals[0].unit.as_str()), (6, "rad"));
        // Its inputs for compensation keep their defaults: the integral moves.
        assert!(described.notes[0].contains("input.integrates = 1.0"), "{:?}", described.notes);
        // Twice: the second start has no memory of the first.
        for _ in 0..2 {
            external.begin(period, 1.0).unwrap();
            let mut state = PositionControllerState::default();
            for k in 0..500 {
                let time = f64::from(k) * period;
                let sample = ModuleSample {
                    time,
                    reference_position: 0.4 * libm::sin(9.0 * time),
                    reference_velocity: 3.6 * libm::cos(9.0 * time),
                    reference_acceleration: -32.4 * libm::sin(9.0 * time),
                    measured_angle: 0.35 * libm::sin(9.0 * time - 0.1),
                    measured_velocity: 3.0 * libm::cos(9.0 * time - 0.1),
                    ..ModuleSample::default()
                };
                let input = ControllerInput {
                    reference_position: sample.reference_position,
                    reference_velocity: sample.reference_velocity,
                    reference_acceleration: sample.reference_acceleration,
                    measured_angle: sample.measured_angle,
                    measured_velocity: sample.measured_velocity,
                    ..ControllerInput::default()
                };
                let expected = controller.step(&mut state, input, period).torque;
                assert_eq!(external.step(&sample), Ok(expected), "{version:?}: sample {k}");
            }
        }
        // On the bench: the preset's controller starts without a bump, the FMU from zero, and the noise differs.
        // Both leave a few thousandths of the deviation.
        let loaded = load(
            &preset,
            External::in_own_process(&path, Role::Controller, &here()).unwrap(),
            0.0,
            3,
            None,
            &Watch::silent(),
        )
        .unwrap();
        assert_eq!(loaded.fault, None);
        let [external, own] = ["controller", "own"].map(|who| of(&loaded, &format!("{who}.sine_0.5hz.rms")));
        assert!((external / own - 1.0).abs() < 0.02, "{version:?}: {external} {own}");
    }
}

#[test]
fn an_exported_built_in_friction_is_imported_as_a_friction() {
    let preset = preset();
    let exported = fmu("friction", &preset, Version::Three, None, None).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(&exported.file);
    fs::write(&path, &exported.bytes).unwrap();
    let mut external = External::trusted(&path, Role::Friction).unwrap();
    let names: Vec<&str> = external.description().signals.iter().map(|signal| signal.name.as_str()).collect();
    assert_eq!(names, ["measured_angle", "estimated_velocity", "torque"]);
    let period = preset.bench.tick_time();
    external.begin(period, 1.0).unwrap();
    let sliding = |k: u32| ModuleSample {
        measured_angle: 2.0 * period * f64::from(k),
        estimated_velocity: 2.0,
        ..ModuleSample::default()
    };
    let torque = (0..2000).fold(0.0, |_, k| external.step(&sliding(k)).unwrap());
    let steady = preset.plant.screw_friction.steady_torque(2.0, sliding(2000).measured_angle, 0.0);
    assert!((torque - steady).abs() < 1e-3 * steady, "{torque} {steady}");
}

#[test]
fn units_and_names_of_another_tool_are_those_of_the_bench() {
    use std::f64::consts::PI;
    for version in [2, 3] {
        let folder = tempfile::tempdir().unwrap();
        let path = servo(folder.path(), version, 0);
        let mut external = External::trusted_as(&path, Role::Controller, &map(&MAP)).unwrap();
        let described = external.description().clone();
        assert_eq!((described.tool.as_deref(), described.step), (Some("Tool 7"), Some(0.0015)));
        assert!(described.notes[0].ends_with("start values: bias = 0.0."), "{:?}", described.notes);
        let signals: Vec<String> =
            described.signals.iter().map(|it| format!("{} {} {}", it.name, it.variable, it.unit)).collect();
        assert_eq!(signals[2..], ["measured_angle Encoder.phi deg", "torque Motor.'tau (out)' mN.m"]);
        external.set("PI.k", 20.0).unwrap();
        external.set("bias", 4.0).unwrap();
        assert!(external.set("PI.k", 1001.0).unwrap_err().to_string().contains("outside 0 … 1000 mN.m/deg"));
        assert!(external.set("PI.K", 1.0).unwrap_err().to_string().contains("Did you mean PI.k?"));
        assert!(external.set("bias", f64::INFINITY).unwrap_err().to_string().contains("finite"));
        external.begin(1e-3, 1.0).unwrap();
        for angle in [0.0, 0.1, -0.3] {
            let sample = ModuleSample {
                reference_position: 0.2,
                reference_velocity: PI,
                measured_angle: angle,
                ..ModuleSample::default()
            };
            let torque = external.step(&sample).unwrap();
            let expected = 1e-3 * (20.0 * (0.2 - angle) * 180.0 / PI + 1.5 * 30.0 + 4.0);
            // Some roundings of conversion.
            assert!((torque - expected).abs() < 1e-12, "{version}: {torque} {expected}");
        }
    }
}

#[test]
fn tunable_values_change_between_two_steps() {
    for version in [2, 3] {
        let folder = tempfile::tempdir().unwrap();
        let mut external =
            External::trusted_as(&servo(folder.path(), version, 0), Role::Controller, &map(&MAP)).unwrap();
        assert!(external.description().parameters.iter().all(|parameter| !parameter.fixed));
        let mut console = external.console();
        external.begin(1e-3, 1.0).unwrap();
        let sample = ModuleSample { reference_position: 1f64.to_radians(), ..ModuleSample::default() };
        // A degree of deviation, by the gain and the bias [mN m].
        for (gain, bias) in [(35.0, 0.0), (50.0, 0.0), (50.0, 7.0), (20.0, -1.0)] {
            let number = console.put(&[gain, bias]);
            let torque = external.step(&sample).unwrap();
            assert!((torque - 1e-3 * (gain + bias)).abs() < 1e-12, "{torque} N m of {gain} and {bias}");
            assert_eq!(console.verdict(number), Some(0));
        }
    }
}

#[test]
fn a_run_with_an_fmu_replays_without_it_and_its_report_identifies_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = servo(folder.path(), 2, 9);
    let run = folder.path().join("run.mf4");
    let host = here().mapping(&map(&MAP[..1]));
    // The host of this test takes one mapping: the other variables have the names of signals.
    let message =
        External::in_own_process(&path, Role::Controller, &host).err().expect("the torque is missing").to_string();
    assert!(message.contains("--map torque=NAME. Its outputs: Motor.'tau (out)'"), "{message}");
    let external = External::trusted_as(&path, Role::Controller, &map(&MAP)).unwrap();
    let loaded = load(&preset(), external, 0.0, 1, Some(&run), &Watch::silent()).unwrap();
    assert_eq!(loaded.fault, None);
    let remarks = loaded.remarks().join("\n");
    for part in [
        "FMU 2.0 by Tool 7: reference_position is Command.phi[1] [deg]",
        "Designed for steps of 0.0015 s",
        "2 parameters and inputs have the values of the FMU",
        "Its message: Step 300: the angle is wrong.",
    ] {
        assert!(remarks.contains(part), "{part}: {remarks}");
    }
    fs::remove_file(path).unwrap();
    let replayed = replay(&Record::read(&run).unwrap(), &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed}");
}

#[test]
fn each_fault_of_an_fmu_is_named_with_its_last_message() {
    let messages: [&[&str]; FAULTS] = [
        &[],
        &["signal 11", "Its message: Step 300: the angle is wrong."],
        &["has not answered for 0.300 s", "Its message: Step 300"],
        &["torque is not finite"],
        &["reported a failure (code 3)", "Its message: Step 300"],
        &["changed the rounding of floating-point numbers"],
        &["exited (exit code 3)"],
        &["reported a failure (code 2)"],
        &["reported a failure (code 4)", "Its message: Step 300"],
        &[],
        &["cannot be instantiated. Message: No licence for servo."],
        &["signal 6", "Its message: Step 300"],
        &["reported a failure (code 2)", "Step 300"],
        &["reported a failure (code 3)"],
    ];
    for (fault, parts) in messages.into_iter().enumerate().filter(|(_, parts)| !parts.is_empty()) {
        // Only FMI 3.0 can request the end.
        let version = if fault == 12 || fault % 2 == 1 { 3 } else { 2 };
        let folder = tempfile::tempdir().unwrap();
        // The built-in names, since the host of this test takes one mapping at most.
        let path = renamed(folder.path(), version, fault);
        let reason = match External::in_own_process_within(&path, Role::Controller, &here(), Duration::from_millis(300))
        {
            Err(error) => error.to_string(),
            Ok(external) => {
                let loaded = load(&preset(), external, 0.0, 1, None, &Watch::silent()).unwrap();
                assert!(of(&loaded, "own.sine_0.5hz.rms") < 0.1, "{fault}: the bench continues");
                loaded.fault.unwrap_or_default()
            }
        };
        for part in parts {
            assert!(reason.contains(part), "{fault}: {reason}");
        }
    }
}

/// `servo.c` with a fault, and the names that signals have.
fn renamed(folder: &Path, version: u32, fault: usize) -> PathBuf {
    let path = servo(folder, version, fault);
    let binary = fs::read(folder.join("servo.so")).expect("the library was written");
    let text =
        MAP.iter().fold(description(version, SIMULATION), |text, (signal, variable)| text.replace(variable, signal));
    let library = library_path(version);
    let files: [(&str, &[u8]); 3] =
        [("modelDescription.xml", text.as_bytes()), (&library, &binary), ("resources/a", b"")];
    fs::remove_file(path).expect("the file exists");
    packed(folder, "servo.fmu", &files)
}

#[test]
fn the_folder_of_an_fmu_is_removed_even_after_a_crash() {
    let folder = tempfile::tempdir().unwrap();
    let path = renamed(folder.path(), 3, 1);
    let mut external = External::in_own_process(&path, Role::Controller, &here()).unwrap();
    external.begin(1e-3, 1.0).unwrap();
    let crashed = (0..301).find_map(|_| external.step(&ModuleSample::default()).err());
    assert_eq!(crashed, Some(ExternalFault::Crashed { signal: 11 }));
    assert_eq!(external.message().as_deref(), Some("Step 300: the angle is wrong."));
}
