//! Distributed clocks.

use super::bus::{BWR, Bus, CYCLE, FRMW};

fn number(bytes: &[u8]) -> i64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | i64::from(*byte))
}

/// Offsets and delays as a main device computes them. Returns the system time of the first device.
fn align(bus: &mut Bus) -> i64 {
    assert_eq!(bus.send(BWR, 0, 0x0900, &[0; 4]).1, 3);
    let first = number(&bus.read(0, 0x0918, 8));
    let ports = |bus: &mut Bus, position| {
        let times = bus.read(position, 0x0900, 8);
        number(&times[4..]) - number(&times[..4])
    };
    let loops = [ports(bus, 0), ports(bus, 1)];
    assert_eq!(loops, [2400, 1200]);
    for (position, delay) in [0, 600, 1200].into_iter().enumerate() {
        let receive = number(&bus.read(position as u16, 0x0918, 8));
        bus.write(position as u16, 0x0920, &(first - receive + delay).to_le_bytes());
        bus.write(position as u16, 0x0928, &(delay as u32).to_le_bytes());
    }
    number(&bus.read(0, 0x0910, 8))
}

#[test]
fn clocks_follow_the_reference_in_spite_of_their_drift() {
    let mut bus = Bus::new(2, 1);
    bus.reach_pre_operational();
    align(&mut bus);
    let mut differences = Vec::new();
    for _ in 0..2000 {
        bus.now += CYCLE;
        bus.send(FRMW, 0x1001, 0x0910, &[0; 8]);
        differences
            .push((number(&bus.read(1, 0x092C, 4)) & 0x7FFF_FFFF, number(&bus.read(2, 0x092C, 4)) & 0x7FFF_FFFF));
    }
    let last = differences[1900..].iter().map(|(a, b)| a.max(b)).max();
    assert!(last < Some(&200), "{last:?}");
    // Without the reference they drift apart: 18 and 23 parts per million of a second.
    bus.now += 1_000_000_000;
    bus.send(FRMW, 0x1001, 0x0910, &[0; 8]);
    assert!(number(&bus.read(1, 0x092C, 4)) & 0x7FFF_FFFF > 15_000);
}

/// One drive with SYNC0 at a start, in SAFE-OP.
fn synchronised(ahead: i64, cycle: u32) -> Bus {
    let mut bus = Bus::new(1, 0);
    bus.reach_pre_operational();
    bus.write(0, 0x0981, &[0]);
    bus.write(0, 0x0980, &[0]);
    let now = number(&bus.read(0, 0x0910, 8));
    bus.write(0, 0x0990, &(now + ahead).to_le_bytes());
    bus.write(0, 0x09A0, &cycle.to_le_bytes());
    bus.write(0, 0x0981, &[3]);
    bus
}

#[test]
fn set_points_act_at_sync0() {
    let mut bus = synchronised(10_500_000, 1_000_000);
    bus.reach_safe_operational(1);
    bus.request(0, 8);
    bus.cycles(15, &[(0, 0, 10)]);
    for control in [0x06, 0x07, 0x0F] {
        bus.cycles(2, &[(control, 0, 10)]);
    }
    assert_eq!(bus.status(0), (8, 0));
    let inputs = bus.cycles(20, &[(0x0F, 100, 10)]);
    assert_eq!((inputs.state(), inputs.torque), (0x27, 100));
    // Sent before the pulse in the middle of the cycle, seen in the inputs after it.
    let torques: Vec<i16> = (0..3).map(|_| bus.cycle(&[(0x0F, -100, 10)])[0].torque).collect();
    assert!(torques[0] == 100 && torques[2] == -100, "{torques:?}");
}

#[test]
fn a_start_in_the_past_gives_no_pulse_and_no_operation() {
    let mut bus = synchronised(-1_000, 1_000_000);
    bus.reach_safe_operational(1);
    bus.request(0, 8);
    bus.cycles(1100, &[(0, 0, 10)]);
    assert_eq!(bus.status(0), (0x14, 0x2D));
}

#[test]
fn a_cycle_that_is_too_short_is_refused() {
    let mut bus = synchronised(10_000_000, 10_000);
    bus.manager(0, 2, 0x1100, 6, 0x64);
    bus.manager(0, 3, 0x1200, 16, 0x20);
    assert_eq!(bus.request(0, 4), (0x12, 0x30));
}

#[test]
fn a_lost_sync0_and_missed_set_points_end_operation_with_their_codes() {
    let operational = || {
        let mut bus = synchronised(2_500_000, 1_000_000);
        bus.reach_safe_operational(1);
        bus.request(0, 8);
        bus.cycles(20, &[(0, 0, 10)]);
        assert_eq!(bus.status(0), (8, 0));
        bus
    };
    let mut bus = operational();
    bus.download(0, 0x2020, 4, &[1]).unwrap();
    bus.cycles(2, &[(0, 0, 10)]);
    assert_eq!(bus.status(0), (0x14, 0x2C));

    let mut bus = operational();
    // The frames stop for less than the watchdog.
    bus.now += 30 * CYCLE;
    assert_eq!(bus.status(0), (0x14, 0x1A));
}
