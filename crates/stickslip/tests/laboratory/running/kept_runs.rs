//! A run recorded by an earlier build replays to the bit on this build, for any processor.
//!
//! If it does not, the computation of the software or the virtual machine has changed: then raise the version, so that
//! earlier records are refused with the version that can replay them, and bless the run again (`cargo xtask bless`).

use std::path::PathBuf;

use stickslip::bench::{Bench, Change, Command, FaultyBench};
use stickslip::experiment::home;
use stickslip::fidelity::LAWS;
use stickslip::run::{About, Recorder, Stored, story};
use stickslip::{Preset, Settings, Watch, design, parameters};
use stickslip_core::control::reference::Setpoint;
use stickslip_software::supervise::{Request, SafetyState};

fn file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/laboratory/running/everything.mf4")
}

/// Homes, moves under one law after another, changes controller and linings, has a fault, is acknowledged and armed
/// again.
fn record(file: &std::path::Path) {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
    preset.bench.tick_rate = 1000.0;
    let about = About { command: "kept run".into(), preset, seed: Some(3) };
    let (recorder, tap) = Recorder::start(file, &about).unwrap();
    let mut bench = FaultyBench::new(&preset, 3).unwrap();
    bench.tap(tap);
    home(&mut bench, &Watch::silent()).unwrap();
    let start = bench.step(Command::default()).unwrap().angle;
    let laws = ["paper", "bristle", "residual", "admittance", "karnopp"];
    let law = |k: usize| LAWS.iter().find(|(name, _)| *name == laws[k / 200]).unwrap().1;
    for k in 0..1000_usize {
        let time = k as f64 * bench.settings().tick_time();
        if k % 200 == 0 {
            let settings = Settings { law: law(k), ..*bench.settings() };
            bench.set_law(design::rendering_law(bench.model(), &settings).unwrap()).unwrap();
        }
        if k == 500 {
            bench.set_preload(0.5).unwrap();
            let controller = bench.parameters().tick.control.controller;
            bench.set_controller(controller, 2).unwrap();
        }
        if k == 900 {
            bench.inject("encoder-stuck@0s".parse().unwrap()).unwrap();
        }
        let velocity = 6.0 * libm::sin(12.0 * time);
        let setpoint = Setpoint {
            position: start + 0.5 * (1.0 - libm::cos(12.0 * time)),
            velocity,
            acceleration: 72.0 * libm::cos(12.0 * time),
        };
        let command = Command { setpoint, control: true, render: true, ..Command::default() };
        if bench.hand_over(command).is_err() {
            break;
        }
    }
    // The run after the fault is recorded as well.
    for _ in 0..100 {
        let _ = bench.step(Command::default());
    }
    assert!(matches!(bench.safety(), SafetyState::Fault(_)), "{:?}", bench.safety());
    bench.change(Change::Request(Request::Acknowledge)).unwrap();
    for _ in 0..50 {
        let _ = bench.step(Command::default());
    }
    drop(bench);
    assert_eq!(recorder.finish().unwrap().lost, 0);
}

#[test]
fn the_events_of_a_stored_run_are_described_in_words() {
    let happened = story(&file()).unwrap();
    let find = |start: &str| {
        happened.iter().find(|one| one.what.starts_with(start)).unwrap_or_else(|| panic!("{start}: {happened:?}"))
    };
    assert_eq!(happened[0].what, "Begin");
    assert!(find("Parameters").details.iter().any(|line| line.contains(" → ")));
    assert!(find("Homed, index at ").cycle > find("Home").cycle);
    assert!(find("Fault").trouble && !find("Fault acknowledged").trouble);
    assert!(find("Fault").details[0].len() > 20, "{:?}", find("Fault"));
    assert!(happened.windows(2).all(|pair| pair[0].cycle <= pair[1].cycle && pair[0].time <= pair[1].time));
    assert!(story(std::path::Path::new(file!())).is_err());
}

#[test]
fn a_stored_run_replays_to_the_bit_on_this_build() {
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::create_dir_all(file().parent().unwrap()).unwrap();
        record(&file());
    }
    let replayed = Stored::open(&file()).unwrap().replay(&Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine, "{replayed:?}");
    assert!(replayed.cycles > 1000, "{replayed:?}");
}
