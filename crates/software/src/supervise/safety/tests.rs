//! Each fault fires where it must, and only there.

use core::f64::consts::TAU;
use std::string::ToString;

use super::*;

const DT: f64 = 250e-6;

/// Inputs of an undisturbed motion at 0.3 rad/s by the tacho.
fn calm(angle: f64) -> SafetyInput {
    SafetyInput {
        measured_angle: angle,
        measured_velocity: 0.3,
        drive_current: 0.5,
        load_current: 0.1,
        asked_load_current: 0.1,
        reference_position: angle + 0.01,
        acceleration: Some(0.0),
        ..SafetyInput::default()
    }
}

/// Running, with the screw's zero at the encoder's 40 rad.
fn running() -> Safety {
    let mut safety = Safety::new(SafetyLimits::default(), Brake::default());
    safety.request(Request::Home).unwrap();
    safety.homed(40.0);
    safety.request(Request::Start).unwrap();
    assert_eq!(safety.step(calm(41.0), DT), SafetyState::Running);
    safety
}

fn fault(safety: &Safety) -> Fault {
    safety.state().fault().unwrap_or_else(|| panic!("no fault: {:?}", safety.state()))
}

fn come_to_rest(safety: &mut Safety) {
    let ended = (0..1000).any(|_| !matches!(safety.step(calm(41.0), DT), SafetyState::Stopping(_)));
    assert!(ended, "{:?}", safety.state());
}

#[test]
fn a_calm_run_has_no_fault() {
    let mut safety = running();
    for k in 0..40_000 {
        let angle = 41.0 + (0.3 * f64::from(k) * DT / 6.28e-4).floor() * 6.28e-4;
        assert_eq!(safety.step(calm(angle), DT), SafetyState::Running);
    }
}

#[test]
fn sticking_below_breakaway_is_not_a_fault() {
    let mut safety = running();
    for _ in 0..40_000 {
        let stuck = SafetyInput { measured_velocity: 0.1, drive_current: 3.2, ..calm(41.0) };
        assert_eq!(safety.step(stuck, DT), SafetyState::Running);
    }
}

#[test]
fn a_screw_that_does_not_follow_is_a_fault() {
    let mut safety = running();
    safety.step(SafetyInput { reference_position: 42.5, ..calm(41.0) }, DT);
    assert_eq!(fault(&safety), Fault::FollowingError { error: 1.5, limit: 1.0 });
    let text = fault(&safety).to_string();
    assert!(text.contains("1.500 rad") && text.contains("1.000 rad"), "{text}");
    let mut safety = running();
    safety.step(SafetyInput { reference_position: f64::NAN, ..calm(41.0) }, DT);
    assert!(matches!(fault(&safety), Fault::FollowingError { .. }), "a non-finite set-point");
}

#[test]
fn too_fast_is_a_fault_by_the_tacho_and_by_the_encoder() {
    let mut safety = running();
    safety.step(SafetyInput { measured_velocity: -351.0, ..calm(41.0) }, DT);
    assert_eq!(fault(&safety), Fault::Overspeed { speed: 351.0, limit: 350.0 });
    let mut safety = running();
    // 0.1 rad in a cycle of 250 µs: 400 rad/s.
    safety.step(SafetyInput { measured_velocity: 300.0, ..calm(41.1) }, DT);
    assert!(matches!(fault(&safety), Fault::Overspeed { speed, .. } if (speed - 400.0).abs() < 1e-6));
    assert_eq!(safety.zero(), Some(40.0));
    let mut safety = running();
    safety.step(calm(41.1), DT);
    assert!(matches!(fault(&safety), Fault::EncoderJumped { .. }), "the tacho shows a lower speed");
    assert_eq!(safety.zero(), None);
}

#[test]
fn both_ends_of_the_stroke_are_faults() {
    for (angle, limit) in [(157.5, 157.0), (-157.5, -157.0)] {
        let mut safety = running();
        safety.monitor = Monitor::default();
        safety.step(calm(40.0 + angle), DT);
        assert!(matches!(fault(&safety), Fault::EndOfStroke { limit: end, .. } if end == limit));
    }
}

