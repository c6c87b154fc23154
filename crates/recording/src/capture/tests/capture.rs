//! Captures against their definition by sets of cycles.

use crate::RecordingError;
use proptest::prelude::*;

use super::{rows, stream_into};
use crate::capture::{Capture, Gap, Keep, Plan, Segment, Sink, Stage, Stream, Trigger};
use stickslip_base::Error;

const LIMIT: usize = 1 << 23;

fn plan(before: u64, after: u64, decimation: u64, keep: Keep) -> Plan {
    Plan { signals: vec![0], decimation, before, after, keep }
}

fn capture(plan: Plan, trigger: &str) -> Capture {
    Capture::new(plan, &trigger.parse().unwrap(), &["v"], LIMIT).unwrap()
}

/// The segments over rows whose value is the cycle.
fn segments(capture: Capture, cycles: impl IntoIterator<Item = u64>) -> Vec<Segment> {
    let (mut stream, tap) = stream_into(capture);
    for cycle in cycles {
        stream.push(cycle, &[cycle as f64]).unwrap();
    }
    let mut capture = stream.remove(tap).unwrap();
    std::iter::from_fn(|| capture.take()).collect()
}

#[test]
fn the_trigger_is_at_the_stated_row_with_the_requested_ticks_around_it() {
    let shot = capture(plan(100, 50, 1, Keep::First(1)), "v rises through 1000");
    let segment = &segments(shot, 0..5000)[0];
    assert_eq!(segment.cycles, (900..=1050).collect::<Vec<_>>());
    assert_eq!((segment.trigger, segment.event, segment.missing, segment.lost()), (100, Some(1000), 0, 0));
    let times: Vec<_> = segment.times(0.25).collect();
    assert_eq!((times[0], times[100], times[150]), (-25.0, 0.0, 12.5));
}

#[test]
fn a_decimated_segment_is_even_and_has_its_trigger_on_a_row() {
    let shot = capture(plan(100, 50, 7, Keep::First(1)), "v rises through 1003");
    let segment = &segments(shot, 0..5000)[0];
    assert_eq!(segment.cycles[segment.trigger], 1003);
    assert!(segment.cycles.windows(2).all(|pair| pair[1] - pair[0] == 7));
    assert_eq!((segment.cycles[0], segment.cycles[segment.rows() - 1]), (1003 - 14 * 7, 1003 + 7 * 7));
}

#[test]
fn an_early_trigger_has_the_number_of_missing_ticks() {
    let shot = capture(plan(100, 0, 1, Keep::First(1)), "v rises through 30");
    let segment = &segments(shot, 10..50)[0];
    assert_eq!((segment.trigger, segment.from, segment.missing), (20, 10, 80));
}

#[test]
fn gaps_are_at_the_lost_rows() {
    let shot = capture(plan(5, 5, 3, Keep::First(1)), "v rises through 9");
    let arrived = [0, 1, 2, 3, 6, 7, 10, 11, 13, 14, 17, 18];
    let segment = &segments(shot, arrived)[0];
    // 8 and 9 are lost: the edge may have been there; the first row after it is 10.
    assert_eq!((segment.event, segment.event_lost, segment.cycles[segment.trigger]), (Some(10), 2, 10));
    let gaps = [(5, 1), (8, 2), (12, 1), (15, 1)].map(|(cycle, lost)| Gap { cycle, lost });
    assert_eq!((segment.from, segment.to, &segment.gaps[..]), (5, 15, &gaps[..]));
    assert_eq!(segment.cycles, [7, 10, 13]);
}

#[test]
fn rows_lost_immediately_after_a_capture_was_added_are_lost_not_missing() {
    let mut stream = Stream::new(1);
    stream.push(0, &[0.0]).unwrap();
    let tap = stream.add(capture(plan(3, 0, 1, Keep::First(1)), "v is 5")).unwrap();
    stream.push(5, &[5.0]).unwrap();
    let segment = stream.get_mut(&tap).unwrap().take().unwrap();
    assert_eq!((segment.from, segment.missing, &segment.gaps[..]), (2, 0, &[Gap { cycle: 2, lost: 3 }][..]));
}

#[test]
fn a_trigger_on_a_signal_that_the_rows_do_not_have_is_refused() {
    let trigger: Trigger = "w above 0".parse().unwrap();
    let capture = Capture::new(plan(0, 0, 1, Keep::First(1)), &trigger, &["v", "w"], LIMIT).unwrap();
    assert!(matches!(Stream::new(1).add(capture), Err(Error::Dimension { found: 1, expected: 2, .. })));
}

#[test]
fn a_delay_moves_the_trigger_and_a_hold_off_ignores_events() {
    let delayed = capture(plan(2, 1, 1, Keep::First(1)), "v rises through 10, delay 5");
    let segment = &segments(delayed, 0..40)[0];
    assert_eq!((segment.event, &segment.cycles[..], segment.trigger), (Some(10), &[13, 14, 15, 16][..], 2));

    let starts = |trigger| {
        let segments = segments(capture(plan(0, 1, 1, Keep::First(9)), trigger), 0..20);
        segments.iter().map(|segment| segment.from).collect::<Vec<_>>()
    };
    assert_eq!(starts("v above 4"), [5, 7, 9, 11, 13, 15, 17]);
    assert_eq!(starts("v above 4, hold-off 5"), [5, 11, 17]);
}

