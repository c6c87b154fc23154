//! Runs recorded in memory and replayed.

use std::thread;

use stickslip_core::control::reference::Setpoint;

use super::*;
use crate::home;
use crate::tap::{ChangeKind, tap};
use crate::{Bench, Change, ClockedBench, Command, Faulty, InProcess, ThreadSettings, VirtualBench};
use stickslip_base::preset::LawChoice;
use stickslip_base::{Watch, parameters};

fn preset() -> Preset<f64> {
    parameters::presets::find("clm-bench").unwrap().read().unwrap()
}

/// Homes, renders while it moves, and changes controller and preload meanwhile.
fn experiment(bench: &mut dyn Bench) {
    home(bench, &Watch::silent()).unwrap();
    let start = bench.step(Command::default()).unwrap().angle;
    let dt = bench.settings().tick_time();
    for k in 0..2000_u32 {
        let time = f64::from(k) * dt;
        if k == 500 {
            let settings = LawChoice::Bristle;
            let settings = stickslip_base::Settings { law: settings, ..*bench.settings() };
            let law = stickslip_simulate::rendering_law(bench.model(), &settings).unwrap();
            bench.set_law(law).unwrap();
        }
        if k == 1000 {
            bench.set_preload(0.5).unwrap();
            let controller = bench.parameters().tick.control.controller;
            bench.set_controller(controller, 2).unwrap();
        }
        let setpoint = Setpoint { position: start + time * time, velocity: 2.0 * time, acceleration: 2.0 };
        bench.hand_over(Command { setpoint, control: true, render: true, ..Command::default() }).unwrap();
    }
    bench.come_to_rest().unwrap();
    bench.change(Change::Request(stickslip_software::supervise::Request::Stop)).unwrap();
}

fn recorded() -> Record {
    let preset = preset();
    let mut bench = VirtualBench::new(&preset, 7).unwrap();
    let mut record = Record::new(&preset, Some(7), *bench.parameters());
    let (tap, mut stream) = tap(1 << 16);
    bench.tap(tap);
    experiment(&mut bench);
    record.take(&mut stream);
    record
}

#[test]
fn a_run_in_lockstep_replays_exactly_with_software_and_machine() {
    let record = recorded();
    let replayed = replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine, "{replayed:?}");
    assert!(record.cycles.len() > 3000 && record.changes.len() >= 6, "{}", record.changes.len());
    // The order of the reports does not matter: here the last cycle is first.
    let mut other = record.clone();
    other.changes.sort_by_key(|changed| std::cmp::Reverse(changed.cycle));
    assert_ne!(other.changes, record.changes);
    assert!(replay(&other, &Watch::silent()).unwrap().identical());
    // The same with the changes read from their lines.
    let mut read = record.clone();
    read.changes.iter_mut().for_each(|changed| changed.what = change::parse(&change::line(&changed.what)).unwrap());
    assert!(replay(&read, &Watch::silent()).unwrap().identical());
}

#[test]
fn a_run_in_real_time_replays_exactly() {
    let preset = preset();
    let (tap, mut stream) = tap(1 << 16);
    let mut bench = ClockedBench::virtual_machine(&preset, 7, ThreadSettings::PLAIN, Some(tap)).unwrap();
    let mut record = Record::new(&preset, Some(7), *bench.parameters());
    // The time between experiments is part of the run.
    thread::sleep(std::time::Duration::from_millis(20));
    experiment(&mut bench);
    bench.stop();
    record.take(&mut stream);
    let replayed = replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed:?}");
    let preloads = record.changes.iter().filter(|changed| matches!(changed.what, ChangeKind::Preload(_)));
    assert_eq!(preloads.count(), 1);
    assert!(stream.is_closed());
}

