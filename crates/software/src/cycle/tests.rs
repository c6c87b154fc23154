use super::*;
use crate::supervise::{Fault, Role};
use stickslip_core::control::{Cascade, PositionController};

const DT: f64 = 1e-3;

fn limits() -> SafetyLimits<f64> {
    // The encoder is constant in these tests, for any torque of the drive.
    SafetyLimits { following_error: 1e3, moving_current: 1e9, missed_ticks: 100.0, ..SafetyLimits::default() }
}

fn software() -> Software {
    let parameters = Parameters { safety: limits(), drive_torque_constant: 0.1, ..Parameters::default() };
    Software::new(parameters, DT)
}

/// Homed at an encoder angle [rad], with torque.
fn running(zero: f64) -> Software {
    let mut software = software();
    software.change(&Change::Request(Request::Home)).unwrap();
    software.change(&Change::Homed(zero)).unwrap();
    software.change(&Change::Request(Request::Start)).unwrap();
    software
}

fn moving(position: f64, velocity: f64) -> Command {
    Command { setpoint: Setpoint { position, velocity, acceleration: 0.0 }, control: true, ..Command::default() }
}

#[test]
fn without_a_command_the_set_point_comes_to_rest_and_stays() {
    let mut software = running(0.0);
    let led = Command { added_torque: 0.1, added_load_torque: 0.2, render: true, ..moving(1.0, -30.0) };
    software.step(Measurement::default(), Some(led));
    let mut last = led.setpoint;
    for _ in 0..200 {
        let frame = software.step(Measurement::default(), None);
        let now = frame.command.setpoint;
        assert!(frame.command.control && frame.command.render, "control and law stay");
        assert_eq!((frame.command.added_torque, frame.command.added_load_torque), (0.0, 0.0));
        assert!((now.velocity - last.velocity).abs() <= limits().stop_deceleration * DT * (1.0 + 1e-12));
        assert!(now.velocity <= 0.0 && now.velocity >= last.velocity && now.position <= last.position);
        last = now;
    }
    // 30 rad/s with 600 rad/s² take 50 ms and 30²/(2·600) rad.
    assert_eq!((last.velocity, last.acceleration), (0.0, 0.0));
    assert!((last.position - (1.0 - 0.75)).abs() < 1e-12, "{}", last.position);
}

#[test]
fn the_held_set_point_does_not_jump_when_the_zero_is_found_or_lost() {
    let mut software = software();
    software.change(&Change::Request(Request::Home)).unwrap();
    software.step(Measurement::default(), Some(moving(3.0, 0.0)));
    software.change(&Change::Homed(1.0)).unwrap();
    software.change(&Change::Request(Request::Start)).unwrap();
    let held = software.step(Measurement::default(), None).command;
    assert_eq!((held.setpoint.position, held.control), (2.0, true), "the encoder's 3 rad, as before");
}

#[test]
fn a_bench_that_had_no_torque_waits_for_a_command() {
    let mut software = running(0.0);
    software.step(Measurement::default(), Some(moving(1.0, 0.0)));
    software.change(&Change::Request(Request::Stop)).unwrap();
    assert_eq!(software.step(Measurement::default(), None).signals.commanded_torque, 0.0);
    software.change(&Change::Request(Request::Start)).unwrap();
    assert!(!software.step(Measurement::default(), None).command.control);
}

#[test]
fn a_fault_takes_the_motors_from_the_command_in_its_own_tick_until_it_is_acknowledged() {
    let mut software = running(0.0);
    let pushes = Command { added_torque: 0.5, added_load_torque: 0.1, ..Command::default() };
    software.step(Measurement::default(), Some(pushes));
    assert!(software.voltages().servo_voltage > 0.0 && software.voltages().amplifier_voltage != 0.0);
    let frame = software.step(Measurement { tacho_voltage: f64::NAN, ..Measurement::default() }, Some(pushes));
    assert_eq!(frame.safety, SafetyState::Stopping(Some(Fault::NotANumber { measurement: "tacho velocity" })));
    assert_eq!(software.voltages(), Voltages::default(), "by the encoder it stands");
    let refused = |software: &mut Software, request| software.change(&Change::Request(request)).unwrap_err().remedy;
    assert_eq!(refused(&mut software, Request::Acknowledge), "Wait until it has come to rest.");
    let states: std::vec::Vec<_> =
        (0..25).map(|_| software.step(Measurement::default(), Some(pushes)).safety).collect();
    assert!(matches!(states[17], SafetyState::Stopping(_)) && matches!(states[19], SafetyState::Fault(_)));
    assert_eq!(software.voltages(), Voltages::default());
    assert_eq!(refused(&mut software, Request::Start), "Acknowledge the fault first.");
    software.change(&Change::Request(Request::Acknowledge)).unwrap();
    assert_eq!(software.safety().state(), SafetyState::Off);
    assert_eq!(software.step(Measurement::default(), Some(pushes)).signals.commanded_torque, 0.0);
}

