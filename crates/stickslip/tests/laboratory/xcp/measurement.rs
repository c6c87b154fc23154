//! Lists of measurements.

use stickslip::xcp::{MAX_DTO, MEASUREMENTS};

use super::desk::{Desk, Master, RATE};

/// Lists of packets with these measurements; all with time stamps, selected.
fn lists(master: &mut Master, lists: &[(u8, &[&[u8]])]) {
    master.get(&[0xd6]);
    master.get(&[0xd5, 0, lists.len() as u8, 0]);
    for (list, (_, packets)) in lists.iter().enumerate() {
        master.get(&[0xd4, 0, list as u8, 0, packets.len() as u8]);
    }
    for (list, (_, packets)) in lists.iter().enumerate() {
        for (packet, entries) in packets.iter().enumerate() {
            master.get(&[0xd3, 0, list as u8, 0, packet as u8, entries.len() as u8]);
        }
    }
    for (list, (prescaler, packets)) in lists.iter().enumerate() {
        for (packet, entries) in packets.iter().enumerate() {
            master.get(&[0xe2, 0, list as u8, 0, packet as u8, 0]);
            for &entry in *entries {
                master.get(&write(8, u32::from(entry)));
            }
        }
        master.get(&[0xe0, 0x10, list as u8, 0, 0, 0, *prescaler, 0]);
        assert_eq!(master.get(&[0xde, 2, list as u8, 0]), [0]);
    }
}

fn write(size: u8, measurement: u32) -> Vec<u8> {
    [&[0xe1, 0xff, size, 0][..], &(MEASUREMENTS + 8 * measurement).to_le_bytes()].concat()
}

fn numbers(bytes: &[u8]) -> Vec<f64> {
    bytes.chunks(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap())).collect()
}

#[test]
fn each_cycle_has_its_time_and_every_tenth_is_sent_on_request() {
    let mut master = Master::connected();
    lists(&mut master, &[(1, &[&[0, 3], &[5]]), (10, &[&[0]])]);
    master.desk.row(1);
    master.measure();
    assert!(master.measured.is_empty(), "no list runs");
    master.get(&[0xdd, 1]);
    assert_eq!(master.get(&[0xfd])[0], 0x40);
    assert_eq!(master.get(&[0xdf, 0, 0, 0]), [0x50, 0, 0, 0, 0, 1, 0]);
    for cycle in 2..=41 {
        master.desk.row(cycle);
    }
    master.measure();
    let of = |list: u8, packet: u8| {
        let all = master.measured.iter().filter(move |measured| measured[..2] == [packet, list]);
        all.map(|packet| packet[2..].to_vec()).collect::<Vec<_>>()
    };
    for (cycle, packet) in (2..=41u64).zip(of(0, 0)) {
        let time = u32::from_le_bytes(packet[..4].try_into().unwrap());
        assert_eq!(u64::from(time), cycle * 250, "microseconds of {RATE} Hz");
        assert_eq!(numbers(&packet[4..]), [cycle as f64, Desk::value(2, cycle)]);
    }
    assert_eq!((of(0, 0).len(), of(0, 1).len(), numbers(&of(0, 1)[7])), (40, 40, vec![Desk::value(4, 9)]));
    let tenth: Vec<f64> = of(1, 0).iter().flat_map(|packet| numbers(&packet[4..])).collect();
    assert_eq!(tenth, [10.0, 20.0, 30.0, 40.0]);
    assert_eq!(master.get(&[0xdc])[3..], (41u32 * 250).to_le_bytes());
    master.get(&[0xdd, 0]);
    master.measured.clear();
    master.desk.row(42);
    master.measure();
    assert!(master.measured.is_empty() && !master.slave.is_measuring());
}

#[test]
fn lost_rows_are_counted_and_marked_in_the_next_packet_alone() {
    let mut master = Master::connected();
    lists(&mut master, &[(1, &[&[0]])]);
    master.get(&[0xdd, 1]);
    for cycle in [1, 2, 5, 6] {
        master.desk.row(cycle);
    }
    master.measure();
    let marks: Vec<u8> = master.measured.iter().map(|packet| packet[0]).collect();
    assert_eq!((marks, master.slave.lost()), (vec![0, 0, 0x80, 0], 2));
    // No packet is read until the ring is full, so that some packets of 16 bytes are lost.
    let cycles = 400_000;
    for cycle in 7..cycles {
        master.desk.row(cycle);
    }
    let lost = master.slave.lost() - 2;
    assert!(lost > 0);
    master.measured.clear();
    master.measure();
    assert_eq!(master.measured.len() as u64 + lost, cycles - 7);
    assert!(master.measured.iter().all(|packet| packet[0] == 0));
    master.desk.row(cycles);
    master.measure();
    assert_eq!(master.measured.last().unwrap()[0], 0x80);
}

