//! Each fault, injected while the bench moves and renders: detected, braked, stored until it is acknowledged. The table
//! of the guide is generated here.

use std::fmt::Write as _;

use expect_test::expect_file;
use stickslip::bench::faults::Kind;
use stickslip::bench::tap::{Stream, tap};
use stickslip::bench::{
    Bench, Change, ClockedBench, Command, Faulty, FaultyBench, Frame, InProcess, Injection, SpeedRamp, ThreadSettings,
};
use stickslip::experiment::home;
use stickslip::run::{Record, replay};
use stickslip::{LawChoice, Preset, Settings, Watch, design, parameters};
use stickslip_software::supervise::{Fault, Request, SafetyState};

/// Start of the fault after homing and the start of motion [s].
const MOVED: f64 = 0.628;
/// Swing of the speed about its mean [rad/s], and its angular frequency [rad/s]: some faults show only in a change.
const SWING: (f64, f64) = (10.0, 50.0);

fn preset(tick_rate: f64) -> Preset<f64> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench").unwrap().read().unwrap();
    preset.bench.tick_rate = tick_rate;
    preset
}

/// Homed, with the paper's law active.
fn ready(preset: &Preset<f64>) -> (FaultyBench, Stream) {
    let mut bench = FaultyBench::new(preset, 1).unwrap();
    let (tap, stream) = tap(1 << 16);
    bench.tap(tap);
    home(&mut bench, &Watch::silent()).unwrap();
    let settings = Settings { law: LawChoice::Paper, ..preset.bench };
    bench.set_law(design::rendering_law(&preset.model, &settings).unwrap()).unwrap();
    (bench, stream)
}

/// Result of a fault.
struct Outcome {
    fault: Option<Fault>,
    /// Time from the fault's first tick to its detection [s].
    seen: f64,
    /// Way from there to rest, and its limit [rad].
    way: f64,
    allowed: f64,
    /// Whether the drive braked; whether at the end it held a pushing load until it was switched off, and whether
    /// there was no torque then.
    braked: bool,
    held: bool,
    off: bool,
    /// Whether the screw was at rest at the end.
    rest: bool,
}

/// Angle of the healthy counter, over its wraps [rad].
struct TrueAngle {
    count: f64,
    angle: f64,
}

impl TrueAngle {
    /// One cycle; returns its way [rad].
    fn follow(&mut self, bench: &FaultyBench) -> f64 {
        let count = bench.undisturbed().count;
        let moved = (count - self.count + 32_768.0).rem_euclid(65_536.0) - 32_768.0;
        self.count = count;
        let way = moved * std::f64::consts::TAU / 10_000.0;
        self.angle += way;
        way
    }
}

/// A motion with a fault and its stop.
fn hit(preset: &Preset<f64>, kind: Kind, velocity: f64) -> (FaultyBench, Outcome) {
    let (mut bench, mut stream) = ready(preset);
    let dt = preset.bench.tick_time();
    let first = bench.step(Command::default()).unwrap();
    let onset_time = (first.cycle + 1) as f64 * dt + MOVED;
    bench.inject(Injection::new(kind, onset_time)).unwrap();
    let mut traveller = SpeedRamp::new(first.angle, 1000.0, dt);
    let mut true_angle = TrueAngle { count: bench.undisturbed().count, angle: 0.0 };
    let onset = first.cycle + 1 + (MOVED / dt).round() as u64;
    let (mut at_onset, mut fastest, mut standing) = (0.0, 0.0_f64, 0);
    let (mut slow, mut stopped) = (0, None);
    let mut outcome =
        Outcome { fault: None, seen: 0.0, way: 0.0, allowed: 0.0, braked: false, held: false, off: false, rest: false };
    let mut frames: Vec<Frame> = Vec::new();
    for k in 0..(4.0 / dt) as u64 {
        let time = k as f64 * dt;
        let swing = if outcome.fault.is_none() { SWING.0 * (SWING.1 * time).sin() } else { 0.0 };
        let setpoint = traveller.toward(velocity + swing);
        let command = Command { setpoint, control: true, render: true, ..Command::default() };
        // Without torque it returns this error in every cycle.
        let _ = bench.hand_over(command);
        let way = true_angle.follow(&bench);
        frames.extend(std::iter::from_fn(|| stream.sample()).map(|sample| sample.frame));
        let frame = frames[frames.len() - 1];
        let speed = bench.undisturbed().tacho_voltage.abs() / preset.model.scaling.tacho;
        if frame.cycle < onset {
            assert_eq!(frame.safety, SafetyState::Running, "{kind:?} {velocity}: before the fault");
            (at_onset, fastest) = (true_angle.angle, speed);
            continue;
        }
        fastest = fastest.max(speed);
        if outcome.fault.is_none() && frame.safety.fault().is_some() {
            (outcome.fault, outcome.seen) = (frame.safety.fault(), (frame.cycle - onset) as f64 * dt);
        }
        outcome.braked |= matches!(frame.safety, SafetyState::Stopping(_)) && frame.signals.servo_voltage != 0.0;
        // As in the supervision: below 1 rad/s for 20 ms.
        slow = if outcome.fault.is_some() && speed < 1.0 { slow + 1 } else { 0 };
        if stopped.is_none() && slow as f64 * dt >= 0.02 {
            stopped = Some(true_angle.angle);
        }
        standing = if way == 0.0 { standing + 1 } else { 0 };
        outcome.rest = standing as f64 * dt > 0.1;
        if outcome.rest && matches!(frame.safety, SafetyState::Fault(_)) {
            break;
        }
    }
    outcome.held = matches!(bench.safety(), SafetyState::Stopping(_));
    if outcome.held {
        bench.change(Change::Request(Request::Off)).unwrap();
        let _ = bench.hand_over(Command::default());
        frames.extend(std::iter::from_fn(|| stream.sample()).map(|sample| sample.frame));
    }
    let last = frames[frames.len() - 1];
    outcome.off = last.signals.servo_voltage == 0.0 && last.signals.amplifier_voltage == 0.0;
    outcome.way = (stopped.unwrap_or(true_angle.angle) - at_onset).abs();
    let deceleration = preset.bench.safety.stop_deceleration;
    // Delays between software and screw besides the ticks: lag of amplifier and tacho, twist of the coupling.
    let drive = &preset.model.drive;
    let twist = 2.0 * drive.load_inertia * deceleration / drive.coupling_stiffness;
    let late = 2.0 * dt + outcome.seen + preset.model.drive_lag;
    outcome.allowed = 0.5 * fastest * fastest / deceleration + fastest * late + twist;
    (bench, outcome)
}