/// Readings of a screw that turns at this velocity [rad/s], at tick k.
fn turning(velocity: f64, k: u32) -> Measurement<f64> {
    let counts = (velocity * f64::from(k) * DT / core::f64::consts::TAU * 1e4).floor();
    Measurement { count: counts.rem_euclid(65_536.0), tacho_voltage: 0.0287 * velocity, ..Measurement::default() }
}

#[test]
fn the_operators_stop_brakes_against_the_motion_and_leaves_the_bench_ready() {
    for velocity in [40.0, -40.0] {
        let mut software = running(0.0);
        for k in 0..50 {
            software.step(turning(velocity, k), None);
        }
        software.change(&Change::Request(Request::Stop)).unwrap();
        let pushes = Command { added_torque: velocity, added_load_torque: 0.3, render: true, ..Command::default() };
        let frame = software.step(turning(velocity, 50), Some(pushes));
        assert_eq!(frame.safety, SafetyState::Stopping(None));
        // 1.25 · 1.01e-3 kg m² · 600 rad/s² = 0.76 N m, and 0.06 N m by the ramp of one tick.
        let torque = frame.signals.commanded_torque;
        assert!(torque * velocity < 0.0 && (0.75..0.9).contains(&torque.abs()), "{torque}");
        assert!((software.voltages().servo_voltage * 0.14 - torque).abs() < 1e-12);
        assert_eq!(frame.signals.difference_torque, 0.0, "no law, no added torque");
        // The screw is at rest.
        let states: std::vec::Vec<_> = {
            let stands = Measurement { tacho_voltage: 0.0, ..turning(velocity, 50) };
            (0..30).map(|_| software.step(stands, Some(pushes)).safety).collect()
        };
        assert_eq!(states[29], SafetyState::Ready);
        assert_eq!(software.voltages().servo_voltage, 0.0);
    }
}

#[test]
fn a_non_finite_controller_is_a_fault_and_it_restarts_after_the_acknowledgement() {
    let mut software = running(0.0);
    software.step(Measurement::default(), Some(moving(0.0, 0.0)));
    software.spoil_controller();
    let frame = software.step(Measurement::default(), Some(moving(0.0, 0.0)));
    assert_eq!(frame.safety.fault(), Some(Fault::Computed { block: "position controller" }));
    assert_eq!(frame.signals.servo_voltage, 0.0);
    for _ in 0..30 {
        software.step(Measurement::default(), Some(moving(0.0, 0.0)));
    }
    for request in [Request::Acknowledge, Request::Arm, Request::Start] {
        software.change(&Change::Request(request)).unwrap();
    }
    let frame = software.step(Measurement::default(), Some(moving(0.0, 0.0)));
    assert_eq!(frame.safety, SafetyState::Running);
}

#[test]
fn a_bench_without_commands_holds_its_position_or_stops_after_a_set_time() {
    let mut software = running(0.0);
    let mut parameters = *software.parameters();
    parameters.safety.command_time = 0.1;
    for _ in 0..500 {
        software.step(Measurement::default(), None);
    }
    assert_eq!(software.safety().state(), SafetyState::Running);
    software.step(Measurement::default(), Some(moving(0.0, 0.0)));
    software.change(&Change::Parameters(parameters)).unwrap();
    let ticks = (1..1000).find(|_| software.step(Measurement::default(), None).safety != SafetyState::Running);
    assert_eq!((ticks, software.safety().state()), (Some(101), SafetyState::Ready));
}

#[test]
fn too_many_missed_ticks_in_a_row_are_a_fault() {
    for (missed, trips) in [(100, false), (101, true)] {
        let mut software = running(0.0);
        software.step(Measurement::default(), None);
        (0..missed).for_each(|_| software.miss());
        let fault = software.step(Measurement::default(), None).safety.fault();
        assert_eq!(fault, trips.then_some(Fault::TicksMissed { missed }));
    }
}

