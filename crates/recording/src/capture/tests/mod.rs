//! Tests of the module against definitions by sets and by brute force.

mod batches;
mod capture;
mod pyramid;
mod stream;
mod trigger;

use proptest::prelude::*;

use super::{Extremes, Sink, Stream, Tap};

/// Cycles with gaps, and a value of each: few values, so that levels are reached exactly, and NaN.
fn rows(most: usize) -> impl Strategy<Value = Vec<(u64, f64)>> {
    let lost = prop_oneof![12 => Just(0_u64), 2 => 1..4_u64, 1 => 4..40_u64];
    let value = prop_oneof![12 => (-4..=4_i32).prop_map(|n| f64::from(n) / 2.0), 1 => Just(f64::NAN)];
    (0..50_u64, prop::collection::vec((lost, value), 1..most)).prop_map(|(mut next, rows)| {
        let row = |(lost, value)| {
            next += lost + 1;
            (next - 1, value)
        };
        rows.into_iter().map(row).collect()
    })
}

/// A stream of one signal with one sink.
fn stream_into<S: Sink>(sink: S) -> (Stream, Tap<S>) {
    let mut stream = Stream::new(1);
    let tap = stream.add(sink).unwrap();
    (stream, tap)
}

/// The extremes of samples by definition.
fn extremes(samples: &[f64]) -> Extremes {
    let numbers = || samples.iter().copied().filter(|sample| !sample.is_nan());
    Extremes {
        min: numbers().reduce(f64::min).unwrap_or(f64::NAN),
        max: numbers().reduce(f64::max).unwrap_or(f64::NAN),
        nan: samples.iter().any(|sample| sample.is_nan()),
    }
}

/// Equal as numbers, NaN equal to NaN.
fn same(a: Extremes, b: Extremes) -> bool {
    let number = |a: f64, b: f64| a == b || a.is_nan() && b.is_nan();
    number(a.min, b.min) && number(a.max, b.max) && a.nan == b.nan
}
