//! Batches: every row is in one, or missing before one.

use crate::RecordingError;
use proptest::prelude::*;

use super::{rows, stream_into};
use crate::capture::{Batch, Batches, Sink as _, Stream};
use stickslip_base::Error;

const LIMIT: usize = 1 << 20;

proptest! {
    #[test]
    fn each_cycle_is_in_a_batch_or_missing_before_one(
        rows in rows(200),
        room in 1..40_usize,
        takes in prop::collection::vec(any::<bool>(), 200),
    ) {
        let (mut stream, tap) = stream_into(Batches::new(vec![0], room, LIMIT).unwrap());
        let mut batches_taken: Vec<Batch> = Vec::new();
        for ((cycle, value), takes) in rows.iter().zip(&takes) {
            stream.push(*cycle, &[*value]).unwrap();
            let batches = stream.get_mut(&tap).unwrap();
            prop_assert!(batches.account().balances());
            if *takes {
                batches_taken.extend(std::iter::from_fn(|| batches.take()));
            }
        }
        let mut batches = stream.remove(tap).unwrap();
        batches_taken.extend(std::iter::from_fn(|| batches.take()));
        let mut next = rows[0].0;
        for batch in &batches_taken {
            prop_assert_eq!(batch.from, next + batch.missing);
            prop_assert!(batch.rows() > 0 && batch.rows() <= room.max(1));
            next = batch.from + batch.rows() as u64;
            for (cycle, value) in (batch.from..).zip(batch.column(0)) {
                let expected = rows.iter().find(|row| row.0 == cycle).unwrap().1;
                prop_assert!(expected == value || expected.is_nan() && value.is_nan());
            }
        }
        prop_assert_eq!(next, rows.last().unwrap().0 + 1, "the newest row is always available");
        let missing: u64 = batches_taken.iter().map(|batch| batch.missing).sum();
        let account = batches.account();
        prop_assert_eq!(missing, account.discarded + account.lost);
    }
}

#[test]
fn the_signals_of_a_batch_are_columns_in_the_requested_order() {
    let mut stream = Stream::new(3);
    let tap = stream.add(Batches::new(vec![2, 0], 100, LIMIT).unwrap()).unwrap();
    for cycle in 7..10 {
        stream.push(cycle, &[cycle as f64, 0.0, -(cycle as f64)]).unwrap();
    }
    let batch = stream.get_mut(&tap).unwrap().take().unwrap();
    assert_eq!((batch.from, batch.missing, batch.rows(), batch.signals()), (7, 0, 3, 2));
    let columns: Vec<Vec<f64>> = (0..2).map(|signal| batch.column(signal).collect()).collect();
    assert_eq!(columns, [[-7.0, -8.0, -9.0], [7.0, 8.0, 9.0]]);
    assert!(stream.get_mut(&tap).unwrap().take().is_none());
}

#[test]
fn nothing_to_stream_and_a_queue_that_is_too_long_are_refused() {
    assert!(matches!(Batches::new(vec![], 1, LIMIT), Err(Error::TooFew { .. })));
    assert!(matches!(Batches::new(vec![0], 0, LIMIT), Err(Error::TooFew { .. })));
    assert!(matches!(
        Batches::new(vec![0], 1 << 30, LIMIT).as_ref().err().and_then(|error| error.of()),
        Some(RecordingError::TooMuchMemory { .. })
    ));
}