#[test]
fn a_controller_starts_at_the_position_of_the_load() {
    let mut software = running(0.0);
    let far = Measurement { count: 9000.0, ..Measurement::default() };
    // The first tick reads the counter's start, the second one is there.
    software.step(Measurement::default(), Some(Command::default()));
    let angle = software.step(far, Some(Command::default())).angle;
    assert!(angle > 1.0, "{angle}");
    software.step(far, Some(Command::default()));
    let controller = PositionController::Cascade(Cascade::default());
    let mut parameters = *software.parameters();
    parameters.tick.control = controller.into();
    software.change(&Change::Parameters(parameters)).unwrap();
    let torques = [(); 3].map(|()| software.step(far, Some(moving(angle, 0.0))).signals.commanded_torque);
    // A hundredth of the torque for a deviation of 1 rad.
    assert!(torques.iter().all(|torque| torque.abs() < 1e-3), "{torques:?}");
}

#[test]
fn motion_during_missed_ticks_is_not_taken_for_speed() {
    // 9000 of 10,000 counts per turn: 5700 rad/s within 1 ms, 57 rad/s within 100 ms.
    let far = Measurement { count: 9000.0, ..Measurement::default() };
    for (missed, trips) in [(0, true), (99, false)] {
        let mut software = running(0.0);
        software.step(Measurement::default(), None);
        (0..missed).for_each(|_| software.miss());
        let frame = software.step(far, None);
        assert_eq!(frame.cycle, 1 + missed);
        assert_eq!(matches!(frame.safety.fault(), Some(Fault::EncoderJumped { .. })), trips, "{missed}");
    }
}

#[test]
fn a_failed_machine_has_no_torque_at_once_and_must_be_homed_again() {
    let gone = |fault| Change::MachineFailed(fault);
    for silent in [MachineFault::Silent { ticks: 9 }, MachineFault::Restarted] {
        let mut software = running(0.0);
        let pushing = Command { added_torque: 0.5, added_load_torque: 0.2, ..Command::default() };
        software.step(Measurement::default(), Some(pushing));
        assert!(software.voltages().servo_voltage != 0.0);
        software.change(&gone(silent)).unwrap();
        let frame = software.step(Measurement::default(), Some(pushing));
        assert_eq!(frame.safety, SafetyState::Fault(Fault::Machine(silent)), "no brake: nothing is left to brake by");
        assert_eq!(software.voltages(), Voltages::default());
        // The first fault is kept; the bench cannot be armed, because the zero is no longer known.
        software.change(&gone(MachineFault::Restarted)).unwrap();
        assert_eq!(software.safety().state(), SafetyState::Fault(Fault::Machine(silent)));
        software.change(&Change::Request(Request::Acknowledge)).unwrap();
        assert!(software.change(&Change::Request(Request::Arm)).is_err());
        software.change(&Change::Request(Request::Home)).unwrap();
        // The fault is reported while the bench is switched off, too.
        software.change(&Change::Request(Request::Off)).unwrap();
        software.change(&gone(silent)).unwrap();
        assert!(matches!(software.safety().state(), SafetyState::Fault(_)));
    }
}

#[test]
fn after_a_failed_controller_the_screw_is_braked_and_the_fault_stays_until_it_is_acknowledged() {
    let mut software = running(0.0);
    let turning =
        Measurement { tacho_voltage: 5.0 * software.parameters().tick.scaling.tacho, ..Measurement::default() };
    let sample = software.sample(&turning, Some(&moving(0.0, 0.0)));
    assert!(sample.controls && (sample.input.measured_velocity - 5.0).abs() < 1e-12, "{sample:?}");
    let frame = software.step_with(
        turning,
        Some(Command { render: true, ..moving(0.0, 0.0) }),
        ExternalTorques { torque: 0.25, load_torque: 0.125 },
    );
    let command = frame.command;
    assert_eq!((command.added_torque, command.added_load_torque), (0.25, 0.125), "a record has them");
    assert_eq!(frame.signals.estimated_velocity, sample.estimated_velocity, "what the tick will estimate");
    let fault = Fault::External(Role::Controller, ExternalFault::Crashed { signal: 11 });
    software.change(&Change::ForeignFailed(Role::Controller, ExternalFault::Crashed { signal: 11 })).unwrap();
    assert_eq!(software.safety().state(), SafetyState::Stopping(Some(fault)), "the sensors are there to brake by");
    // The first fault is kept.
    software.change(&Change::ForeignFailed(Role::Controller, ExternalFault::NotANumber)).unwrap();
    let rests = (0..10_000).map(|_| software.step(Measurement::default(), None).safety);
    assert_eq!(rests.last(), Some(SafetyState::Fault(fault)));
    software.change(&Change::Request(Request::Acknowledge)).unwrap();
    assert_eq!(software.safety().state(), SafetyState::Off);
    let said = std::format!("{fault}");
    assert!(said.contains("signal 11, invalid memory access"), "{said}");
}

