//! The same in real time: real faults in a separate process, without waiting.
//!
//! On a busy machine a controller may lose the processor for longer than a sample, which is a fault as well: then the
//! run is repeated. No time is asserted except by cycles of the bench.

use super::*;
use stickslip::ControllerChoice;
use stickslip::bench::tap::tap;
use stickslip::bench::{Change, ClockedBench, Frame, Request, SpeedRamp, ThreadSettings};
use stickslip::load::load_in_real_time;
use stickslip_software::supervise::{Fault, SafetyState};

/// A slow tick, some of which may be missed, and a sample of four ticks, with a controller as soft as that permits.
fn slow() -> Preset<f64> {
    let mut preset = preset();
    preset.bench.tick_rate = 1000.0;
    preset.bench.control_divider = 4.0;
    preset.bench.safety.missed_ticks = 50.0;
    preset.bench.safety.following_error = 10.0;
    let ControllerChoice::Cascade(cascade) = &mut preset.bench.controller else { panic!("it is a cascade") };
    (cascade.position_gain, cascade.velocity_gain, cascade.integral_gain) = (8.0, 0.04, 0.4);
    preset
}

/// As stiff as samples of 4 ms permit.
fn faulty(folder: &Path, fault: usize) -> PathBuf {
    compiled(
        folder,
        "tests/laboratory/loaded/faults.c",
        &[&format!("-DFAULT={fault}"), "-DSTIFFNESS=1.0", "-DDAMPING=0.03", "-DFRICTION=0.2"],
    )
}

/// Moves the axis with an external controller until a fault has stopped it, other than one of a busy machine unless
/// that is expected: the fault's message, and all cycles.
fn fallen(
    bench: &mut ClockedBench,
    external: External,
    stream: &mut stickslip::bench::tap::Stream,
) -> (String, Vec<Frame>) {
    bench.bring(external).expect("it starts");
    let angle = bench.step(Order::default()).expect("there is no fault yet").angle;
    while stream.sample().is_some() {}
    let mut traveller = SpeedRamp::new(angle, 200.0, 1e-3);
    let ended = (0..4000).find_map(|_| {
        let order = Order { setpoint: traveller.toward(12.0), control: true, ..Order::default() };
        bench.hand_over(order).err()
    });
    assert!(matches!(ended, Some(Error::BenchFault { .. })), "{ended:?}");
    let fault = bench.named_fault().expect("the loop runs").expect("supervision has stopped it");
    let frames = std::iter::from_fn(|| stream.sample()).map(|sample| sample.frame).collect();
    (fault.to_string(), frames)
}

/// Way from the start of the sample without an answer to standstill, and its limit [rad].
fn way(frames: &[Frame], preset: &Preset<f64>) -> (f64, f64) {
    let dt = preset.bench.tick_time();
    let first = frames.iter().position(|frame| frame.safety.fault().is_some()).expect("there is a fault");
    // Its sample started after the first cycle of the last torque.
    let torque = |index: usize| frames[index].command.added_torque;
    let onset = (1..first).rev().find(|&index| torque(index) != torque(index - 1)).unwrap_or(0);
    let rest = frames.iter().position(|frame| matches!(frame.safety, SafetyState::Fault(_))).expect("it stands");
    let speed = |frame: &Frame| frame.signals.measured_motor_velocity.abs();
    let fastest = frames[onset..=rest].iter().map(speed).fold(0.0, f64::max);
    // As in the study of all faults: the way of the brake, the way until it starts, and the twist of the coupling.
    let (deceleration, drive) = (preset.bench.safety.stop_deceleration, &preset.model.drive);
    let twist = 2.0 * drive.load_inertia * deceleration / drive.coupling_stiffness;
    let late = (2 + first - onset) as f64 * dt + preset.model.drive_lag;
    let allowed = 0.5 * fastest * fastest / deceleration + fastest * late + twist;
    ((frames[rest].angle - frames[onset].angle).abs(), allowed)
}

