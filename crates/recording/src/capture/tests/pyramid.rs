//! The pyramid against brute force.

use proptest::prelude::*;

use super::{extremes, rows, same, stream_into};
use crate::capture::{Extremes, Pyramid, Sink};

const LIMIT: usize = 1 << 24;

#[test]
fn a_whole_history_has_the_points_of_a_screen_and_keeps_every_spike() {
    let (mut stream, tap) = stream_into(Pyramid::new(vec![0], 1 << 16, LIMIT).unwrap());
    let spike = 41_234;
    for cycle in 0..60_000 {
        stream.push(cycle, &[if cycle == spike { 9.0 } else { 0.0 }]).unwrap();
    }
    let blocks = stream.get(&tap).unwrap().query(0..u64::MAX, 1000);
    assert!((500..=1000).contains(&blocks.len()), "{}", blocks.len());
    let with_spike: Vec<_> = blocks.iter().filter(|block| block.extremes[0].max == 9.0).collect();
    assert!(with_spike.len() == 1 && with_spike[0].cycles.contains(&spike));
}

#[test]
fn a_query_before_the_first_row_or_without_points_is_empty() {
    let mut pyramid = Pyramid::new(vec![0], 8, LIMIT).unwrap();
    assert!(pyramid.query(0..10, 5).is_empty());
    let mut stream = crate::capture::Stream::new(1);
    stream.push(0, &[1.0]).unwrap();
    pyramid = {
        let tap = stream.add(pyramid).unwrap();
        stream.push(5, &[1.0]).unwrap();
        stream.remove(tap).unwrap()
    };
    assert!(
        pyramid.query(5..6, 0).is_empty() && pyramid.query(6..9, 5).is_empty() && pyramid.query(3..3, 5).is_empty()
    );
    assert_eq!(pyramid.query(0..9, 5).len(), 1);
}

/// Cycles of a history with occasional losses longer than its capacity.
fn long_rows() -> impl Strategy<Value = Vec<(u64, f64)>> {
    (rows(400), prop::option::of((0..400_usize, 0..2000_u64))).prop_map(|(mut rows, pause)| {
        if let Some((from, lost)) = pause {
            rows.iter_mut().skip(from).for_each(|row| row.0 += lost);
        }
        rows
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]
    #[test]
    fn any_span_is_as_by_brute_force(
        rows in long_rows(), ticks in 1..300_u64, queries in prop::collection::vec((0..900_u64, 0..900_u64, 0..40_usize), 10)
    ) {
        let (mut stream, tap) = stream_into(Pyramid::new(vec![0], ticks, LIMIT).unwrap());
        for &(cycle, value) in &rows {
            stream.push(cycle, &[value]).unwrap();
            prop_assert!(stream.get(&tap).unwrap().account().balances());
        }
        let pyramid = stream.remove(tap).unwrap();
        let available = pyramid.cycles();
        let newest = rows[rows.len() - 1].0;
        prop_assert_eq!(available.end, newest + 1);
        // All cycles of the ring, since the first row after a gap that is longer than the ring.
        let room = ticks.next_power_of_two().max(8);
        let gap = rows.windows(2).rev().find(|pair| pair[1].0 - pair[0].0 > room);
        prop_assert_eq!(available.start, gap.map_or(rows[0].0, |pair| pair[1].0).max((newest + 1).saturating_sub(room)));
        let inside = rows.iter().filter(|row| available.contains(&row.0)).count() as u64;
        prop_assert_eq!(pyramid.account().stored, inside);

        for (from, length, points) in queries {
            let request = from..from + length;
            let blocks = pyramid.query(request.clone(), points);
            let span = request.start.max(available.start)..request.end.min(available.end);
            prop_assert_eq!(blocks.is_empty(), span.is_empty() || points == 0);
            prop_assert!(blocks.len() <= points);
            let Some(last) = blocks.last() else { continue };
            // Blocks of twice the length would be too coarse.
            prop_assert!(blocks.len() > points / 2 || blocks.iter().all(|block| block.cycles.end - block.cycles.start == 1));
            prop_assert_eq!(blocks[0].cycles.start..last.cycles.end, span);
            prop_assert!(blocks.windows(2).all(|pair| pair[0].cycles.end == pair[1].cycles.start));
            for block in &blocks {
                let samples: Vec<_> = rows.iter().filter(|row| block.cycles.contains(&row.0)).map(|row| row.1).collect();
                prop_assert_eq!(block.rows, samples.len() as u64);
                prop_assert!(same(block.extremes[0], extremes(&samples)), "{block:?} {samples:?}");
            }
        }
    }

    #[test]
    fn extremes_do_not_depend_on_how_samples_are_grouped(
        samples in prop::collection::vec(prop_oneof![-3.0..3.0, Just(f64::NAN), Just(f64::INFINITY)], 0..20), cut in 0..20_usize
    ) {
        let of = |samples: &[f64]| {
            let mut extremes = Extremes::NONE;
            samples.iter().for_each(|&sample| extremes.include(sample));
            extremes
        };
        let (left, right) = samples.split_at(cut.min(samples.len()));
        let mut merged = of(left);
        merged.merge(of(right));
        prop_assert!(same(merged, extremes(&samples)) && same(of(&samples), extremes(&samples)));
    }
}
