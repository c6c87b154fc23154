//! The state of the whole bench at the begin of one cycle: what a record needs that does not begin with the first one.
//!
//! The loop fills a row of numbers that was allocated before and comes back to whoever asked: it waits for nobody.

use std::thread;
use std::time::{Duration, Instant};

use rtrb::{Consumer, Producer, RingBuffer};
use stickslip_core::cycle::Software;
use stickslip_core::snapshot::{StateVisitor, fields};
use stickslip_core::tick::Measurement;

use crate::io::Io;
use stickslip_base::Error;

/// Numbers that a state may have: several times what it takes.
const ROOM: usize = 1 << 14;
/// How long the loop may take to answer: one that lives does within a few cycles.
const PATIENCE: Duration = Duration::from_secs(2);
/// From look to look.
const LOOK: Duration = Duration::from_micros(200);

/// The state of software and machine at the begin of a cycle, before the changes that come with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Keyframe {
    /// The cycle.
    pub cycle: u64,
    /// Its numbers.
    pub numbers: Vec<f64>,
}

/// Where it is written.
#[derive(Debug)]
pub(super) struct Row {
    cycle: u64,
    numbers: Vec<f64>,
    full: bool,
}

impl StateVisitor for Row {
    fn number(&mut self, value: &mut f64) {
        // It never grows: that would allocate within the deadline.
        if self.numbers.len() < self.numbers.capacity() { self.numbers.push(*value) } else { self.full = true }
    }
}

/// Walks all that the next cycles depend on: software, readings at the begin of the cycle, machine.
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

/// The loop's end.
#[derive(Debug)]
pub(super) struct Asked {
    rows: Consumer<Box<Row>>,
    back: Producer<Box<Row>>,
}

impl Asked {
    /// Answers, where somebody asked.
    pub(super) fn answer(&mut self, software: &mut Software, readings: &mut Measurement<f64>, machine: &mut dyn Io) {
        let Ok(mut row) = self.rows.pop() else { return };
        row.cycle = software.cycle();
        keep(&mut *row, software, readings, Some(machine));
        // There is one row, and room for it.
        let _ = self.back.push(row);
    }
}

/// The end of whoever asks.
#[derive(Debug)]
pub struct Keyframes {
    asked: Producer<Box<Row>>,
    given: Consumer<Box<Row>>,
    /// None while the loop has it.
    row: Option<Box<Row>>,
}

/// Both ends.
pub(super) fn keyframes() -> (Keyframes, Asked) {
    let (asked, rows) = RingBuffer::new(1);
    let (back, given) = RingBuffer::new(1);
    let row = Box::new(Row { cycle: 0, numbers: Vec::with_capacity(ROOM), full: false });
    (Keyframes { asked, given, row: Some(row) }, Asked { rows, back })
}

impl Keyframes {
    /// The state of one of the next cycles.
    ///
    /// # Errors
    /// [`Error::BenchFault`] where the loop does not run any more.
    pub fn take(&mut self) -> Result<Keyframe, Error> {
        let fault = |reason: &str| Error::BenchFault { cycle: 0, reason: reason.into() };
        let begin = Instant::now();
        if let Some(mut row) = self.row.take() {
            row.numbers.clear();
            row.full = false;
            // Room is where the row is here.
            let _ = self.asked.push(row);
        } else if let Ok(mut late) = self.given.pop() {
            // The answer to one who gave up.
            late.numbers.clear();
            late.full = false;
            let _ = self.asked.push(late);
        }
        loop {
            if let Ok(row) = self.given.pop() {
                let keyframe = Keyframe { cycle: row.cycle, numbers: row.numbers.clone() };
                let full = row.full;
                self.row = Some(row);
                return if full {
                    Err(fault("its state has more numbers than there is room for"))
                } else {
                    Ok(keyframe)
                };
            }
            if self.asked.is_abandoned() || begin.elapsed() > PATIENCE {
                return Err(fault("the real-time loop does not answer; start the bench anew"));
            }
            thread::sleep(LOOK);
        }
    }
}