#[test]
fn a_non_finite_measurement_is_a_fault_with_its_name() {
    for bad in [f64::NAN, f64::INFINITY] {
        let broken = [
            (SafetyInput { measured_angle: bad, ..calm(41.0) }, "screw angle"),
            (SafetyInput { measured_velocity: bad, ..calm(41.0) }, "tacho velocity"),
            (SafetyInput { acceleration: Some(bad), ..calm(41.0) }, "acceleration"),
            (SafetyInput { load_current: bad, ..calm(41.0) }, "load current"),
        ];
        for (input, measurement) in broken {
            let mut safety = running();
            safety.step(input, DT);
            assert_eq!(fault(&safety), Fault::NotANumber { measurement });
            assert_eq!(safety.zero(), None, "the zero is in doubt");
        }
    }
}

#[test]
fn an_encoder_that_stands_while_current_flows_is_a_fault() {
    let frozen =
        [SafetyInput { drive_current: -9.0, ..calm(41.0) }, SafetyInput { measured_velocity: 6.0, ..calm(41.0) }];
    for input in frozen {
        let mut safety = running();
        let cycles = (1..1000).find(|_| safety.step(input, DT) != SafetyState::Running);
        // 0.05 s are 200 cycles.
        assert_eq!(cycles, Some(200));
        assert!(matches!(fault(&safety), Fault::EncoderFrozen { time, .. } if (time - 0.05).abs() < 1e-9));
        assert_eq!(safety.zero(), None);
    }
}

#[test]
fn a_failed_homing_is_a_fault() {
    let mut safety = Safety::new(SafetyLimits::default(), Brake::default());
    safety.request(Request::Home).unwrap();
    safety.homing_failed(HomingFault::NoIndex { travel: 9.5 });
    assert_eq!(fault(&safety), Fault::Homing(HomingFault::NoIndex { travel: 9.5 }));
    assert!(!safety.state().allows_torque());
}

#[test]
fn the_first_fault_stays_until_it_is_acknowledged() {
    let mut safety = running();
    safety.step(SafetyInput { measured_velocity: 400.0, ..calm(41.0) }, DT);
    let first = fault(&safety);
    safety.step(SafetyInput { drive_current: 1e3, ..calm(41.0) }, DT);
    assert_eq!(safety.state(), SafetyState::Stopping(Some(first)));
    come_to_rest(&mut safety);
    assert_eq!(fault(&safety), first);
    let refusal = safety.request(Request::Start).unwrap_err();
    assert_eq!((refusal.request, refusal.state), (Request::Start, SafetyState::Fault(first)));
    assert_eq!(safety.request(Request::Acknowledge), Ok(SafetyState::Off));
    // Overspeed does not affect the zero: no new homing is needed.
    assert_eq!(safety.request(Request::Arm), Ok(SafetyState::Ready));
}

#[test]
fn torque_needs_homing_and_a_start() {
    let mut safety = Safety::new(SafetyLimits::default(), Brake::default());
    assert!(!safety.state().allows_torque());
    for request in [Request::Arm, Request::Start, Request::Stop, Request::Acknowledge] {
        let refusal = safety.request(request).unwrap_err();
        assert_eq!(refusal.state, SafetyState::Off, "{}", refusal.remedy);
    }
    safety.homed(1.0);
    assert_eq!((safety.state(), safety.zero()), (SafetyState::Off, None), "homing was not requested");
    assert!(safety.request(Request::Home).unwrap().allows_torque());
    assert!(safety.request(Request::Start).is_err(), "the zero is not known yet");
    safety.homed(1.0);
    assert_eq!(safety.state(), SafetyState::Ready);
    assert!(!safety.state().allows_torque());
    assert!(safety.request(Request::Start).unwrap().allows_torque());
    assert!(safety.request(Request::Home).is_err() && safety.request(Request::Arm).is_err());
    assert_eq!(safety.request(Request::Stop), Ok(SafetyState::Ready));
    assert_eq!(safety.request(Request::Off), Ok(SafetyState::Off));
}

#[test]
fn switched_off_nothing_is_supervised() {
    let mut safety = Safety::new(SafetyLimits::default(), Brake::default());
    let wild = SafetyInput { measured_angle: f64::NAN, measured_velocity: 1e9, ..calm(0.0) };
    assert_eq!(safety.step(wild, DT), SafetyState::Off);
}

