//! State of the whole bench at the start of one cycle, required by a record that does not start with the first cycle.
//!
//! The loop fills a preallocated row of numbers and returns it to the caller; it never waits.

use std::thread;
use std::time::{Duration, Instant};

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_core::snapshot::{StateVisitor, fields};
use stickslip_core::tick::Measurement;
use stickslip_software::cycle::Software;

use crate::io::Io;
use stickslip_base::Error;

/// Maximum number of values of a state: several times the typical number.
const ROOM: usize = 1 << 14;
/// Time-out for the answer of the loop. A running loop answers within a few cycles.
const PATIENCE: Duration = Duration::from_secs(2);
/// Polling interval.
const LOOK: Duration = Duration::from_micros(200);

/// State of software and machine at the start of a cycle, before the changes of that cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyframe {
    /// Number of the cycle.
    pub cycle: u64,
    /// Values of the state.
    pub numbers: Vec<f64>,
}

/// Buffer for a state.
#[derive(Debug)]
pub(super) struct Row {
    cycle: u64,
    numbers: Vec<f64>,
    full: bool,
}

impl StateVisitor for Row {
    fn number(&mut self, value: &mut f64) {
        // It never grows, which would allocate inside the deadline.
        if self.numbers.len() < self.numbers.capacity() { self.numbers.push(*value) } else { self.full = true }
    }
}

/// Visits the whole state: software, readings at the start of the cycle, machine.
pub(crate) fn keep(
    keep: &mut dyn StateVisitor,
    software: &mut Software,
    readings: &mut Measurement<f64>,
    machine: Option<&mut dyn Io>,
) {
    software.keep(keep);
    fields(keep, readings);
    if let Some(machine) = machine {
        machine.keep(keep);
    }
}

/// End of the loop.
#[derive(Debug)]
pub(super) struct KeyframeResponder {
    rows: Consumer<Box<Row>>,
    back: Producer<Box<Row>>,
}

impl KeyframeResponder {
    /// Answers a request, if there is one.
    pub(super) fn answer(&mut self, software: &mut Software, readings: &mut Measurement<f64>, machine: &mut dyn Io) {
        let Ok(mut row) = self.rows.pop() else { return };
        row.cycle = software.cycle();
        keep(&mut *row, software, readings, Some(machine));
        // There is one row, and room for it.
        let _ = self.back.push(row);
    }
}

/// End of the caller.
#[derive(Debug)]
pub struct Keyframes {
    requests: Producer<Box<Row>>,
    filled: Consumer<Box<Row>>,
    /// `None` while the loop has it.
    row: Option<Box<Row>>,
}

/// Both ends.
pub(super) fn keyframes() -> (Keyframes, KeyframeResponder) {
    let (requests, rows) = RingBuffer::new(1);
    let (back, filled) = RingBuffer::new(1);
    let row = Box::new(Row { cycle: 0, numbers: Vec::with_capacity(ROOM), full: false });
    (Keyframes { requests, filled, row: Some(row) }, KeyframeResponder { rows, back })
}

impl Keyframes {
    /// Returns the state of one of the next cycles.
    ///
    /// # Errors
    /// [`Error::BenchFault`] if the loop has ended.
    pub fn take(&mut self) -> Result<Keyframe, Error> {
        let fault = |reason: &str| Error::BenchFault { cycle: 0, reason: reason.into() };
        let start = Instant::now();
        if let Some(mut row) = self.row.take() {
            row.numbers.clear();
            row.full = false;
            // There is room while the row is here.
            let _ = self.requests.push(row);
        } else if let Ok(mut late) = self.filled.pop() {
            // The answer to a request that timed out.
            late.numbers.clear();
            late.full = false;
            let _ = self.requests.push(late);
        }
        loop {
            if let Ok(row) = self.filled.pop() {
                let keyframe = Keyframe { cycle: row.cycle, numbers: row.numbers.clone() };
                let full = row.full;
                self.row = Some(row);
                return if full {
                    Err(fault("the state of the bench exceeds the size of the keyframe buffer"))
                } else {
                    Ok(keyframe)
                };
            }
            if self.requests.is_abandoned() || start.elapsed() > PATIENCE {
                return Err(fault("the real-time loop does not answer; restart the bench"));
            }
            thread::sleep(LOOK);
        }
    }
}