#[test]
fn a_difference_is_located_to_cycle_and_block() {
    let record = recorded();
    let first = |record: &Record| replay(record, &Watch::silent()).unwrap().first.unwrap();
    let source = |record: &Record| {
        let first = first(record);
        (first.cycle, first.block)
    };
    let number = |k: usize| record.cycles[k].0;

    let mut other = record.clone();
    other.cycles[1500].1.software.difference_torque += 1e-15;
    assert_eq!(source(&other), (number(1500), "rendering law"));

    // A reading that differs from that of the machine.
    let mut other = record.clone();
    other.cycles[2000].1.measurement.tacho_voltage += 1e-15;
    assert_eq!(source(&other), (number(2000), "machine"));

    // A change one cycle later than recorded.
    let mut other = record.clone();
    let at =
        other.changes.iter().position(|changed| matches!(changed.what, ChangeKind::Software(Change::Parameters(_), _)));
    let changed = &mut other.changes[at.unwrap()];
    changed.cycle += 1;
    let cycle = changed.cycle - 1;
    assert_eq!(first(&other).cycle, cycle);

    let mut other = record.clone();
    other.seed = Some(8);
    assert_eq!(first(&other).block, "machine");
}

#[test]
fn a_record_with_a_gap_is_replayed_up_to_the_gap() {
    let mut record = recorded();
    let gap = record.cycles[1000].0;
    record.cycles.drain(990..1000);
    record.lost.push((gap, 10));
    let replayed = replay(&record, &Watch::silent()).unwrap();
    assert_eq!((replayed.cycles, replayed.lost, replayed.identical()), (990, 10, false));
    assert_eq!(replayed.first, None);
}

/// The same run, recorded into a file.
fn recorded_into(path: &std::path::Path) -> Recorded {
    let about = About { command: "test".into(), preset: preset(), seed: Some(7) };
    let (recorder, tap) = Recorder::start(path, &about).unwrap();
    let mut bench = VirtualBench::new(&about.preset, 7).unwrap();
    bench.tap(tap);
    experiment(&mut bench);
    assert!(bench.change(Change::Request(stickslip_software::supervise::Request::Stop)).is_err());
    drop(bench);
    recorder.finish().unwrap()
}

#[test]
fn a_run_is_recorded_read_and_replayed_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let summary = recorded_into(&path);
    let record = Record::read(&path).unwrap();
    let memory = recorded();
    assert_eq!((summary.lost, summary.file.rows), (0, record.cycles.len() as u64));
    assert_eq!(record.cycles, memory.cycles);
    assert_eq!(record.changes.len(), memory.changes.len() + 1, "the refused one");
    assert_eq!((record.preset, record.seed, record.initial), (memory.preset, memory.seed, memory.initial));
    let replayed = replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine, "{replayed:?}");
    // The event lists the changes for users.
    let contents = stickslip_recording::mdf::read(&path).unwrap();
    let named = |text: &str| contents.events.iter().any(|(_, event)| event.comment.contains(text));
    assert!(named("tick.law.kind: off → bristle") || named("tick.law"), "{:?}", contents.events.len());
    assert!(named("Nothing runs."));
}

#[test]
fn an_incomplete_record_is_replayed_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let about = About { command: "test".into(), preset: preset(), seed: Some(7) };
    let mut writer = RunWriter::create(&path, &about).unwrap();
    let mut bench = VirtualBench::new(&about.preset, 7).unwrap();
    let (tap, mut stream) = tap(1 << 16);
    bench.tap(tap);
    experiment(&mut bench);
    let mut rows = 0;
    while let Some(sample) = stream.sample() {
        writer.sample(&sample).unwrap();
        rows += 1;
    }
    while let Some(changed) = stream.change() {
        writer.change(&changed).unwrap();
    }
    // As after a killed process.
    drop(writer);
    let record = Record::read(&path).unwrap();
    let (cycles, tick_rate) = (record.cycles.len(), about.preset.bench.tick_rate);
    assert!(cycles < rows && (rows - cycles) as f64 <= 0.1 * tick_rate + 1.0, "{cycles} of {rows}");
    assert!(replay(&record, &Watch::silent()).unwrap().identical());
}