/// Runs at a velocity [rad/s] of both sensors; `disturb` changes the inputs as a function of the time [s]. Returns the
/// time at which the bench stopped.
fn cruise(velocity: f64, seconds: f64, mut disturb: impl FnMut(f64, &mut SafetyInput)) -> (Safety, f64) {
    let mut safety = Safety::new(SafetyLimits { upper_end: 1e5, ..SafetyLimits::default() }, Brake::default());
    safety.request(Request::Home).unwrap();
    safety.homed(0.0);
    safety.request(Request::Start).unwrap();
    for k in 0..(seconds / DT) as u32 {
        let time = f64::from(k) * DT;
        let angle = velocity * time;
        let before = velocity * (time - DT);
        let pulse = (angle / TAU).floor() > (before / TAU).floor();
        let index = pulse.then_some((angle / TAU).floor() * TAU);
        let mut input = SafetyInput { measured_velocity: velocity, index, ..calm(angle) };
        disturb(time, &mut input);
        if safety.step(input, DT) != SafetyState::Running {
            return (safety, time);
        }
    }
    (safety, seconds)
}

#[test]
fn cruising_is_not_a_fault() {
    let (safety, _) = cruise(30.0, 20.0, |_, _| {});
    assert_eq!(safety.state(), SafetyState::Running);
}

#[test]
fn different_speeds_of_tacho_and_encoder_are_a_fault_after_the_allowed_time() {
    let (safety, time) = cruise(30.0, 3.0, |time, input| input.measured_velocity *= if time > 1.0 { 0.7 } else { 1.0 });
    assert!(matches!(fault(&safety), Fault::SensorsApart { .. }));
    assert!((1.05..1.06).contains(&time), "{time}");
    assert!(safety.zero().is_none());
    // At low speed they may differ by the velocity above which the encoder must count.
    let (safety, _) = cruise(8.0, 3.0, |_, input| input.measured_velocity *= 0.5);
    assert_eq!(safety.state(), SafetyState::Running);
}

#[test]
fn an_index_pulse_off_a_whole_revolution_reports_lost_counts() {
    let shift = |by: f64| {
        cruise(30.0, 3.0, move |time, input| {
            if time > 1.0 {
                input.index = input.index.map(|index| index + by);
            }
        })
    };
    let (safety, time) = shift(0.03);
    assert!(matches!(fault(&safety), Fault::CountsLost { deviation, .. } if (deviation - 0.03).abs() < 1e-9));
    assert!(time < 1.0 + TAU / 30.0, "within a revolution: {time}");
    assert_eq!(shift(0.01).0.state(), SafetyState::Running);
}

#[test]
fn a_revolution_without_an_index_pulse_is_a_fault_unless_ticks_were_missed() {
    let mute = |missed: u64| {
        cruise(30.0, 3.0, move |time, input| {
            if time > 1.0 {
                (input.index, input.missed) = (None, missed);
            }
        })
    };
    assert!(matches!(fault(&mute(0).0), Fault::IndexMissing { travel } if (7.28..7.3).contains(&travel)));
    assert_eq!(mute(1).0.state(), SafetyState::Running, "it may have come meanwhile");
}

#[test]
fn without_a_tacho_an_estimated_velocity_is_not_compared_with_the_encoder() {
    let apart = |acceleration: Option<f64>| {
        cruise(30.0, 1.0, move |_, input| {
            input.acceleration = acceleration;
            input.measured_velocity = 0.0;
        })
    };
    assert!(matches!(fault(&apart(Some(0.0)).0), Fault::SensorsApart { .. }));
    assert_eq!(apart(None).0.state(), SafetyState::Running);
}

#[test]
fn an_accelerometer_that_jumps_is_a_fault_and_one_that_drifts_is_not() {
    let with = |offset: fn(f64) -> f64| cruise(30.0, 3.0, move |time, input| input.acceleration = Some(offset(time)));
    let (safety, time) = with(|time| if time > 1.0 { 700.0 } else { 100.0 });
    assert!(matches!(fault(&safety), Fault::Accelerometer { .. }));
    // 0.02 s until 400 of 600 rad/s² have come through a lag of 0.02 s, and as long again.
    assert!((1.03..1.06).contains(&time), "{time}");
    assert_eq!(with(|time| 200.0 * time).0.state(), SafetyState::Running);
}

#[test]
fn an_acceleration_of_both_sensors_is_not_a_fault() {
    let mut safety = running();
    for k in 0..4000 {
        let (time, rate) = (f64::from(k) * DT, 40.0);
        let (angle, velocity) = (41.5 - 0.5 * (rate * time).cos(), 20.0 * (rate * time).sin());
        let acceleration = 800.0 * (rate * time).cos();
        safety.step(SafetyInput { measured_velocity: velocity, acceleration: Some(acceleration), ..calm(angle) }, DT);
        assert_eq!(safety.state(), SafetyState::Running, "{time}");
    }
}