#[test]
fn each_fault_in_real_time_is_named_and_braked_and_the_bench_continues() {
    let preset = slow();
    let (tap, mut stream) = tap(1 << 16);
    let mut bench = ClockedBench::virtual_machine(&preset, 1, ThreadSettings::PLAIN, Some(tap)).unwrap();
    stickslip::bench::home(&mut bench, &Watch::silent()).unwrap();
    const LATE: &str = "ms after the start of its sample";
    let messages = [
        (0, false, "signal 11, invalid memory access"),
        (1, false, LATE),
        (2, false, "torque is not finite"),
        (2, true, "torque is not finite"),
        (4, false, "reported a failure (code 7)"),
        (4, true, "reported a failure (code 7)"),
        (5, false, "changed the rounding of floating-point numbers"),
        (5, true, "changed the rounding of floating-point numbers"),
        (6, false, "exited (exit code 3)"),
        (8, false, LATE),
    ];
    for (fault, trusted, message) in messages {
        let folder = tempfile::tempdir().unwrap();
        let library = faulty(folder.path(), fault);
        let mut tries = 0;
        loop {
            // Longer than its delay, and than the wait for its reason.
            let patience = Duration::from_secs(1);
            let mut external = if trusted {
                External::trusted(&library, Role::Controller).unwrap()
            } else {
                External::in_own_process_within(&library, Role::Controller, &here(), patience).unwrap()
            };
            external.set("sample", 30.0).unwrap();
            let (reason, frames) = fallen(&mut bench, external, &mut stream);
            let mut right = reason.contains(message);
            if right {
                let (way, allowed) = way(&frames, &preset);
                println!("{fault} {trusted}: {way:.3} of {allowed:.3} rad, at try {tries}");
                assert!(way <= allowed, "{fault}: {way} of {allowed} rad");
            }
            if right && fault == 1 {
                // An endless loop is ended, and then its reason is known, unless it was late before.
                let silent = Fault::External(Role::Controller, ExternalFault::Silent { time: 1.0 });
                let named = (0..2000).any(|_| {
                    std::thread::sleep(Duration::from_millis(5));
                    bench.refresh().unwrap();
                    bench.safety().fault() == Some(silent)
                });
                right = named;
            }
            if right && !reason.contains(LATE) {
                let moved = frames.iter().any(|frame| frame.signals.measured_motor_velocity > 5.0);
                assert!(moved, "{fault}: it moved");
            }
            let guest = bench.take_back(&preset.bench).unwrap().expect("the bench has the controller");
            let (calls, _) = guest.external().durations();
            assert!(calls.count >= 30 || reason.contains(LATE), "{fault}: {calls:?}");
            bench.change(Change::Request(Request::Acknowledge)).unwrap();
            bench.change(Change::Request(Request::Arm)).unwrap();
            bench.change(Change::Request(Request::Start)).unwrap();
            bench.come_to_rest().unwrap();
            if right {
                break;
            }
            tries += 1;
            assert!(reason.contains(LATE) && tries < 40, "{fault} {trusted}: {reason}");
        }
        // The preset's own controller moves it back.
        let angle = bench.step(Order::default()).unwrap().angle;
        let mut traveller = SpeedRamp::new(angle, 200.0, 1e-3);
        for _ in 0..200 {
            let order = Order { setpoint: traveller.toward(-12.0), control: true, ..Order::default() };
            bench.hand_over(order).unwrap();
        }
        bench.come_to_rest().unwrap();
    }
    assert!(FloatingPoint::standard().was_standard());
}

#[test]
fn a_controller_that_keeps_up_is_followed() {
    let preset = slow();
    let folder = tempfile::tempdir().unwrap();
    let library = faulty(folder.path(), 9);
    let mut bench = ClockedBench::virtual_machine(&preset, 1, ThreadSettings::PLAIN, None).unwrap();
    for tries in 0.. {
        stickslip::bench::home(&mut bench, &Watch::silent()).unwrap();
        bench.come_to_rest().unwrap();
        bench.bring(External::in_own_process(&library, Role::Controller, &here()).unwrap()).unwrap();
        let angle = bench.step(Order::default()).unwrap().angle;
        let mut traveller = SpeedRamp::new(angle, 200.0, 1e-3);
        let mut torques = 0;
        let ended = (0..160).try_for_each(|_| {
            let order = Order { setpoint: traveller.toward(8.0), control: true, ..Order::default() };
            let frame = bench.hand_over(order)?;
            torques += u32::from(frame.is_some_and(|frame| frame.command.added_torque != 0.0));
            Ok(())
        });
        let ended =
            ended.and_then(|()| bench.drain(&mut |frame| torques += u32::from(frame.command.added_torque != 0.0)));
        let guest = bench.take_back(&preset.bench).unwrap().expect("the bench has the controller");
        let ((calls, _), responses) = (guest.external().durations(), guest.external().responses());
        match ended {
            Ok(()) if guest.lateness().1 == 0 => {
                // All but those that the first and the last sample lack.
                assert!(torques >= 150 && calls.count >= 38, "{torques} {calls:?}");
                assert!(responses.count == calls.count && responses.p50 > calls.p50, "{calls:?} {responses:?}");
                return;
            }
            Ok(()) if tries < 40 => {}
            Err(Error::BenchFault { reason, .. }) if reason.contains("was not there") && tries < 40 => {
                assert!(guest.lateness().1 >= 1);
                bench.change(Change::Request(Request::Acknowledge)).unwrap();
            }
            other => panic!("{other:?}"),
        }
        bench.change(Change::Request(Request::Off)).unwrap();
    }
}

#[test]
fn manoeuvres_in_real_time_replay_without_the_controller() {
    let folder = tempfile::tempdir().unwrap();
    let library = compiled(folder.path(), EXAMPLE, &[]);
    let run = folder.path().join("run.mf4");
    let mut external = External::in_own_process(&library, Role::Controller, &here()).unwrap();
    for (name, value) in [("position_gain", 6.0), ("velocity_gain", 0.03), ("integral_time", 0.2)] {
        external.set(name, value).unwrap();
    }
    let loaded =
        load_in_real_time(&slow(), external, 0.0, 3, Some(&run), ThreadSettings::PLAIN, &Watch::silent()).unwrap();
    let replayed = replay(&Record::read(&run).unwrap(), &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed}");
    let value = |name: &str| loaded.summary().value(name);
    assert!(value("own.sine_0.5hz.rms").is_some(), "the bench continues");
    assert_eq!(value("response.allowed"), Some(3e-3));
    assert!(value("timing.cycles").is_some_and(|cycles| cycles > 1000.0));
    let remarks = loaded.remarks().join(" ");
    assert!(remarks.contains("In real time its torque was ready after"), "{remarks}");
    println!("{remarks}");
    // On a busy machine it may have been late.
    let reason = loaded.fault.as_deref().unwrap_or("was not there");
    assert!(reason.contains("was not there"), "{reason}");
    assert!(value("response.late") >= value("fault"));
    assert_ne!(value("controller.sine_0.5hz.rms").is_some(), loaded.fault.is_some());
}