#[test]
fn a_record_with_an_impossible_cycle_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let about = About { command: "test".into(), preset: preset(), seed: None };
    let mut writer = RunWriter::create(&path, &about).unwrap();
    let mut bench = VirtualBench::new(&about.preset, 7).unwrap();
    let mut frame = bench.step(Command::default()).unwrap();
    for cycle in [0, 1 << 40] {
        frame.cycle = cycle;
        writer.sample(&Sample { frame, lost: 0, held: 0, waited: 0 }).unwrap();
    }
    writer.finish().unwrap();
    let refused = Record::read(&path).unwrap_err().to_string();
    assert!(refused.contains("not in order"), "{refused}");
}

#[test]
fn a_record_with_the_parameters_of_another_build_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let about = About { command: "test".into(), preset: preset(), seed: None };
    RunWriter::create(&path, &about).unwrap().finish().unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let word = b"parameters ";
    let start = bytes.windows(word.len()).position(|part| part == word).unwrap() + word.len();
    let between = start + bytes[start..].iter().position(|byte| *byte == b' ').unwrap();
    // Two numbers become one.
    bytes[between] = b'0';
    std::fs::write(&path, bytes).unwrap();
    let refused = Record::read(&path).unwrap_err().to_string();
    assert!(refused.contains("not that of this build") && refused.contains("that recorded it"), "{refused}");
}

#[test]
fn an_invalid_record_or_one_of_another_version_is_refused() {
    use std::time::SystemTime;

    use stickslip_recording::mdf::{Header, Writer};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let refused = |schema: &str, version: &str| {
        let header = Header {
            start: SystemTime::UNIX_EPOCH,
            program: "stickslip".into(),
            version: version.into(),
            comment: String::new(),
            properties: vec![("schema".into(), schema.into())],
        };
        Writer::create(&path, &header, &[], 1e-3).unwrap().finish().unwrap();
        Record::read(&path).unwrap_err().to_string()
    };
    assert!(refused("other", env!("CARGO_PKG_VERSION")).contains("not a record"));
    assert!(refused("stickslip.run/1", "0.0.7").contains("Replay it with stickslip 0.0.7"));
    assert!(refused("stickslip.run/1", env!("CARGO_PKG_VERSION")).contains("parameters are missing"));
}

/// The part of a record from a state on.
fn from(whole: &Record, keyframe: &Keyframe) -> Record {
    let mut record = Record::from(&whole.preset, whole.seed, whole.initial, keyframe);
    record.cycles = whole.cycles.iter().filter(|(cycle, _)| *cycle >= keyframe.cycle).copied().collect();
    record.changes = whole.changes.iter().filter(|changed| changed.cycle >= keyframe.cycle).copied().collect();
    record
}

/// A run in real time with a law, with states taken during motion, at the start of a fault, and after it.
fn run_with_law(law: LawChoice<f64>) -> (Record, Vec<Keyframe>) {
    let mut preset = preset();
    preset.bench.law = law;
    let (tap, mut stream) = tap(1 << 16);
    let (machine, readings) = InProcess::new(&preset, 7).unwrap();
    let machine = Faulty::new(machine, readings, preset.model.encoder, preset.bench.tick_time());
    let mut bench = ClockedBench::over(&preset, machine, readings, ThreadSettings::PLAIN, Some(tap)).unwrap();
    let mut record = Record::new(&preset, Some(7), *bench.parameters());
    let mut states = bench.keyframes().unwrap();
    assert!(bench.keyframes().is_none());
    home(&mut bench, &Watch::silent()).unwrap();
    bench.set_law(stickslip_simulate::rendering_law(&preset.model, &preset.bench).unwrap()).unwrap();
    let mut keyframes = Vec::new();
    let start = bench.step(Command::default()).unwrap().angle;
    let dt = preset.bench.tick_time();
    for k in 0..1600_u32 {
        match k {
            400 | 900 => keyframes.push(states.take().unwrap()),
            500 => bench.set_preload(0.5).unwrap(),
            600 => {
                let controller = bench.parameters().tick.control.controller;
                bench.set_controller(controller, 2).unwrap();
            }
            // Long before it stops the bench: its start is part of the state.
            700 => bench.inject("accelerometer-jump=0.001@0s".parse().unwrap()).unwrap(),
            1000 => bench.inject("tacho-nan@0s".parse().unwrap()).unwrap(),
            _ => {}
        }
        let time = f64::from(k) * dt;
        let setpoint = Setpoint { position: start + 4.0 * time * time, velocity: 8.0 * time, acceleration: 8.0 };
        // On a busy computer the set-point may rest for a moment; commands after the fault have no effect.
        let _ = bench.hand_over(Command { setpoint, control: true, render: true, ..Command::default() });
    }
    while bench.safety().fault().is_none() {
        let _ = bench.outstanding();
        let _ = bench.refresh();
        thread::sleep(std::time::Duration::from_millis(1));
    }
    keyframes.push(states.take().unwrap());
    thread::sleep(std::time::Duration::from_millis(30));
    // Refused before the axis is at rest; this is recorded as well.
    let _ = bench.change(Change::Request(stickslip_software::supervise::Request::Acknowledge));
    thread::sleep(std::time::Duration::from_millis(20));
    bench.stop();
    assert!(states.take().is_err(), "the loop has ended");
    record.take(&mut stream);
    (record, keyframes)
}

