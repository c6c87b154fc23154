//! Values, pages, refusals.

use stickslip::parameters::{flatten, presets};
use stickslip::xcp::{Change, EPK, MEASUREMENTS, PARAMETERS};

use super::desk::Master;

const GAIN: &str = "bench.controller.position_gain";
const SET_ECU: u8 = 1;
const SET_XCP: u8 = 2;

fn page(mode: u8, page: u8) -> [u8; 4] {
    [0xeb, mode, 0, page]
}

#[test]
fn a_value_enters_when_it_is_complete_and_is_read_back() {
    let mut master = Master::connected();
    let before = master.read(GAIN);
    assert_eq!(master.write(GAIN, 11.5), [0xff]);
    assert_eq!((master.read(GAIN), master.desk.in_force(GAIN).as_str()), (11.5, "11.5 1/s"));
    // The same value again does not count as a change.
    master.write(GAIN, 11.5);
    assert_eq!(master.desk.changes.borrow().len(), 1);
    // By halves: the first changes nothing.
    let address = master.address(GAIN).to_le_bytes();
    let bytes = before.to_le_bytes();
    master.get(&[&[0xf6, 0, 0, 0][..], &address].concat());
    master.get(&[&[0xf0, 3][..], &bytes[..3]].concat());
    assert_eq!(master.read(GAIN), 11.5);
    master.get(&[&[0xf6, 0, 0, 0][..], &(u32::from_le_bytes(address) + 3).to_le_bytes()].concat());
    master.get(&[&[0xf0, 5][..], &bytes[3..]].concat());
    assert_eq!((master.read(GAIN), master.desk.changes.borrow().len()), (before, 2));
    // By the short command.
    master.get(&[&[0xed, 8, 0, 0][..], &address, &12.0f64.to_le_bytes()].concat());
    assert_eq!(master.read(GAIN), 12.0);
}

#[test]
fn an_element_of_a_list_and_the_name_of_a_variant_are_numbers_too() {
    let mut master = Master::connected();
    let poles = [0, 1, 2].map(|i| format!("bench.observer_poles.{i}"));
    let before = master.read(&poles[2]);
    assert_eq!(master.write(&poles[1], 200.0), [0xff], "{}", master.texts);
    assert_eq!((master.read(&poles[1]), master.read(&poles[2])), (200.0, before));
    assert_eq!((master.read("bench.law.kind"), master.desk.in_force("bench.law.kind").as_str()), (0.0, "paper"));
    assert_eq!(master.write("bench.law.kind", 3.0), [0xff], "{}", master.texts);
    assert_eq!(master.desk.in_force("bench.law.kind"), "bristle");
    // Parameters of another law cannot be written while this one is selected, and read as their defaults.
    assert_eq!(master.write("bench.law.bandwidth", 300.0), [0xfe, 0x24]);
    assert_eq!(master.read("bench.law.bandwidth"), 350.0);
    assert_eq!(master.write("bench.law.kind", 0.5), [0xfe, 0x22]);
    assert_eq!(master.write("bench.law.kind", 99.0), [0xfe, 0x22]);
    assert_eq!(master.desk.in_force("bench.law.kind"), "bristle");
}

#[test]
fn a_refusal_has_a_code_a_reason_and_no_effect() {
    let mut master = Master::connected();
    let before = master.read(GAIN);
    for (path, value, code, reason) in [
        (GAIN, -1.0, 0x22, "outside"),
        (GAIN, f64::NAN, 0x22, "finite"),
        ("bench.desired.breakaway_torque", 90.0, 0x22, "cannot be rendered"),
        ("bench.safety.lower_end", 300.0, 0x22, "stroke"),
    ] {
        master.texts.clear();
        assert_eq!(master.write(path, value), [0xfe, code], "{path}");
        assert!(master.texts.contains(reason) && master.texts.ends_with("\n\0"), "{path}: {}", master.texts);
        assert!(master.texts.is_ascii());
    }
    master.desk.operated.set(true);
    assert_eq!(master.write(GAIN, 11.0), [0xfe, 0x24]);
    assert!(master.texts.contains("ann is the operator"), "{}", master.texts);
    assert_eq!(master.read(GAIN), before);
}

