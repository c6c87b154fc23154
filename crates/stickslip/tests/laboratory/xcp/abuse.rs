//! Hostile masters: an error or no response, bounded memory, and the next master is served.

use proptest::prelude::*;
use stickslip::xcp::{EPK, MEASUREMENTS, PARAMETERS};

use super::desk::Master;
use super::memory::most_held;

/// What a session may hold at most: the ring of the measurements, lists, answers.
const LIMIT: i64 = 16 << 20;

#[test]
fn an_invalid_address_is_refused_next_to_any_valid_one() {
    let mut master = Master::connected();
    let end = |start: u32, count: usize| start + 8 * count as u32;
    let measured = end(MEASUREMENTS, master.layout.measurements.len());
    let parameters = end(PARAMETERS, master.layout.parameters.len());
    let epk = EPK + master.layout.epk.len() as u32;
    for address in [0, MEASUREMENTS - 1, measured, PARAMETERS - 1, parameters, EPK - 1, epk, u32::MAX, u32::MAX - 6] {
        for size in [1, 8, 247] {
            let wild = [&[0xf4, size, 0, 0][..], &address.to_le_bytes()].concat();
            assert_eq!(master.refused(&wild), 0x24, "{address:#x}");
        }
        let write = [&[0xed, 1, 0, 0][..], &address.to_le_bytes(), &[0]].concat();
        assert_eq!(master.refused(&write), 0x24, "{address:#x}");
    }
    // Over the end, and of another extension.
    for (address, extension) in [(measured - 4, 0), (parameters - 4, 0), (PARAMETERS, 1)] {
        let over = [&[0xf4, 8, 0, extension][..], &address.to_le_bytes()].concat();
        assert_eq!(master.refused(&over), 0x24, "{address:#x}");
    }
    master.get(&[&[0xf6, 0, 0, 0][..], &PARAMETERS.to_le_bytes()].concat());
    assert_eq!(master.refused(&[0xf3, 0, 0, 0, 0xff, 0xff, 0xff, 0xff]), 0x24);
    assert!(master.desk.changes.borrow().is_empty());
}

#[test]
fn a_truncated_command_is_refused_and_there_is_no_response_without_a_connection() {
    let mut stranger = Master::new();
    for code in 0..0xff {
        assert!(stranger.ask(&[code, 0, 0, 0, 0, 0, 0, 0]).is_empty(), "{code:#x}");
    }
    let mut master = Master::connected();
    for code in 0..=0xfb_u8 {
        // Commands without arguments have a response.
        let answer = master.ask(&[code]);
        let alone = [0xfb, 0xe9, 0xdc, 0xda, 0xd9, 0xd6].contains(&code);
        assert!(alone || matches!(answer[..], [0xfe, 0x20 | 0x21]), "{code:#x} {answer:02x?}");
    }
    assert_eq!(master.refused(&[0xfc]), 0x00);
    for too_long in [0, 248, 255] {
        assert_eq!(master.refused(&[0xf5, too_long]), 0x22);
    }
    assert_eq!(master.refused(&[0xf5, 1]), 0x29, "the pointer is not set");
    assert_eq!(master.refused(&[0xf0, 8, 1, 2]), 0x21, "fewer bytes than stated");
}

#[test]
fn a_huge_allocation_is_refused_and_takes_no_memory() {
    let mut master = Master::connected();
    let held = most_held(|| {
        for _ in 0..100 {
            master.get(&[0xd6]);
            assert_eq!(master.refused(&[0xd5, 0, 0xff, 0xff]), 0x30);
            master.get(&[0xd6]);
            master.get(&[0xd5, 0, 32, 0]);
            assert_eq!(master.refused(&[0xd4, 0, 0, 0, 255]), 0x30);
            for list in 0..32 {
                master.get(&[0xd4, 0, list, 0, 124]);
            }
            let entries = (0..32u8).flat_map(|list| (0..124u8).map(move |packet| (list, packet)));
            let refused =
                entries.filter(|&(list, packet)| master.ask(&[0xd3, 0, list, 0, packet, 255]) == [0xfe, 0x30]);
            assert_eq!(refused.count(), 32 * 124 - 4096 / 255);
        }
    });
    assert!(held < 1 << 20, "{held} bytes");
}

/// Plausible commands, so that random ones get further than the first byte.
fn command() -> impl Strategy<Value = Vec<u8>> {
    let codes = prop_oneof![
        Just(0xff_u8),
        Just(0xfc),
        0xc0..=0xfb_u8,
        Just(0xd6),
        Just(0xd5),
        Just(0xd4),
        Just(0xd3),
        Just(0xe2),
        Just(0xe1),
        Just(0xe0),
        Just(0xde),
        Just(0xdd),
        Just(0xf6),
        Just(0xf5),
        Just(0xf0),
        Just(0xeb),
        any::<u8>()
    ];
    let small = prop_oneof![4 => 0..4u8, 1 => any::<u8>()];
    let address = prop_oneof![Just(MEASUREMENTS), Just(PARAMETERS), Just(EPK), any::<u32>()];
    let tail = prop_oneof![
        3 => prop::collection::vec(small.clone(), 0..12),
        // An address where most commands have it.
        2 => (prop::collection::vec(small, 3), address, prop::collection::vec(any::<u8>(), 0..240)).prop_map(
            |(head, address, tail)| [head, address.to_le_bytes().to_vec(), tail].concat()
        ),
        1 => prop::collection::vec(any::<u8>(), 0..247),
    ];
    (codes, tail).prop_map(|(code, tail)| [vec![code], tail].concat())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_neither_panic_nor_fill_the_memory_and_the_next_master_is_served(
        commands in prop::collection::vec(command(), 1..200)
    ) {
        let mut master = Master::connected();
        // A design takes long, and is not tested here.
        master.desk.operated.set(true);
        let held = most_held(|| {
            for (cycle, command) in commands.iter().enumerate() {
                master.ask(command);
                master.desk.row(cycle as u64 + 1);
                master.measure();
                master.measured.clear();
                master.texts.clear();
            }
        });
        prop_assert!(held < LIMIT, "{held} bytes");
        let answer = master.ask(&[0xff, 0]);
        prop_assert_eq!((answer.len(), answer[0]), (8, 0xff));
    }
}