#[test]
fn a_load_current_of_the_wrong_sign_is_a_fault() {
    let (safety, time) = cruise(30.0, 2.0, |time, input| {
        input.asked_load_current = 2.5;
        input.load_current = if time > 1.0 { -2.5 } else { 2.5 };
    });
    assert!(matches!(fault(&safety), Fault::LoadCurrent { .. }));
    assert!((1.02..1.04).contains(&time) && safety.braking().unwrap().shorted, "{time}");
}

#[test]
fn both_motors_are_guarded_against_too_much_current_and_against_heat() {
    type Put = fn(&mut SafetyInput, f64);
    let motors: [(&str, Put, f64); 2] = [
        ("drive", |input, current| input.drive_current = current, 10.0),
        ("load", |input, current| (input.load_current, input.asked_load_current) = (current, current), 8.0),
    ];
    for (name, put, continuous) in motors {
        let peak = fault(&cruise(10.0, 1.0, |_, input| put(input, -51.0)).0);
        assert!(matches!(peak, Fault::Overcurrent { motor, current: -51.0, .. } if motor == name));
        let (warm, time) = cruise(10.0, 60.0, |_, input| put(input, 2.0 * continuous));
        assert!(matches!(fault(&warm), Fault::Overheated { motor, .. } if motor == name));
        // 1 − e^(−t/T) = 1/4.
        assert!((time - 30.0 * (4.0_f64 / 3.0).ln()).abs() < 0.01, "{time}");
        // It is still braked, and an acknowledgement does not reset the temperature.
        let mut warm = warm;
        assert!(warm.braking().is_some_and(|braking| braking.torque < 0.0));
        warm.zero = None;
        warm.state = SafetyState::Fault(fault(&warm));
        warm.request(Request::Acknowledge).unwrap();
        warm.request(Request::Home).unwrap();
        let mut input = calm(0.0);
        put(&mut input, continuous);
        assert!(matches!(warm.step(input, DT), SafetyState::Stopping(Some(Fault::Overheated { .. }))));
        let (cool, _) = cruise(10.0, 120.0, |_, input| put(input, 0.99 * continuous));
        assert_eq!(cool.state(), SafetyState::Running);
    }
}

#[test]
fn a_screw_is_braked_before_its_stroke_ends() {
    // 60 rad/s take 60²/(2·600) = 3 rad.
    let towards = |angle: f64, velocity: f64| {
        let mut safety = running();
        safety.monitor = Monitor::default();
        safety.step(SafetyInput { measured_velocity: velocity, ..calm(40.0 + angle) }, DT)
    };
    assert_eq!(towards(153.9, 60.0), SafetyState::Running);
    assert!(matches!(towards(154.1, 60.0).fault(), Some(Fault::EndOfStroke { limit: 157.0, .. })));
    assert!(matches!(towards(-154.1, -60.0).fault(), Some(Fault::EndOfStroke { limit: -157.0, .. })));
    assert_eq!(towards(154.1, -60.0), SafetyState::Running, "away from the end");
}

/// A rigid screw of 1.01e-3 kg m² under the brake: state at the end, distance [rad] and largest torque [N m].
fn stopped(speed: f64, push: f64, see: impl Fn(f64, &mut SafetyInput)) -> (SafetyState, f64, f64) {
    let mut safety = Safety::new(SafetyLimits { following_error: 0.5, ..SafetyLimits::default() }, Brake::default());
    safety.request(Request::Home).unwrap();
    safety.homed(0.0);
    safety.request(Request::Start).unwrap();
    let (mut angle, mut velocity, mut torque) = (0.0, speed, 0.0);
    let (mut way, mut most) = (0.0, 0.0_f64);
    for k in 0..8000 {
        let time = f64::from(k) * DT;
        if k >= 200 {
            velocity += (torque + push) / 1.01e-3 * DT;
            way += velocity * DT;
            most = most.max(torque.abs());
        }
        angle += velocity * DT;
        let reference_position = if k < 200 { angle } else { angle + 1.0 };
        let mut input = SafetyInput { measured_velocity: velocity, ..calm(angle) };
        input.reference_position = reference_position;
        see(time, &mut input);
        let state = safety.step(input, DT);
        torque = safety.braking().map_or(0.0, |braking| braking.torque);
        if let SafetyState::Fault(_) = state {
            return (state, way, most);
        }
    }
    (safety.state(), way, most)
}

