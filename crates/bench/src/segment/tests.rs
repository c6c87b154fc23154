//! Statistics and texts of a segment.

use super::*;
use stickslip_base::Summary;

fn devices() -> Vec<SegmentDevice> {
    let device = |name: &str, role| SegmentDevice { name: name.into(), role };
    vec![device("coupler", ""), device("left drive", "motor"), device("right drive", "load")]
}

const ENABLED: DriveRecord = DriveRecord { statusword: 0x0237, state: "operation enabled", error: 0 };

fn frame(offset: i32) -> FrameRecord {
    let mut states = [0; DEVICES];
    states[..3].fill(8);
    let (round_trip, counter) = (Some(40_000), 6);
    FrameRecord { round_trip, offset: Some(offset), counter, states, drives: [ENABLED; 2], left: None }
}

#[test]
fn offsets_are_summarised_since_the_start_and_in_the_last_complete_second() {
    let (segment, mut outlet) = Segment::new(devices(), 6, 1e-2);
    for at in 0..250 {
        // First second ±5 µs, second one 3 µs, then half a second at 9 µs.
        outlet.push(frame([if at % 2 == 0 { 5000 } else { -5000 }, 3000, 9000][at / 100]));
    }
    let SegmentStatus { frames, offset, last_second, distance, .. } = segment.status();
    assert_eq!(frames, 250);
    assert_eq!((offset.minimum, offset.maximum), (-5e-6, 9e-6));
    assert!((last_second.rms - 3e-6).abs() < 1e-12 && last_second.maximum == 3e-6, "{last_second:?}");
    assert!((distance[3] - 9e-6).abs() < 1e-8 && distance[0] <= 5.01e-6, "{distance:?}");
}

#[test]
fn lost_frames_and_other_working_counters_are_counted_apart() {
    let (segment, mut outlet) = Segment::new(devices(), 6, 1e-3);
    outlet.push(frame(0));
    outlet.push(FrameRecord { round_trip: None, offset: None, ..frame(0) });
    outlet.push(FrameRecord { counter: 3, ..frame(0) });
    let status = segment.status();
    assert_eq!((status.frames, status.lost, status.wrong, status.counter, status.expected), (3, 1, 1, 3, 6));
}

#[test]
fn a_full_ring_loses_records_and_does_not_block() {
    let (segment, mut outlet) = Segment::new(devices(), 6, 1e-3);
    (0..ROOM + 10).for_each(|_| outlet.push(frame(0)));
    assert_eq!(segment.status().frames, ROOM as u64);
}

#[test]
fn a_fault_is_stated_with_the_meaning_of_its_codes() {
    let (segment, mut outlet) = Segment::new(devices(), 6, 1e-3);
    let faulty = DriveRecord { statusword: 0x0218, state: "fault", error: 0x2310 };
    let mut record = FrameRecord { drives: [faulty, ENABLED], left: Some((2, 0x1B)), ..frame(0) };
    record.states[..3].copy_from_slice(&[0, 8, 0x14]);
    outlet.push(record);
    let lines = segment.status().lines();
    assert_eq!(
        lines[2..],
        [
            "frames by distance from that middle: 1 up to 1 µs",
            "frames by round trip: 1 up to 50 µs",
            "0 coupler: no answer: check supply and cable; when it answers, it is brought to OP while the bench is off or \
             has a fault",
            "1 left drive (motor): OP, fault (0x0218): error code 0x2310: over-current",
            "2 right drive (load): SAFE-OP, operation enabled (0x0237): AL status code 0x001B: watchdog: no set-points in \
             time",
        ]
    );
}

#[test]
fn the_summary_has_a_row_for_each_device() {
    let (segment, mut outlet) = Segment::new(devices(), 6, 1e-3);
    outlet.push(frame(-2500));
    let mut summary = Summary::new("serve");
    segment.status().add_to(&mut summary);
    assert_eq!((summary.value("segment.frames"), summary.value("segment.offset.minimum")), (Some(1.0), Some(-2.5e-6)));
    let text = summary.to_json();
    for part in ["\"name\": \"left drive\"", "\"state\": \"operation enabled\"", "\"al_state\": \"OP\""] {
        assert!(text.contains(part), "{text}");
    }
}
