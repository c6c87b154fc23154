//! A controller in the loop, and whoever operates it: other values on their way in, and how long its calls take on the way
//! out. The side within the deadline waits for nothing and frees nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_rt::pages::{Reader, Writer, exchange};
use stickslip_rt::{Durations, Quantiles};

use super::BUDGET;

/// Calls that may wait to be counted: some seconds of them.
const CALLS: usize = 1 << 14;
/// In 64 bits: which values, and what was answered to them.
const NUMBER: u64 = 0xffff_ffff;

/// The side of whoever operates.
pub struct OperatorSide {
    values: Writer<Vec<f64>>,
    verdict: Arc<AtomicU64>,
    failed: Arc<AtomicBool>,
    took: Consumer<Took>,
    calls: Durations,
    responses: Durations,
    over_budget: u64,
    late: Arc<AtomicU64>,
}

/// The side within the deadline.
pub(super) struct Line {
    values: Reader<Vec<f64>>,
    verdict: Arc<AtomicU64>,
    failed: Arc<AtomicBool>,
    took: Producer<Took>,
    late: Arc<AtomicU64>,
}

/// How long a sample took [ns].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Took {
    /// The call.
    pub(super) call: u64,
    /// From the question until the answer was there, where that is known.
    pub(super) response: Option<u64>,
}

/// Both sides, for values that are in force.
pub(super) fn console(values: &[f64]) -> (OperatorSide, Line) {
    let (writer, reader) = exchange(values.to_vec());
    let (verdict, failed) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
    let (took_in, took) = RingBuffer::new(CALLS);
    let (calls, responses) = (Durations::default(), Durations::default());
    let late = Arc::new(AtomicU64::new(0));
    let line =
        Line { values: reader, verdict: verdict.clone(), failed: failed.clone(), took: took_in, late: late.clone() };
    (OperatorSide { values: writer, verdict, failed, took, calls, responses, over_budget: 0, late }, line)
}

impl OperatorSide {
    /// Gives it other values: their number.
    pub fn put(&mut self, values: &[f64]) -> u64 {
        self.values.publish(values.to_vec()) & NUMBER
    }

    /// What it says of the values of this number: 0 where it takes them, none where it has said nothing yet.
    pub fn verdict(&self, number: u64) -> Option<i32> {
        let verdict = self.verdict.load(Ordering::Acquire);
        (verdict >> 32 == number).then_some(verdict as i32)
    }

    /// Whether it has failed, and does not control any more.
    pub fn failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// Counts the calls that were made since.
    pub fn count(&mut self) {
        while let Ok(Took { call, response }) = self.took.pop() {
            self.calls.add(call);
            self.over_budget += u64::from(call > BUDGET);
            response.into_iter().for_each(|time| self.responses.add(time));
        }
    }

    /// How long calls took, and how long until their answers were there [ns]; how many took longer than [`BUDGET`].
    pub fn durations(&self) -> (Quantiles, Quantiles, u64) {
        (self.calls.quantiles(), self.responses.quantiles(), self.over_budget)
    }

    /// How many torques were not there when they were due.
    pub fn late(&self) -> u64 {
        self.late.load(Ordering::Relaxed)
    }
}

impl Line {
    /// Other values that have come since.
    pub(super) fn values(&mut self) -> Option<&[f64]> {
        self.values.take(0).then(|| self.values.page().as_slice())
    }

    /// What is said of the values that came last: 0 takes them.
    pub(super) fn say(&self, code: i32) {
        let number = self.values.generation() & NUMBER;
        self.verdict.store(number << 32 | u64::from(code.cast_unsigned()), Ordering::Release);
    }

    /// It does not control any more.
    pub(super) fn fail(&self) {
        self.failed.store(true, Ordering::Relaxed);
    }

    /// A torque was not there when it was due.
    pub(super) fn late(&self) {
        self.late.fetch_add(1, Ordering::Relaxed);
    }

    /// How long a sample took. What finds no room is not counted.
    pub(super) fn took(&mut self, took: Took) {
        let _ = self.took.push(took);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_go_in_and_what_is_said_of_them_comes_out() {
        let (mut console, mut line) = console(&[1.0]);
        assert_eq!(line.values(), None, "those it began with");
        let first = console.put(&[2.0]);
        assert_eq!(console.verdict(first), None, "nobody has said anything");
        assert_eq!(line.values(), Some(&[2.0][..]));
        assert_eq!(line.values(), None, "once");
        line.say(-3);
        assert_eq!(console.verdict(first), Some(-3));
        let second = console.put(&[3.0]);
        assert_eq!(console.verdict(second), None, "what was said is of other values");
        assert_eq!(line.values(), Some(&[3.0][..]));
        line.say(0);
        assert_eq!((console.verdict(second), console.failed()), (Some(0), false));
        line.fail();
        assert!(console.failed());
        line.took(Took { call: BUDGET + 1, response: None });
        line.took(Took { call: 7, response: Some(9) });
        console.count();
        let (calls, responses, over_budget) = console.durations();
        assert_eq!((calls.count, responses.count, responses.max, over_budget), (2, 1, 9, 1));
        line.late();
        assert_eq!(console.late(), 1);
        assert!(calls.max > BUDGET);
    }
}