/// Name of a detected fault.
fn name(fault: &Fault) -> String {
    let text = format!("{fault:?}");
    text.split([' ', '(']).next().unwrap_or_default().to_owned()
}

#[test]
fn every_fault_is_detected_braked_within_its_way_and_stored_until_it_is_acknowledged() {
    let mut table = String::from(
        "| fault | what it does | seen as | after, s | stops by | longest way, rad | of the allowed | ends | the zero |\n|-|-|-|-|-|-|-|-|-|\n",
    );
    let mut too_far = Vec::new();
    for kind in Kind::all() {
        let mut rows: Vec<(Outcome, bool)> = Vec::new();
        for tick_rate in [1000.0, 4000.0] {
            let preset = preset(tick_rate);
            for velocity in [10.0, -10.0, 60.0, -60.0] {
                let (mut bench, outcome) = hit(&preset, kind, velocity);
                let what = format!("{} at {velocity} rad/s, {tick_rate} Hz", kind.name());
                let Some(fault) = outcome.fault else { panic!("{what}: not seen") };
                println!(
                    "{what}: {} after {:.4} s, {:.3} of {:.3} rad, braked {}, rest {}",
                    name(&fault),
                    outcome.seen,
                    outcome.way,
                    outcome.allowed,
                    outcome.braked,
                    outcome.rest
                );
                assert_eq!(bench.safety(), SafetyState::Fault(fault), "{what}");
                assert!(outcome.off, "{what}: the torque is off");
                // Only an acknowledgement restores it.
                let refused = bench.change(Change::Request(Request::Start)).unwrap_err().to_string();
                assert!(refused.contains("Acknowledge the fault first."), "{what}: {refused}");
                bench.change(Change::Request(Request::Acknowledge)).unwrap();
                assert_eq!(bench.safety(), SafetyState::Off, "{what}");
                let zero = bench.change(Change::Request(Request::Arm)).is_ok();
                assert_eq!(zero, !fault.doubts_zero(), "{what}");
                rows.push((outcome, zero));
            }
        }
        let mut seen: Vec<_> = rows.iter().filter_map(|(outcome, _)| outcome.fault.as_ref().map(name)).collect();
        seen.sort();
        seen.dedup();
        let most = |of: fn(&Outcome) -> f64| rows.iter().map(|(outcome, _)| of(outcome)).fold(0.0, f64::max);
        let (late, way, share) = (most(|o| o.seen), most(|o| o.way), most(|o| o.way / o.allowed));
        // Without a working servo amplifier or valid sensors there is no brake.
        let obeys = !matches!(kind, Kind::PowerLoss | Kind::ServoFrozen | Kind::ServoSaturated);
        let by_drive = obeys && rows.iter().any(|(outcome, _)| outcome.braked);
        assert!(!by_drive || rows.iter().all(|(outcome, _)| outcome.braked), "{}: not braked each time", kind.name());
        let stops = if by_drive { "the drive's brake" } else { "friction and short circuit" };
        let ends = match (rows.iter().any(|(o, _)| o.held), rows.iter().all(|(o, _)| o.rest || o.held)) {
            (_, false) => "**moves on**: emergency stop",
            (true, _) => "held by the drive until switched off",
            _ => "at rest without torque",
        };
        let zero = if rows.iter().all(|(_, zero)| *zero) { "kept" } else { "searched again" };
        if by_drive && share > 1.0 {
            too_far.push(format!("{}: {share} of the allowed way", kind.name()));
        }
        let _ = writeln!(
            table,
            "| `{}` | {} | {} | {late:.3} | {stops} | {way:.2} | {:.0} % | {ends} | {zero} |",
            kind.name(),
            kind.help(),
            seen.join(", "),
            100.0 * share
        );
    }
    assert!(too_far.is_empty(), "{too_far:?}");
    expect_file!["../../../../../docs/studies/safety.md"].assert_eq(&table);
}

