//! Streams, their sinks, and envelopes.

use crate::RecordingError;
use proptest::prelude::*;

use super::{extremes, rows, same, stream_into};
use crate::capture::{Account, Envelope, Point, Pyramid, Row, Sink, Stream};
use stickslip_base::Error;

const LIMIT: usize = 1 << 24;

/// Stores all.
#[derive(Default)]
struct Counter(Account);

impl Sink for Counter {
    fn width(&self) -> usize {
        0
    }

    fn push(&mut self, row: Row<'_>) {
        self.0.arrive(&row);
        self.0.stored += 1;
    }

    fn account(&self) -> Account {
        self.0
    }
}

#[test]
fn an_invalid_row_is_refused_and_no_sink_gets_it() {
    let (mut stream, tap) = stream_into(Counter::default());
    stream.push(5, &[0.0]).unwrap();
    for cycle in [5, 4] {
        let message = stream.push(cycle, &[0.0]).unwrap_err().to_string();
        assert!(message.contains(&format!("row of cycle {cycle} after cycle 5")), "{message}");
    }
    assert!(matches!(
        stream.push(1 << 63, &[0.0]).as_ref().err().and_then(|error| error.of()),
        Some(RecordingError::RowOrder { .. })
    ));
    assert!(matches!(stream.push(6, &[0.0, 1.0]), Err(Error::Dimension { found: 2, expected: 1, .. })));
    assert_eq!(stream.get(&tap).unwrap().account().produced, 1);
    stream.push((1 << 63) - 1, &[0.0]).unwrap();
    assert_eq!((stream.lost(), stream.get(&tap).unwrap().account().lost), ((1 << 63) - 7, (1 << 63) - 7));
}

#[test]
fn a_sink_that_requires_more_signals_is_refused() {
    let mut stream = Stream::new(3);
    assert!(stream.add(Envelope::new(vec![2], 1, 1, LIMIT).unwrap()).is_ok());
    let refused = stream.add(Envelope::new(vec![3], 1, 1, LIMIT).unwrap());
    assert!(matches!(refused, Err(Error::Dimension { found: 3, expected: 4, .. })));
}

#[test]
fn a_tap_of_another_stream_has_no_effect() {
    let mut this_stream = Stream::new(1);
    let (_, other_tap) = stream_into(Counter::default());
    assert!(this_stream.get(&other_tap).is_none() && this_stream.get_mut(&other_tap).is_none());
    let tap = this_stream.add(Pyramid::new(vec![0], 8, LIMIT).unwrap()).unwrap();
    // The same number, but another kind of sink; it stays.
    assert!(this_stream.get(&other_tap).is_none() && this_stream.remove(other_tap).is_none());
    this_stream.push(0, &[1.0]).unwrap();
    assert_eq!(this_stream.get(&tap).unwrap().cycles(), 0..1);
}

#[test]
fn a_sink_without_rows_or_with_too_many_is_refused() {
    assert!(matches!(Envelope::new(Vec::new(), 1, 1, LIMIT), Err(Error::TooFew { .. })));
    assert!(matches!(Envelope::new(vec![0], 0, 1, LIMIT), Err(Error::TooFew { .. })));
    assert!(matches!(Envelope::new(vec![0], 1, 0, LIMIT), Err(Error::TooFew { .. })));
    assert!(matches!(
        Envelope::new(vec![0], 1, usize::MAX, usize::MAX).as_ref().err().and_then(|error| error.of()),
        Some(RecordingError::TooMuchMemory { .. })
    ));
    assert!(matches!(Pyramid::new(Vec::new(), 8, LIMIT), Err(Error::TooFew { .. })));
    assert!(matches!(
        Pyramid::new(vec![0], u64::MAX, usize::MAX).as_ref().err().and_then(|error| error.of()),
        Some(RecordingError::TooMuchMemory { .. })
    ));
}

#[test]
fn a_spike_of_one_tick_and_a_nan_are_both_in_their_point() {
    let (mut stream, tap) = stream_into(Envelope::new(vec![0], 100, 10, LIMIT).unwrap());
    for cycle in 0..200 {
        let value = if cycle == 37 { 5.0 } else { 0.0 };
        stream.push(cycle, &[if cycle == 60 { f64::NAN } else { value }]).unwrap();
    }
    let envelope = stream.get_mut(&tap).unwrap();
    let points = [envelope.take().unwrap(), envelope.take().unwrap()];
    let extremes_of_points =
        points.each_ref().map(|point| (point.extremes[0].min, point.extremes[0].max, point.extremes[0].nan));
    assert_eq!(extremes_of_points, [(0.0, 5.0, true), (0.0, 0.0, false)]);
}

#[test]
fn a_point_of_nothing_but_nan_is_nan() {
    let (mut stream, tap) = stream_into(Envelope::new(vec![0], 2, 10, LIMIT).unwrap());
    (0..2).for_each(|cycle| stream.push(cycle, &[f64::NAN]).unwrap());
    let point = stream.get_mut(&tap).unwrap().take().unwrap();
    assert!(point.extremes[0].min.is_nan() && point.extremes[0].max.is_nan() && point.extremes[0].nan);
    assert!(point.last[0].is_nan());
}