#[test]
fn a_record_that_starts_in_the_middle_replays_exactly_with_every_law() {
    let laws = [
        LawChoice::Paper,
        LawChoice::Smooth,
        LawChoice::Karnopp,
        LawChoice::Bristle,
        LawChoice::Residual(stickslip_base::Residual { missing_torque: 0.03 }),
        LawChoice::Admittance(stickslip_base::Tracking { bandwidth: 350.0, missing_torque: 0.1 }),
    ];
    for law in laws {
        let (whole, keyframes) = run_with_law(law);
        assert!(replay(&whole, &Watch::silent()).unwrap().identical(), "{law:?}");
        assert_eq!(keyframes.len(), 3);
        for keyframe in keyframes {
            assert!(keyframe.cycle > 1000 && keyframe.numbers.len() > 200, "{}", keyframe.numbers.len());
            let record = from(&whole, &keyframe);
            let replayed = replay(&record, &Watch::silent()).unwrap();
            assert!(replayed.identical() && replayed.machine && replayed.of > 50, "{law:?}: {replayed:?}");
            // A changed state is detected.
            let mut other = record.clone();
            let state = other.state.as_mut().unwrap();
            *state.last_mut().unwrap() += 1e-3;
            state.rotate_left(1);
            assert!(!replay(&other, &Watch::silent()).is_ok_and(|replayed| replayed.identical()));
        }
    }
}

#[test]
fn a_file_that_starts_in_the_middle_is_replayed_and_a_wrong_state_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mf4");
    let (whole, keyframes) = run_with_law(LawChoice::Bristle);
    let record = from(&whole, &keyframes[1]);
    let about = About { command: "test".into(), preset: whole.preset, seed: Some(7) };
    let mut writer = RunWriter::create_from(&path, &about, &keyframes[1]).unwrap();
    for (cycle, signals) in &record.cycles {
        writer.row(*cycle, signals).unwrap();
    }
    record.changes.iter().for_each(|changed| writer.change(changed).unwrap());
    writer.finish().unwrap();
    let read = Record::read(&path).unwrap();
    // The last tacho readings are NaN and never equal: the replay compares the cycles.
    assert_eq!((&read.state, read.cycles.len()), (&record.state, record.cycles.len()));
    assert!(Stored::open(&path).unwrap().replay(&Watch::silent()).unwrap().identical());
    // The time of a file is that of cycle 0.
    let start = stickslip_recording::mdf::read(&path).unwrap().header.start;
    let since = std::time::SystemTime::now().duration_since(start).unwrap().as_secs_f64();
    assert!(since >= keyframes[1].cycle as f64 * record.tick_time());
    let mut short = read;
    short.state.as_mut().unwrap().pop();
    let refused = replay(&short, &Watch::silent()).unwrap_err().to_string();
    assert!(refused.contains("does not fit its preset"), "{refused}");
}