#[test]
fn a_run_with_faults_replays_to_the_bit() {
    for kind in Kind::all() {
        let preset = preset(1000.0);
        let mut bench = FaultyBench::new(&preset, 3).unwrap();
        let mut record = Record::new(&preset, Some(3), *bench.parameters());
        let (tap, mut stream) = tap(1 << 16);
        bench.tap(tap);
        home(&mut bench, &Watch::silent()).unwrap();
        let first = bench.step(Command::default()).unwrap();
        bench.inject(Injection::new(kind, first.cycle as f64 * 1e-3 + 0.5)).unwrap();
        let mut traveller = SpeedRamp::new(first.angle, 500.0, 1e-3);
        for k in 0..2000 {
            let setpoint = traveller.toward(30.0 + 10.0 * (0.05 * f64::from(k)).sin());
            // The fault is reported from then on.
            let _ = bench.hand_over(Command { setpoint, control: true, render: true, ..Command::default() });
        }
        let _ = bench.change(Change::Request(Request::Acknowledge));
        let _ = bench.hand_over(Command::default());
        record.take(&mut stream);
        let replayed = replay(&record, &Watch::silent()).unwrap();
        assert!(replayed.identical() && replayed.machine, "{kind:?}: {replayed:?}");
        // For a remote machine the software alone.
        record.seed = None;
        let replayed = replay(&record, &Watch::silent()).unwrap();
        assert!(replayed.identical() && !replayed.machine, "{kind:?}: {replayed:?}");
    }
}

#[test]
fn in_real_time_a_fault_stops_the_bench_and_its_record_replays() {
    let preset = preset(1000.0);
    let (machine, readings) = InProcess::new(&preset, 5).unwrap();
    let machine = Faulty::new(machine, readings, preset.model.encoder, preset.bench.tick_time());
    let (tap, mut stream) = tap(1 << 16);
    let mut bench = ClockedBench::over(&preset, machine, readings, ThreadSettings::PLAIN, Some(tap)).unwrap();
    let mut record = Record::new(&preset, Some(5), *bench.parameters());
    home(&mut bench, &Watch::silent()).unwrap();
    let first = bench.step(Command::default()).unwrap();
    bench.inject(Injection::new(Kind::EncoderStuck, 0.0)).unwrap();
    let mut traveller = SpeedRamp::new(first.angle, 500.0, 1e-3);
    let move_on = |_| {
        let setpoint = traveller.toward(20.0);
        bench.hand_over(Command { setpoint, control: true, ..Command::default() }).err()
    };
    let message = (0..3000).find_map(move_on).expect("it is stopped").to_string();
    assert!(message.contains("encoder"), "{message}");
    bench.change(Change::Request(Request::Acknowledge)).unwrap();
    assert_eq!(bench.safety(), SafetyState::Off);
    bench.stop();
    record.take(&mut stream);
    let replayed = replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine, "{replayed:?}");
}

#[path = "../../../examples/no_false_alarm/scenarios.rs"]
mod scenarios;

#[test]
fn minutes_of_the_scenarios_of_the_benchmark_raise_no_false_alarm() {
    // An hour of it: cargo run --release --example no_false_alarm.
    for (preset, tick_rate, law) in [
        ("clm-bench", 4000.0, LawChoice::Bristle),
        ("clm-real", 4000.0, LawChoice::Paper),
        ("clm-soft", 1000.0, LawChoice::Paper),
    ] {
        let (time, alarms) = scenarios::run(scenarios::Case { preset, tick_rate, law, seed: 7 }).unwrap();
        assert!(alarms.is_empty() && time > 60.0, "{alarms:?}");
    }
}