#[test]
fn a_list_that_continues_while_another_starts_marks_possible_losses() {
    let mut master = Master::connected();
    lists(&mut master, &[(1, &[&[0]]), (1, &[&[0]])]);
    master.get(&[0xde, 1, 0, 0]);
    master.desk.row(1);
    master.get(&[0xde, 1, 1, 0]);
    master.desk.row(2);
    master.desk.row(3);
    master.measure();
    let heads: Vec<[u8; 2]> = master.measured.iter().map(|packet| [packet[0], packet[1]]).collect();
    assert_eq!(heads, [[0x80, 0], [0, 1], [0, 0], [0, 1]]);
    // Stopped and started, it begins again.
    master.get(&[0xde, 0, 0, 0]);
    master.get(&[0xde, 0, 1, 0]);
    master.get(&[0xde, 1, 0, 0]);
    master.measured.clear();
    master.desk.row(4);
    master.measure();
    assert_eq!(master.measured[0][..2], [0, 0]);
}

#[test]
fn the_reported_properties_of_the_processor_are_its_behaviour() {
    let mut master = Master::connected();
    assert_eq!(master.get(&[0xda]), [0x53, 0, 0, 1, 0, 0, 0x40]);
    assert_eq!(master.get(&[0xd9]), [8, 248, 8, 0, 0x34, 1, 0]);
    // 250 µs in units of 1 µs, 10⁻⁹ s × 10³.
    let event = master.get(&[0xd7, 0, 0, 0]);
    assert_eq!(event, [0x44, 0xff, 5, 250, 3, 0]);
    assert_eq!(master.upload(5), b"cycle");
    assert_eq!(master.refused(&[0xd7, 0, 1, 0]), 0x22);
    assert_eq!(master.get(&[0xc0, 0]), [0, 1, 4, 1, 4]);
}

#[test]
fn a_list_that_is_not_whole_or_not_in_order_is_refused() {
    let mut master = Master::connected();
    assert_eq!(master.refused(&[0xd5, 0, 1, 0]), 0x29, "free first");
    master.get(&[0xd6]);
    assert_eq!(master.refused(&[0xd4, 0, 0, 0, 1]), 0x29);
    assert_eq!(master.refused(&[0xd5, 0, 0xff, 0xff]), 0x30);
    lists(&mut master, &[(1, &[&[0, 1, 2]])]);
    assert_eq!(master.refused(&write(8, 0)), 0x29, "after the last entry");
    master.get(&[0xe2, 0, 0, 0, 0, 1]);
    for (command, code) in [
        (write(8, 100_000), 0x24),
        (write(16, master.layout.measurements.len() as u32 - 1), 0x24),
        (write(4, 0), 0x22),
        (write(0, 0), 0x22),
        (vec![0xe1, 0xff, 8, 1, 0, 0, 0, 0x10], 0x24),
        (vec![0xe1, 3, 8, 0, 0, 0, 0, 0x10], 0x22),
        (vec![0xe1, 0xff, 8, 0, 1, 0, 0, 0x10], 0x24),
        (vec![0xe1, 0xff, 8, 0, 0, 0, 0, 0x20], 0x24),
        (vec![0xe2, 0, 0, 0, 0, 3], 0x22),
        (vec![0xe2, 0, 9, 0, 0, 0], 0x22),
        (vec![0xe0, 0x02, 0, 0, 0, 0, 1, 0], 0x27),
        (vec![0xe0, 0, 0, 0, 1, 0, 1, 0], 0x22),
        (vec![0xe0, 0, 0, 0, 0, 0, 0, 0], 0x22),
        (vec![0xdd, 9], 0x27),
        (vec![0xde, 9, 0, 0], 0x27),
    ] {
        assert_eq!(master.refused(&command), code, "{command:02x?}");
    }
    // Several at once; while a list runs writes are refused.
    let several = |entries: &[u32]| {
        let entry = |&entry: &u32| [&[0xff, 8][..], &(MEASUREMENTS + 8 * entry).to_le_bytes(), &[0, 0]].concat();
        [vec![0xc7, entries.len() as u8], entries.iter().flat_map(entry).collect()].concat()
    };
    master.get(&[0xe2, 0, 0, 0, 0, 0]);
    master.get(&several(&[7, 8]));
    master.get(&[0xde, 1, 0, 0]);
    assert_eq!(master.refused(&several(&[7])), 0x11);
    master.desk.row(1);
    master.measure();
    assert_eq!(numbers(&master.measured[0][6..]), [Desk::value(6, 1), Desk::value(7, 1), Desk::value(1, 1)]);
    // Entries that were never written.
    master.get(&[0xd6]);
    master.get(&[0xd5, 0, 1, 0]);
    master.get(&[0xd4, 0, 0, 0, 1]);
    assert_eq!(master.refused(&[0xde, 1, 0, 0]), 0x2a, "no entry at all");
    master.get(&[0xd3, 0, 0, 0, 0, 2]);
    assert_eq!(master.refused(&[0xde, 1, 0, 0]), 0x2a);
}

#[test]
fn a_packet_has_at_most_the_size_of_a_datagram() {
    let mut master = Master::connected();
    let most = (MAX_DTO - 2) / 8;
    master.get(&[0xd6]);
    master.get(&[0xd5, 0, 1, 0]);
    master.get(&[0xd4, 0, 0, 0, 1]);
    master.get(&[0xd3, 0, 0, 0, 0, 255]);
    master.get(&[0xe2, 0, 0, 0, 0, 0]);
    for _ in 0..most {
        master.get(&write(8, 0));
    }
    assert_eq!(master.refused(&write(8, 0)), 0x22);
}