#[test]
fn without_an_event_an_automatic_trigger_follows() {
    let auto = capture(plan(3, 2, 1, Keep::First(3)), "v rises through 14, auto 10");
    let triggers = segments(auto, 0..50).iter().map(|s| (s.cycles[s.trigger], s.event)).collect::<Vec<_>>();
    assert_eq!(triggers, [(10, None), (14, Some(14)), (27, None)]);
}

#[test]
fn stages_follow_each_other() {
    let (mut stream, tap) = stream_into(capture(plan(3, 2, 1, Keep::First(1)), "v rises through 5, delay 2"));
    let mut stages = vec![stream.get(&tap).unwrap().stage()];
    for cycle in 0..12 {
        stream.push(cycle, &[cycle as f64]).unwrap();
        stages.push(stream.get(&tap).unwrap().stage());
    }
    use Stage::{Armed, Complete, Delayed, Filling, Triggered};
    let expected = [(3, Filling), (3, Armed), (2, Delayed), (2, Triggered), (3, Complete)];
    assert_eq!(stages, expected.iter().flat_map(|&(times, stage)| vec![stage; times]).collect::<Vec<_>>());
}

#[test]
fn the_latest_segments_replace_those_that_were_not_taken() {
    let (mut stream, tap) = stream_into(capture(plan(0, 0, 1, Keep::Latest(2)), "v above 2"));
    for cycle in 0..8 {
        stream.push(cycle, &[cycle as f64]).unwrap();
    }
    let capture = stream.get(&tap).unwrap();
    assert_eq!(capture.segments().map(|segment| segment.from).collect::<Vec<_>>(), [6, 7]);
    let account = capture.account();
    assert_eq!((account.produced, account.stored, account.discarded), (8, 2, 6));
}

#[test]
fn a_plan_above_its_limit_is_refused_with_both_numbers() {
    let plan = plan(1000, 1000, 10, Keep::First(3));
    let bytes = usize::try_from(plan.bytes()).unwrap();
    let trigger: Trigger = "immediate".parse().unwrap();
    assert!(Capture::new(plan.clone(), &trigger, &["v"], bytes).is_ok());
    let message = Capture::new(plan.clone(), &trigger, &["v"], bytes - 1).unwrap_err().to_string();
    assert!(message.starts_with(&format!("the capture requires {bytes} bytes; the limit is {} bytes.", bytes - 1)));
    let endless = Plan { before: u64::MAX, after: u64::MAX, keep: Keep::Latest(usize::MAX), ..plan };
    assert!(matches!(
        Capture::new(endless, &trigger, &["v"], usize::MAX).as_ref().err().and_then(|error| error.of()),
        Some(RecordingError::TooMuchMemory { .. })
    ));
}

#[test]
fn a_plan_that_keeps_nothing_is_refused() {
    let trigger: Trigger = "immediate".parse().unwrap();
    let good = plan(1, 1, 1, Keep::First(1));
    for bad in [
        Plan { signals: Vec::new(), ..good.clone() },
        Plan { decimation: 0, ..good.clone() },
        Plan { keep: Keep::First(0), ..good.clone() },
        Plan { keep: Keep::Latest(0), ..good },
    ] {
        assert!(matches!(Capture::new(bad, &trigger, &["v"], LIMIT), Err(Error::TooFew { found: 0, .. })));
    }
}

#[test]
fn memory_stays_within_the_stated_limit() {
    for (keep, segments) in [(Keep::First(1), 1), (Keep::Latest(1), 2), (Keep::Latest(3), 4)] {
        let plan = Plan { signals: vec![0; 20], ..plan(1000, 1000, 1, keep) };
        let (bytes, history) = (plan.bytes(), 1000 * 8 * 21);
        let (mut stream, tap) = stream_into(capture(plan, "immediate, delay 1000"));
        // Each second row is lost: the largest possible number of gaps. The last segment is almost full.
        for cycle in (0..2001 * 4 - 2).step_by(2) {
            stream.push(cycle, &[0.0]).unwrap();
        }
        let capture = stream.get(&tap).unwrap();
        let actual: Vec<_> = capture.segments().chain(capture.growing()).collect();
        let size = |segment: &&Segment| {
            let columns: usize = segment.columns.iter().map(|column| 24 + 8 * column.capacity()).sum();
            8 * segment.cycles.capacity() + columns + 16 * segment.gaps.capacity() + size_of::<Segment>()
        };
        let size = actual.iter().map(size).sum::<usize>() + history;
        assert_eq!(actual.len(), segments);
        assert!(size as u128 <= bytes, "{size} of {bytes} with {keep:?}");
    }
}

