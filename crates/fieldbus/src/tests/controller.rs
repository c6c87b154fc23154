//! Registers, EEPROM, states and process data.

use super::bus::{BRD, Bus, CYCLE, INPUTS, LRD, LRW, OUTPUTS};

#[test]
fn a_broadcast_counts_the_devices_and_addresses_reach_one_each() {
    let mut bus = Bus::new(2, 1);
    assert_eq!(bus.send(BRD, 0, 0, &[0]).1, 3);
    for position in 0..3 {
        bus.write(position, 0x0010, &(1000 + position).to_le_bytes());
    }
    for position in 0..3 {
        assert_eq!(bus.send(4, 1000 + position, 0x0010, &[0, 0]), ((1000 + position).to_le_bytes().to_vec(), 1));
    }
    assert_eq!(bus.send(4, 999, 0x0010, &[0, 0]).1, 0);
}

#[test]
fn read_only_registers_keep_their_values_and_overlong_writes_are_cut() {
    let mut bus = Bus::new(1, 0);
    let before = bus.read(0, 0x0000, 10);
    assert_eq!(bus.send(8, 0, 0, &[0xFF; 10]).1, 0);
    assert_eq!(bus.read(0, 0, 10), before);
    // Sixteen units are written, four exist.
    bus.write(0, 0x0600, &[0xA5; 256]);
    assert_eq!(bus.read(0, 0x0630, 32), [vec![0xA5; 16], vec![0; 16]].concat());
}

/// Eight bytes of the EEPROM.
fn eeprom(bus: &mut Bus, word: u16) -> Vec<u8> {
    let [low, high] = word.to_le_bytes();
    bus.write(0, 0x0502, &[0, 1, low, high, 0, 0]);
    assert_eq!(bus.word(0, 0x0502) & 0x8000, 0x8000, "busy");
    assert_eq!(bus.word(0, 0x0502), 0x00C0);
    bus.read(0, 0x0508, 8)
}

#[test]
fn the_eeprom_has_identity_mailboxes_and_categories_up_to_its_end() {
    let mut bus = Bus::new(1, 0);
    bus.write(0, 0x0500, &[2]);
    bus.write(0, 0x0500, &[0]);
    assert_eq!(&eeprom(&mut bus, 8)[..4], b"CITS");
    assert_eq!(eeprom(&mut bus, 0x18), [0x00, 0x10, 128, 0, 0x80, 0x10, 128, 0]);
    let (mut at, mut found) = (0x40, Vec::new());
    while *found.last().unwrap_or(&0) != 0xFFFF {
        let head = eeprom(&mut bus, at);
        found.push(u16::from_le_bytes([head[0], head[1]]));
        at += 2 + u16::from_le_bytes([head[2], head[3]]).min(200);
    }
    assert_eq!(found, [10, 30, 40, 41, 50, 51, 0xFFFF]);
    // Owned by the device, it refuses the main device.
    bus.write(0, 0x0500, &[1]);
    bus.write(0, 0x0502, &[0, 1, 8, 0, 0, 0]);
    assert_eq!(bus.word(0, 0x0502), 0x20C0);
}

#[test]
fn mailboxes_that_differ_from_the_description_are_refused() {
    let mut bus = Bus::new(1, 0);
    bus.manager(0, 0, 0x1000, 64, 0x26);
    bus.manager(0, 1, 0x1080, 128, 0x22);
    assert_eq!(bus.request(0, 2), (0x11, 0x16));
}

#[test]
fn wrong_lengths_of_process_data_are_refused_with_the_code_of_their_direction() {
    let mut bus = Bus::new(1, 0);
    bus.reach_pre_operational();
    for (outputs, inputs, code) in [(OUTPUTS + 1, INPUTS, 0x1D), (OUTPUTS, INPUTS - 1, 0x1E), (0, INPUTS, 0x1D)] {
        bus.manager(0, 2, 0x1100, outputs, 0x64);
        bus.manager(0, 3, 0x1200, inputs, 0x20);
        assert_eq!(bus.request(0, 0x14), (0x12, code));
    }
    bus.reach_safe_operational(1);
}

#[test]
fn a_read_and_write_counts_three_for_each_drive() {
    let mut bus = Bus::new(2, 0);
    bus.reach_operational(2);
    // From the outputs of both to the inputs of both.
    let length = 0x100 + 2 * usize::from(INPUTS);
    assert_eq!(bus.send(LRW, 0, 0, &vec![0; length]).1, 6);
    assert_eq!(bus.send(LRD, 0, 0, &vec![0; length]).1, 2);
    assert_eq!(bus.send(LRD, 0x4000, 0, &[0; 8]).1, 0);
}

#[test]
fn before_safe_op_there_is_no_process_data() {
    let mut bus = Bus::new(1, 0);
    bus.reach_pre_operational();
    bus.reach_safe_operational(1);
    assert_eq!(bus.request(0, 2), (2, 0));
    assert_eq!(bus.send(LRD, 0x100, 0, &[0; 16]).1, 0);
}

#[test]
fn without_outputs_operation_ends_with_the_code_of_the_watchdog() {
    let mut bus = Bus::new(2, 0);
    bus.reach_operational(2);
    bus.cycles(10, &[(0, 0, 10); 2]);
    bus.now += 90 * CYCLE;
    assert_eq!(bus.status(0), (8, 0));
    bus.now += 20 * CYCLE;
    assert_eq!(bus.status(0), (0x14, 0x1B));
    assert_eq!(bus.read(0, 0x0440, 3), [0, 0, 1]);
    // Acknowledged, it can be operated again.
    assert_eq!(bus.request(0, 0x14), (4, 0));
    bus.request(0, 8);
    bus.cycles(2, &[(0, 0, 10); 2]);
    assert_eq!(bus.status(0), (8, 0));
}

#[test]
fn process_data_is_lost_or_ignored_on_request() {
    let mut bus = Bus::new(2, 0);
    bus.reach_operational(2);
    bus.download(0, 0x2020, 2, &[1, 0]).unwrap();
    bus.download(1, 0x2020, 3, &[1, 0]).unwrap();
    assert_eq!(bus.try_send(LRD, 0x100, 0, &[0; 32]), None);
    // The second device is away.
    assert_eq!(bus.send(LRD, 0x100, 0, &[0; 32]).1, 1);
    assert_eq!(bus.send(LRD, 0x100, 0, &[0; 32]).1, 2);
}
