//! Connection between the operator and an external controller in the loop: new parameter values go in, durations of
//! calls come out. The side inside the deadline neither waits nor frees memory.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_rt::pages::{Reader, Writer, exchange};
use stickslip_rt::{Durations, Quantiles};

use super::BUDGET;

/// Capacity of the ring of call durations: some seconds.
const CALLS: usize = 1 << 14;
/// Mask for the number of the values; 64 bits hold the number and the result.
const NUMBER: u64 = 0xffff_ffff;

/// The side of the operator.
pub struct OperatorSide {
    values: Writer<Vec<f64>>,
    result: Arc<AtomicU64>,
    failed: Arc<AtomicBool>,
    times: Consumer<CallTimes>,
    calls: Durations,
    responses: Durations,
    over_budget: u64,
    late: Arc<AtomicU64>,
}

/// The side inside the deadline.
pub(super) struct Line {
    values: Reader<Vec<f64>>,
    result: Arc<AtomicU64>,
    failed: Arc<AtomicBool>,
    times: Producer<CallTimes>,
    late: Arc<AtomicU64>,
}

/// Times of a sample [ns].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CallTimes {
    /// Duration of the call.
    pub(super) call: u64,
    /// Response time, if known.
    pub(super) response: Option<u64>,
}

/// Both sides, for active values.
pub(super) fn operator_side(values: &[f64]) -> (OperatorSide, Line) {
    let (writer, reader) = exchange(values.to_vec());
    let (result, failed) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
    let (times_in, times) = RingBuffer::new(CALLS);
    let (calls, responses) = (Durations::default(), Durations::default());
    let late = Arc::new(AtomicU64::new(0));
    let line =
        Line { values: reader, result: result.clone(), failed: failed.clone(), times: times_in, late: late.clone() };
    (OperatorSide { values: writer, result, failed, times, calls, responses, over_budget: 0, late }, line)
}

impl OperatorSide {
    /// Sends new values. Returns their number.
    pub fn put(&mut self, values: &[f64]) -> u64 {
        self.values.publish(values.to_vec()) & NUMBER
    }

    /// Result for the values of this number: 0 if accepted; `None` before the result.
    pub fn verdict(&self, number: u64) -> Option<i32> {
        let result = self.result.load(Ordering::Acquire);
        (result >> 32 == number).then_some(result as i32)
    }

    /// Whether it has failed.
    pub fn failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }

    /// Adds the calls made since the last count.
    pub fn count(&mut self) {
        while let Ok(CallTimes { call, response }) = self.times.pop() {
            self.calls.add(call);
            self.over_budget += u64::from(call > BUDGET);
            response.into_iter().for_each(|time| self.responses.add(time));
        }
    }

    /// Durations of calls, response times [ns], and number of calls longer than [`BUDGET`].
    pub fn durations(&self) -> (Quantiles, Quantiles, u64) {
        (self.calls.quantiles(), self.responses.quantiles(), self.over_budget)
    }

    /// Number of late torques.
    pub fn late(&self) -> u64 {
        self.late.load(Ordering::Relaxed)
    }
}

impl Line {
    /// New values, if there are any.
    pub(super) fn values(&mut self) -> Option<&[f64]> {
        self.values.take(0).then(|| self.values.page().as_slice())
    }

    /// Stores the result for the last values: 0 if accepted.
    pub(super) fn set_result(&self, code: i32) {
        let number = self.values.generation() & NUMBER;
        self.result.store(number << 32 | u64::from(code.cast_unsigned()), Ordering::Release);
    }

    /// Marks it as failed.
    pub(super) fn fail(&self) {
        self.failed.store(true, Ordering::Relaxed);
    }

    /// Counts a late torque.
    pub(super) fn late(&self) {
        self.late.fetch_add(1, Ordering::Relaxed);
    }

    /// Adds the times of a sample, unless the ring is full.
    pub(super) fn count(&mut self, times: CallTimes) {
        let _ = self.times.push(times);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_go_in_and_their_results_come_out() {
        let (mut operator, mut line) = operator_side(&[1.0]);
        assert_eq!(line.values(), None, "the initial values");
        let first = operator.put(&[2.0]);
        assert_eq!(operator.verdict(first), None, "no result yet");
        assert_eq!(line.values(), Some(&[2.0][..]));
        assert_eq!(line.values(), None, "once");
        line.set_result(-3);
        assert_eq!(operator.verdict(first), Some(-3));
        let second = operator.put(&[3.0]);
        assert_eq!(operator.verdict(second), None, "the result belongs to the previous values");
        assert_eq!(line.values(), Some(&[3.0][..]));
        line.set_result(0);
        assert_eq!((operator.verdict(second), operator.failed()), (Some(0), false));
        line.fail();
        assert!(operator.failed());
        line.count(CallTimes { call: BUDGET + 1, response: None });
        line.count(CallTimes { call: 7, response: Some(9) });
        operator.count();
        let (calls, responses, over_budget) = operator.durations();
        assert_eq!((calls.count, responses.count, responses.max, over_budget), (2, 1, 9, 1));
        line.late();
        assert_eq!(operator.late(), 1);
        assert!(calls.max > BUDGET);
    }
}