#[test]
fn a_set_is_collected_while_the_reference_runs_and_enters_at_once() {
    let mut master = Master::connected();
    let (lower, upper) = ("bench.safety.lower_end", "bench.safety.upper_end");
    let before = [master.read(lower), master.read(upper)];
    master.write(GAIN, 11.5);
    master.get(&page(SET_ECU, 1));
    assert_eq!(master.get(&[0xea, 1, 0]), [0, 0, 1]);
    assert_ne!(master.desk.in_force(GAIN), "11.5 1/s", "the reference runs");
    assert_eq!(master.read(GAIN), 11.5, "the working set is kept");
    let tried = master.desk.changes.borrow().len();
    // Either alone would leave no stroke.
    assert_eq!(master.write(lower, 200.0), [0xff]);
    assert_eq!(master.write(upper, 300.0), [0xff]);
    assert_eq!(master.write("bench.law.kind", 5.0), [0xff]);
    assert_eq!(master.write("bench.law.bandwidth", 300.0), [0xff]);
    assert_eq!(master.write(GAIN, 1e9), [0xfe, 0x22], "outside of its range at once");
    assert!(master.texts.contains("position_gain = 1e9 1/s is outside"), "{}", master.texts);
    assert_eq!(master.desk.changes.borrow().len(), tried);
    // The reference is read, and not written.
    master.get(&page(SET_XCP, 1));
    assert_eq!([master.read(lower), master.read(upper)], before);
    assert_eq!(master.write(lower, 200.0), [0xfe, 0x23]);
    master.get(&page(SET_XCP, 0));
    master.get(&page(SET_ECU, 0));
    assert_eq!(master.desk.changes.borrow().len(), tried + 1, "all with one change");
    assert_eq!([master.read(lower), master.read(upper), master.read(GAIN)], [200.0, 300.0, 11.5]);
    assert_eq!(master.desk.in_force("bench.law.bandwidth"), "300 rad/s");
    assert_eq!(master.get(&[0xea, 1, 0]), [0, 0, 0]);
    // And back by a copy.
    master.get(&[0xe4, 0, 1, 0, 0]);
    assert_eq!([master.read(lower), master.read(upper)], before);
    assert_eq!(master.desk.in_force("bench.law.kind"), "paper");
}

#[test]
fn a_set_that_is_refused_leaves_the_reference_running() {
    let mut master = Master::connected();
    master.get(&page(SET_ECU, 1));
    master.write("bench.safety.lower_end", 300.0);
    master.get(&page(SET_XCP, 1));
    assert_eq!(master.refused(&page(SET_ECU | SET_XCP, 0)), 0x22);
    assert!(master.texts.contains("stroke"), "{}", master.texts);
    // Neither page has switched.
    assert_eq!((master.get(&[0xea, 1, 0]), master.get(&[0xea, 2, 0])), (vec![0, 0, 1], vec![0, 0, 1]));
    master.get(&page(SET_XCP, 0));
    // The copy restores the working set.
    master.get(&[0xe4, 0, 1, 0, 0]);
    master.get(&page(SET_ECU, 0));
    // A master that disconnects in between leaves the reference active, and collects no values.
    master.get(&page(SET_ECU, 1));
    master.write(GAIN, 11.5);
    master.get(&[0xfe]);
    assert_eq!(master.desk.left.get(), 1);
    master.get(&[0xff, 0]);
    assert_eq!(master.get(&[0xea, 1, 0]), [0, 0, 0]);
    assert_ne!(master.read(GAIN), 11.5);
}

