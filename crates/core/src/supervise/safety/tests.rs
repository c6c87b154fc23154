//! Each fault where it must fire, and only there.

use std::string::ToString;

use super::*;

const DT: f64 = 250e-6;

/// Quietly following its set-point at 0.3 rad/s: a count now and then.
fn calm(angle: f64) -> SafetyInput {
    SafetyInput {
        measured_angle: angle,
        measured_velocity: 0.3,
        drive_current: 0.5,
        load_current: 0.1,
        reference_position: angle + 0.01,
    }
}

/// Running, with the screw's zero at the encoder's 40 rad.
fn running() -> Safety {
    let mut safety = Safety::new(SafetyLimits::default());
    safety.request(Request::Home).unwrap();
    safety.homed(40.0);
    safety.request(Request::Start).unwrap();
    assert_eq!(safety.step(calm(41.0), DT), SafetyState::Running);
    safety
}

fn fault(safety: &Safety) -> Fault {
    match safety.state() {
        SafetyState::Fault(fault) => fault,
        state => panic!("no fault: {state:?}"),
    }
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
fn sticking_below_breakaway_is_no_fault() {
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
    assert!(matches!(fault(&safety), Fault::FollowingError { .. }), "a set-point that is no number");
}

#[test]
fn too_fast_is_a_fault_by_the_tacho_and_by_the_encoder() {
    let mut safety = running();
    safety.step(SafetyInput { measured_velocity: -351.0, ..calm(41.0) }, DT);
    assert_eq!(fault(&safety), Fault::Overspeed { speed: 351.0, limit: 350.0 });
    let mut safety = running();
    // 0.1 rad in a cycle of 250 µs: 400 rad/s.
    safety.step(calm(41.1), DT);
    assert!(matches!(fault(&safety), Fault::Overspeed { speed, .. } if (speed - 400.0).abs() < 1e-6));
}

#[test]
fn both_ends_of_the_stroke_are_faults() {
    for (angle, limit) in [(157.5, 157.0), (-157.5, -157.0)] {
        let mut safety = running();
        safety.previous = None;
        safety.step(calm(40.0 + angle), DT);
        assert_eq!(fault(&safety), Fault::EndOfStroke { angle, limit });
    }
}

#[test]
fn a_measurement_that_is_no_number_is_a_fault_and_named() {
    for bad in [f64::NAN, f64::INFINITY] {
        let broken = [
            (SafetyInput { measured_angle: bad, ..calm(41.0) }, "screw angle"),
            (SafetyInput { measured_velocity: bad, ..calm(41.0) }, "tacho velocity"),
            (SafetyInput { drive_current: bad, ..calm(41.0) }, "drive current"),
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
    let mut safety = Safety::new(SafetyLimits::default());
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
    safety.step(SafetyInput { measured_angle: f64::NAN, ..calm(41.0) }, DT);
    assert_eq!(fault(&safety), first);
    let refusal = safety.request(Request::Start).unwrap_err();
    assert_eq!((refusal.request, refusal.state), (Request::Start, SafetyState::Fault(first)));
    assert_eq!(safety.request(Request::Acknowledge), Ok(SafetyState::Off));
    // Overspeed leaves the zero: no new homing.
    assert_eq!(safety.request(Request::Arm), Ok(SafetyState::Ready));
}

#[test]
fn torque_needs_homing_and_a_start() {
    let mut safety = Safety::new(SafetyLimits::default());
    assert!(!safety.state().allows_torque());
    for request in [Request::Arm, Request::Start, Request::Stop, Request::Acknowledge] {
        let refusal = safety.request(request).unwrap_err();
        assert_eq!(refusal.state, SafetyState::Off, "{}", refusal.remedy);
    }
    safety.homed(1.0);
    assert_eq!((safety.state(), safety.zero()), (SafetyState::Off, None), "nobody asked for it");
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
    let mut safety = Safety::new(SafetyLimits::default());
    let wild = SafetyInput { measured_angle: f64::NAN, measured_velocity: 1e9, ..calm(0.0) };
    assert_eq!(safety.step(wild, DT), SafetyState::Off);
}

#[test]
fn a_stroke_without_length_is_refused() {
    let limits = SafetyLimits { lower_end: 1.0, upper_end: -1.0, ..SafetyLimits::<f64>::default() };
    assert_eq!(
        limits.law()[0].check().map_err(|error| (error.field, error.value, error.bound)),
        Err(("upper_end", -1.0, 1.0))
    );
}