#[test]
fn the_cause_of_a_late_controller_is_reported_once_it_is_known() {
    let mut software = running(0.0);
    let late = ExternalFault::Late { time: 7.5e-4 };
    let crashed = ExternalFault::Crashed { signal: 11 };
    let told = |software: &Software| software.safety().state().fault();
    software.change(&Change::ForeignFailed(Role::Controller, late)).unwrap();
    assert_eq!(told(&software), Some(Fault::External(Role::Controller, late)));
    software.change(&Change::ForeignFailed(Role::Controller, crashed)).unwrap();
    assert_eq!(software.safety().state(), SafetyState::Stopping(Some(Fault::External(Role::Controller, crashed))));
    software.change(&Change::ForeignFailed(Role::Controller, ExternalFault::Ended { code: 1 })).unwrap();
    assert_eq!(told(&software), Some(Fault::External(Role::Controller, crashed)));
    let said = std::format!("{}", Fault::External(Role::Controller, late));
    assert!(said.contains("was missing 0.750 ms after the start of its sample"), "{said}");
    // The same at rest. A fault of the machine is not replaced by it.
    let mut software = running(0.0);
    software.change(&Change::ForeignFailed(Role::Controller, late)).unwrap();
    let _ = (0..10_000).map(|_| software.step(Measurement::default(), None)).last();
    assert_eq!(software.safety().state(), SafetyState::Fault(Fault::External(Role::Controller, late)));
    software.change(&Change::ForeignFailed(Role::Controller, crashed)).unwrap();
    assert_eq!(software.safety().state(), SafetyState::Fault(Fault::External(Role::Controller, crashed)));
    let mut software = running(0.0);
    software.change(&Change::MachineFailed(MachineFault::Restarted)).unwrap();
    software.change(&Change::ForeignFailed(Role::Controller, crashed)).unwrap();
    assert_eq!(told(&software), Some(Fault::Machine(MachineFault::Restarted)));
}

#[test]
fn a_fault_is_reported_although_the_machine_fails_while_braking() {
    let mut software = running(0.0);
    software.step(Measurement::default(), Some(moving(0.0, 0.0)));
    let turning =
        Measurement { tacho_voltage: 100.0 * software.parameters().tick.scaling.tacho, ..Measurement::default() };
    software.step(Measurement { accelerometer_voltage: f64::NAN, ..turning }, Some(moving(0.0, 0.0)));
    let SafetyState::Stopping(Some(fault)) = software.safety().state() else { panic!("{:?}", software.safety()) };
    software.change(&Change::MachineFailed(MachineFault::Restarted)).unwrap();
    assert_eq!(software.safety().state(), SafetyState::Fault(fault));
}

#[test]
fn a_load_current_as_late_as_its_drive_is_normal() {
    let end = |ticks: f64| {
        let mut software = running(0.0);
        software.parameters.load_delay = Delay::new(ticks, 1.0).unwrap();
        software.parameters.tick.current.torque_constant = 0.1;
        let sensor = software.parameters.tick.scaling.current_sensor;
        let limits = SafetyLimits { current_difference: 0.5, ..limits() };
        software.safety.set_limits(limits, Brake::default());
        // The current follows a ramp 8 ticks late.
        for k in 0..60 {
            let [asked, current] = [k, (k - 8).max(0)].map(|k| 0.1 * f64::from(k));
            let command = Command { added_load_torque: 0.1 * asked, ..moving(0.0, 0.0) };
            software.step(Measurement { current_voltage: sensor * current, ..Measurement::default() }, Some(command));
        }
        software.safety().state()
    };
    assert_eq!(end(8.0), SafetyState::Running);
    assert!(matches!(end(0.0), SafetyState::Stopping(_) | SafetyState::Fault(_)));
}