#[test]
fn pages_and_segments_have_their_properties() {
    let mut master = Master::connected();
    let size = 8 * master.layout.parameters.len() as u32;
    assert_eq!(master.get(&[0xe9]), [1, 0]);
    assert_eq!(master.get(&[0xe8, 0, 0, 0, 0])[3..], PARAMETERS.to_le_bytes());
    assert_eq!(master.get(&[0xe8, 0, 0, 1, 0])[3..], size.to_le_bytes());
    assert_eq!(master.get(&[0xe8, 1, 0, 0, 0]), [2, 0, 0, 0, 0]);
    assert_eq!((master.get(&[0xe7, 0, 0, 0]), master.get(&[0xe7, 0, 0, 1])), (vec![0x3f, 0], vec![0x0f, 0]));
    for (command, code) in [
        (&[0xeb, 1, 1, 0][..], 0x28),
        (&[0xeb, 1, 0, 2], 0x26),
        (&[0xeb, 0, 0, 0], 0x27),
        (&[0xea, 3, 0], 0x27),
        (&[0xe7, 0, 0, 2], 0x26),
        (&[0xe7, 0, 1, 0], 0x28),
        (&[0xe8, 2, 0, 0, 0], 0x22),
        (&[0xe4, 0, 0, 0, 1], 0x23),
        (&[0xe4, 0, 2, 0, 0], 0x26),
    ] {
        assert_eq!(master.refused(command), code, "{command:02x?}");
    }
}

#[test]
fn a_checksum_is_that_of_the_bytes_that_are_uploaded() {
    let mut master = Master::connected();
    let size = 8 * master.layout.parameters.len();
    let point = [&[0xf6, 0, 0, 0][..], &PARAMETERS.to_le_bytes()].concat();
    master.get(&point);
    let bytes = master.upload(size);
    let mut sum = flate2::Crc::new();
    sum.update(&bytes);
    master.get(&point);
    let answer = master.get(&[&[0xf3, 0, 0, 0][..], &(size as u32).to_le_bytes()].concat());
    assert_eq!(answer, [&[9, 0, 0][..], &sum.sum().to_le_bytes()].concat());
    // The pointer has moved to the end, where there is nothing.
    assert_eq!(master.refused(&[0xf5, 1]), 0x24);
    // The working page has the active values, to the bit.
    let preset: stickslip::Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let values = master.layout.values(&flatten(&preset)).into_iter().flat_map(f64::to_le_bytes);
    assert!(values.eq(bytes));
}

#[test]
fn the_description_and_what_it_belongs_to_are_uploaded() {
    let mut master = Master::connected();
    let mut identify = |kind: u8| {
        let answer = master.get(&[0xfa, kind]);
        assert_eq!(answer[..3], [0, 0, 0]);
        let length = u32::from_le_bytes(answer[3..].try_into().unwrap());
        String::from_utf8(master.upload(length as usize)).unwrap()
    };
    assert_eq!((identify(1).as_str(), identify(200).as_str()), ("stickslip", ""));
    let (description, epk) = (identify(4), identify(5));
    assert_eq!(*description, *master.description);
    assert!(description.contains(&format!("EPK \"{epk}\"")));
    let length = epk.len() as u8;
    let read = master.get(&[&[0xf4, length, 0, 0][..], &EPK.to_le_bytes()].concat());
    assert_eq!(String::from_utf8(read).unwrap(), epk);
    // Nothing of it, nor of what is measured, can be written.
    for address in [EPK, MEASUREMENTS] {
        assert_eq!(master.refused(&[&[0xed, 8, 0, 0][..], &address.to_le_bytes(), &[0; 8]].concat()), 0x23);
    }
}

#[test]
fn a_long_change_is_pending_and_an_aborted_one_has_no_response() {
    let mut master = Master::connected();
    let address = master.address(GAIN).to_le_bytes();
    let command = [&[0xed, 8, 0, 0][..], &address, &11.5f64.to_le_bytes()].concat();
    let mut out = Vec::new();
    let change = master.slave.receive(&command, &master.desk, &mut out).unwrap();
    assert_eq!(change, Change::Set(vec![(GAIN.into(), "11.5".into())]));
    master.slave.pending(&mut out);
    assert!(master.hear(&out).is_empty() && !out.is_empty());
    // No other command meanwhile; a master that aborts gets no response to it.
    assert_eq!(master.refused(&[0xfd]), 0x10);
    assert_eq!(master.refused(&[0xfc]), 0x00);
    let mut out = Vec::new();
    master.slave.pending(&mut out);
    master.slave.done(Ok(()), &mut out);
    assert!(out.is_empty() && !master.slave.is_waiting());
    master.get(&[0xfd]);
}
