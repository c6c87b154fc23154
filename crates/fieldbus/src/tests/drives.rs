//! Drives in operation.

use super::bus::Bus;
use crate::{Machine, Readings};

const TORQUE: i8 = 10;

/// Two drives in operation, enabled.
fn enabled(mode: i8) -> Bus {
    let mut bus = Bus::new(2, 0);
    bus.reach_operational(2);
    for control in [0x06, 0x07, 0x0F] {
        bus.cycle(&[(control, 0, mode); 2]);
    }
    bus
}

#[test]
fn torque_in_per_mille_accelerates_the_rotor_as_computed() {
    let mut bus = enabled(TORQUE);
    let before = bus.cycle(&[(0x0F, 0, TORQUE); 2])[0];
    let after = bus.cycles(100, &[(0x0F, 200, TORQUE), (0x0F, 0, TORQUE)]);
    assert_eq!((after.state(), after.torque), (0x27, 200));
    // 0.2 of 0.5 N m on 1e-3 kg m² over 0.1 s, with friction of 1e-3 N m s/rad.
    let expected = 100.0 * (1.0 - (-0.1_f64).exp()) / std::f64::consts::TAU * 65536.0;
    assert!((f64::from(after.velocity) / expected - 1.0).abs() < 0.02, "{after:?}, expected {expected}");
    assert!(after.position > before.position + 4_000);
    // The other drive has not moved.
    assert_eq!(bus.cycle(&[(0x0F, 0, TORQUE); 2])[1].velocity, 0);
}

#[test]
fn the_smallest_limit_of_the_torque_counts_and_is_shown() {
    let mut bus = enabled(TORQUE);
    for (index, limit) in [(0x6072, 300_u16), (0x60E0, 250)] {
        bus.download(0, index, 0, &limit.to_le_bytes()).unwrap();
    }
    for (demand, torque, is_limited) in [(1000, 250, true), (-1000, -300, true), (-200, -200, false)] {
        let inputs = bus.cycles(3, &[(0x0F, demand, TORQUE); 2]);
        assert_eq!((inputs.torque, inputs.status & 0x800 != 0), (torque, is_limited));
    }
}

#[test]
fn set_points_are_delayed_by_cycles() {
    let mut bus = enabled(TORQUE);
    bus.download(0, 0x2010, 2, &[5]).unwrap();
    bus.cycles(10, &[(0x0F, 0, TORQUE); 2]);
    let torques: Vec<i16> = (0..7).map(|_| bus.cycle(&[(0x0F, 100, TORQUE); 2])[0].torque).collect();
    assert_eq!(torques, [0, 0, 0, 0, 0, 100, 100]);
}

#[test]
fn a_fault_on_request_switches_off_and_is_reset_by_the_rising_edge() {
    let mut bus = enabled(TORQUE);
    bus.download(0, 0x2020, 1, &[0x10, 0x42]).unwrap();
    let inputs = bus.cycles(2, &[(0x0F, 100, TORQUE); 2]);
    assert_eq!((inputs.state(), inputs.error, inputs.torque), (0x08, 0x4210, 0));
    assert_eq!(bus.cycles(3, &[(0x0F, 0, TORQUE); 2]).state(), 0x08);
    assert_eq!(bus.cycles(2, &[(0x80, 0, TORQUE); 2]).error, 0);
    for (control, state) in [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)] {
        assert_eq!(bus.cycle(&[(control, 0, TORQUE); 2])[0].state(), state);
    }
}

#[test]
fn the_watchdog_leaves_a_communication_fault() {
    let mut bus = enabled(TORQUE);
    bus.cycles(50, &[(0x0F, 100, TORQUE); 2]);
    bus.now += 200_000_000;
    assert_eq!(bus.status(0), (0x14, 0x1B));
    assert_eq!(bus.upload(0, 0x603F, 0), Ok(0x7500));
    assert_eq!(bus.upload(0, 0x6077, 0), Ok(0));
}

#[test]
fn a_torque_beyond_the_trip_level_is_an_over_current() {
    let mut bus = enabled(TORQUE);
    bus.download(0, 0x2010, 1, &[150, 0]).unwrap();
    assert_eq!(bus.cycles(3, &[(0x0F, 140, TORQUE); 2]).state(), 0x27);
    let inputs = bus.cycles(3, &[(0x0F, 200, TORQUE); 2]);
    assert_eq!((inputs.state(), inputs.error), (0x08, 0x2310));
}

#[test]
fn a_velocity_is_followed_and_a_quick_stop_ends_it() {
    let mut bus = enabled(9);
    bus.download(0, 0x60FF, 0, &100_000_i32.to_le_bytes()).unwrap();
    let inputs = bus.cycles(500, &[(0x0F, 0, 9); 2]);
    assert!((inputs.velocity - 100_000).abs() < 2_000, "{inputs:?}");
    assert_eq!(bus.cycles(5, &[(0x0B, 0, 9); 2]).state(), 0x07);
    let inputs = bus.cycles(500, &[(0x0B, 0, 9); 2]);
    assert_eq!((inputs.state(), inputs.velocity.abs() < 2_000), (0x40, true));
}

#[test]
fn a_position_is_followed_and_a_jump_is_a_following_error() {
    let mut bus = enabled(8);
    for target in (0..=60_i32).map(|step| step * 500) {
        bus.download(0, 0x607A, 0, &target.to_le_bytes()).unwrap();
        bus.cycles(5, &[(0x0F, 0, 8); 2]);
    }
    let inputs = bus.cycles(500, &[(0x0F, 0, 8); 2]);
    assert!((inputs.position - 30_000).abs() < 100, "{inputs:?}");
    bus.download(0, 0x607A, 0, &2_000_000_i32.to_le_bytes()).unwrap();
    let inputs = bus.cycles(30, &[(0x0F, 0, 8); 2]);
    assert_eq!((inputs.state(), inputs.error, inputs.status & 0x2000), (0x08, 0x8611, 0x2000));
}

#[test]
fn the_touch_probe_takes_the_position_of_the_index() {
    let mut bus = enabled(TORQUE);
    bus.download(0, 0x60B8, 0, &[0x15, 0]).unwrap();
    bus.cycles(5, &[(0x0F, 0, TORQUE); 2]);
    assert_eq!(bus.upload(0, 0x60B9, 0), Ok(1));
    bus.cycles(150, &[(0x0F, -300, TORQUE); 2]);
    assert_eq!((bus.upload(0, 0x60B9, 0), bus.upload(0, 0x60BA, 0)), (Ok(3), Ok(0)));
}

/// A machine whose sensor fails.
struct Broken;

impl Machine for Broken {
    fn period(&self) -> u64 {
        250_000
    }

    fn step(&mut self, _: &[f64], readings: &mut Readings) {
        readings.shafts[0].torque = f64::NAN;
    }
}

#[test]
fn a_reading_that_is_not_finite_switches_off() {
    let mut bus = Bus::with(1, 0, Box::new(Broken));
    bus.reach_operational(1);
    assert_eq!(bus.cycles(3, &[(0x06, 0, TORQUE)]).error, 0x2310);
}