#[test]
fn the_brake_stops_within_its_deceleration_by_either_sensor_and_against_a_push() {
    for speed in [3.0_f64, -30.0, 90.0] {
        let allowed = |two_ticks: f64| 0.5 * speed * speed / 600.0 + speed.abs() * two_ticks;
        let (state, way, most) = stopped(speed, 0.0, |_, _| {});
        assert!(matches!(state, SafetyState::Fault(Fault::FollowingError { .. })), "{state:?}");
        // At the end the torque is K_b·Ω, without friction: a time constant J/K_b of 10 ms.
        assert!(way.abs() < allowed(2.0 * DT) + 0.01 * speed.abs(), "{speed}: {way}");
        assert!(most < 1.1 * 1.25 * 1.01e-3 * 600.0, "{most}");
        let blind = |time: f64, input: &mut SafetyInput| {
            if time >= 0.05 {
                input.measured_velocity = f64::NAN;
            }
        };
        let (state, way, _) = stopped(speed, 0.0, blind);
        assert!(matches!(state, SafetyState::Fault(Fault::NotANumber { .. })), "{state:?}");
        assert!(way.abs() < allowed(2.0 * DT) + 0.03 * speed.abs(), "{speed}: {way}");
        // The integral takes 50 ms until it holds the push, which alone takes half of the brake's deceleration. In the
        // 2 s of the run the held screw creeps at a third of a rad/s.
        let (_, way, most) = stopped(speed, 0.4 * speed.signum(), |_, _| {});
        assert!(way.abs() < 1.5 * allowed(2.0 * DT) + 0.9 + 0.02 * speed.abs() && most <= 1.4, "{speed}: {way}");
    }
}

#[test]
fn a_push_is_held_until_the_operator_switches_off() {
    let (state, way, _) = stopped(30.0, 0.7, |_, _| {});
    assert!(matches!(state, SafetyState::Stopping(Some(Fault::FollowingError { .. }))), "{state:?}");
    // In 2 s the torque is slowly released, and the screw creeps.
    assert!(way < 3.0, "{way}");
    let mut safety = running();
    safety.step(SafetyInput { measured_velocity: 400.0, ..calm(41.0) }, DT);
    let first = fault(&safety);
    assert_eq!(safety.request(Request::Off), Ok(SafetyState::Fault(first)), "no torque, the fault stays");
    assert_eq!(safety.braking(), None);
}

#[test]
fn without_a_sensor_or_with_an_accelerating_brake_the_torque_is_switched_off_at_once() {
    let (state, _, most) = stopped(30.0, 0.0, |time, input| {
        if time >= 0.05 {
            (input.measured_velocity, input.measured_angle) = (f64::NAN, f64::NAN);
        }
    });
    assert!(matches!(state, SafetyState::Fault(Fault::NotANumber { .. })) && most == 0.0, "{state:?} {most}");
    // The load pushes harder than the drive can hold.
    let (state, way, _) = stopped(30.0, 3.0, |_, _| {});
    assert!(matches!(state, SafetyState::Fault(Fault::FollowingError { .. })) && way < 1.0, "{state:?} {way}");
}

#[test]
fn a_screw_that_is_slow_once_after_missed_ticks_is_not_at_rest_and_is_braked() {
    let mut safety = running();
    for k in 0..400 {
        safety.step(SafetyInput { measured_velocity: 8.0, ..calm(41.0 + 8.0 * DT * f64::from(k)) }, DT);
    }
    let missed = 100;
    let slow = SafetyInput { measured_velocity: 0.2, missed, ..calm(41.8) };
    let state = safety.step(slow, DT * (missed + 1) as f64);
    assert!(matches!(state, SafetyState::Stopping(Some(Fault::TicksMissed { .. }))), "{state:?}");
    assert!(safety.braking().is_some());
    // After the standstill time at low speed it is at rest.
    let stands = (0..200).find(|_| !matches!(safety.step(calm(41.8), DT), SafetyState::Stopping(_)));
    let ticks = safety.limits().standstill_time / DT;
    assert!(stands.is_some_and(|k| f64::from(k) > ticks - 3.0), "{stands:?} of {ticks}");
}