/// The segments by definition, and the rows in the history afterwards.
fn by_definition(
    rows: &[(u64, f64)],
    plan: &Plan,
    hold_off: u64,
    delay: u64,
    auto: Option<u64>,
) -> (Vec<Expected>, u64) {
    let came = |from: u64, to: u64| rows.iter().map(|row| row.0).filter(move |&cycle| from <= cycle && cycle <= to);
    let (mut segments, mut first, mut quiet) = (Vec::new(), rows[0].0, 0);
    loop {
        // "v rises through 0": from less to as much or more, with NaN ignored.
        let numbers: Vec<_> = rows.iter().filter(|row| !row.1.is_nan()).collect();
        let mut events = numbers.windows(2).filter(|pair| pair[0].1 < 0.0 && pair[1].1 >= 0.0).map(|pair| pair[1].0);
        let event = events.find(|&cycle| cycle >= first && cycle >= quiet);
        let automatic = auto.and_then(|ticks| came(first + ticks, u64::MAX).next());
        let (event, trigger) = match (event, automatic) {
            (event, Some(cycle)) if event.is_none_or(|event| cycle < event) => (None, cycle),
            (Some(event), _) => {
                quiet = event + hold_off + 1;
                match came(event + delay, u64::MAX).next() {
                    Some(trigger) => (Some(event), trigger),
                    None => break,
                }
            }
            _ => break,
        };
        let (from, to) = (trigger.saturating_sub(plan.before).max(first), trigger + plan.after);
        let stored = came(from, to).filter(|cycle| cycle.abs_diff(trigger) % plan.decimation == 0).collect();
        let last = rows[rows.len() - 1].0;
        let lost = (from..=to.min(last)).filter(|&cycle| came(cycle, cycle).next().is_none()).collect();
        segments.push(Expected { event, trigger, from, to, stored, lost });
        first = to + 1;
        if to > last || matches!(plan.keep, Keep::First(most) if segments.len() == most) {
            return (segments, 0);
        }
    }
    (segments, (came(first, u64::MAX).count() as u64).min(plan.before))
}

struct Expected {
    event: Option<u64>,
    trigger: u64,
    from: u64,
    to: u64,
    stored: Vec<u64>,
    lost: Vec<u64>,
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn captures_are_as_defined_and_no_cycle_is_unaccounted_for(
        rows in rows(120),
        before in 0..20_u64, after in 0..20_u64, decimation in 1..5_u64, segments in 1..6_usize, latest: bool,
        hold_off in prop_oneof![Just(0), 0..60_u64], delay in prop_oneof![Just(0), 0..30_u64],
        auto in prop::option::of(0..50_u64),
    ) {
        let keep = if latest { Keep::Latest(segments) } else { Keep::First(segments) };
        let plan = plan(before, after, decimation, keep);
        let auto_text = auto.map_or(String::new(), |ticks| format!(", auto {ticks}"));
        let trigger = format!("v rises through 0, hold-off {hold_off}, delay {delay}{auto_text}");
        let (mut stream, tap) = stream_into(capture(plan.clone(), &trigger));
        for &(cycle, value) in &rows {
            stream.push(cycle, &[value]).unwrap();
            let account = stream.get(&tap).unwrap().account();
            prop_assert!(account.balances(), "{account:?} at {cycle}");
        }
        let capture = stream.remove(tap).unwrap();
        let (expected, history) = by_definition(&rows, &plan, hold_off, delay, auto);
        let produced = rows[rows.len() - 1].0 - rows[0].0 + 1;
        let rows_stored: usize = capture.segments().chain(capture.growing()).map(Segment::rows).sum();
        let account = capture.account();
        prop_assert_eq!((account.produced, account.lost), (produced, produced - rows.len() as u64));
        prop_assert_eq!(account.stored, rows_stored as u64 + history);

        let actual: Vec<_> = capture.segments().chain(capture.growing()).collect();
        let open = usize::from(capture.growing().is_some());
        let dropped = if latest { (expected.len() - open).saturating_sub(segments) } else { 0 };
        prop_assert_eq!(actual.len(), expected.len() - dropped);
        for (segment, expected) in actual.iter().zip(&expected[dropped..]) {
            prop_assert_eq!(segment.event, expected.event);
            prop_assert_eq!(segment.cycles[segment.trigger], expected.trigger);
            prop_assert_eq!((segment.from, segment.to), (expected.from, expected.to));
            prop_assert_eq!(segment.missing, before - (expected.trigger - expected.from));
            prop_assert_eq!(&segment.cycles, &expected.stored);
            let lost: Vec<_> = segment.gaps.iter().flat_map(|gap| gap.cycle..gap.cycle + gap.lost).collect();
            prop_assert_eq!(&lost, &expected.lost);
            for (cycle, value) in segment.cycles.iter().zip(&segment.columns[0]) {
                let row = rows.iter().find(|row| row.0 == *cycle).unwrap();
                prop_assert_eq!(row.1.to_bits(), value.to_bits());
            }
        }
    }
}