#[test]
fn a_point_comes_with_the_last_tick_of_its_window_and_marks_a_gap() {
    let (mut stream, tap) = stream_into(Envelope::new(vec![0], 4, 10, LIMIT).unwrap());
    let mut points_taken = Vec::new();
    for cycle in [2, 3, 4, 5, 14, 15] {
        stream.push(cycle, &[cycle as f64]).unwrap();
        let envelope = stream.get_mut(&tap).unwrap();
        points_taken.extend(std::iter::from_fn(|| envelope.take()).map(|p| (cycle, p.from, p.to, p.rows, p.missing)));
    }
    assert_eq!(points_taken, [(3, 2, 3, 2, 0), (14, 4, 5, 2, 0), (15, 14, 15, 2, 8)]);
}

/// Action on an envelope after a row.
#[derive(Clone, Debug)]
enum Act {
    Nothing,
    Take,
    Ticks(u64),
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn points_have_every_sample_once(
        rows in rows(150), ticks in 1..20_u64, room in 1..6_usize,
        acts in prop::collection::vec(
            prop_oneof![8 => Just(Act::Nothing), 2 => Just(Act::Take), 1 => (1..20_u64).prop_map(Act::Ticks)], 150),
    ) {
        let (mut stream, tap) = stream_into(Envelope::new(vec![0], ticks, room, LIMIT).unwrap());
        let (mut points, mut changes): (Vec<Point>, _) = (Vec::new(), vec![(0, ticks)]);
        for (&(cycle, value), act) in rows.iter().zip(&acts) {
            stream.push(cycle, &[value]).unwrap();
            let envelope = stream.get_mut(&tap).unwrap();
            match act {
                Act::Nothing => {}
                Act::Take => points.extend(envelope.take()),
                Act::Ticks(ticks) => {
                    envelope.set_ticks(*ticks).unwrap();
                    changes.push((cycle + 1, *ticks));
                }
            }
            prop_assert!(envelope.account().balances());
        }
        let envelope = stream.get_mut(&tap).unwrap();
        envelope.set_ticks(1).unwrap();
        points.extend(std::iter::from_fn(|| envelope.take()));
        let account = envelope.account();

        let mut next = rows[0].0;
        for point in &points {
            let samples: Vec<_> =
                rows.iter().filter(|row| point.from <= row.0 && row.0 <= point.to).map(|row| row.1).collect();
            prop_assert!(same(point.extremes[0], extremes(&samples)));
            prop_assert_eq!(point.rows, samples.len() as u64);
            prop_assert_eq!(point.last[0].to_bits(), samples[samples.len() - 1].to_bits());
            // Each cycle is a row of a point or missing before its last one, so that every drop is counted.
            prop_assert_eq!(point.to + 1, next + point.missing + point.rows);
            next = point.to + 1;
            // No point holds ticks of two windows, or of two widths.
            let width = |cycle| changes.iter().rev().find(|change| change.0 <= cycle).unwrap();
            prop_assert_eq!(width(point.from), width(point.to));
            prop_assert_eq!(point.from / width(point.from).1, point.to / width(point.from).1);
        }
        prop_assert_eq!(next, rows[rows.len() - 1].0 + 1);
        prop_assert_eq!(account.stored, points.iter().map(|point| point.rows).sum::<u64>());
        prop_assert_eq!(account.produced, next - rows[0].0);
    }

    #[test]
    fn added_and_removed_sinks_have_exact_accounts(
        rows in rows(100), visits in prop::collection::vec((0..100_usize, 0..100_usize), 1..5)
    ) {
        let mut stream = Stream::new(1);
        let mut taps: Vec<_> = visits.iter().map(|_| None).collect();
        let mut results = vec![None; visits.len()];
        for (i, &(cycle, value)) in rows.iter().enumerate() {
            for (visit, &(come, stay)) in visits.iter().enumerate() {
                if come == i {
                    taps[visit] = Some(stream.add(Counter::default()).unwrap());
                }
                if come + stay == i && let Some(tap) = taps[visit].take() {
                    results[visit] = Some(stream.remove(tap).unwrap().account());
                }
            }
            stream.push(cycle, &[value]).unwrap();
        }
        for (&(come, stay), result) in visits.iter().zip(results) {
            let Some(account) = result else { continue };
            // From the cycle after the newest row at its addition, to the newest row at its removal.
            let begin = if come == 0 { rows[0].0 } else { rows[come - 1].0 + 1 };
            let end = if come + stay == 0 { begin } else { rows[come + stay - 1].0 + 1 };
            let produced = end - begin;
            let stored = stay as u64;
            prop_assert_eq!(account, Account { produced, stored, discarded: 0, lost: produced - stored });
        }
    }
}
