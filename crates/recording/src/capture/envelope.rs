//! A live stream, reduced without losing spikes.

use std::collections::VecDeque;

use super::admit;
use super::extremes::Extremes;
use super::stream::{Account, Row, Sink};
use stickslip_base::Error;

/// A window of the stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Cycle of its first row.
    pub from: u64,
    /// Cycle of its last row.
    pub to: u64,
    /// Number of rows.
    pub rows: u64,
    /// Cycles up to `to` since the previous point that are in no point: lost, or in points that were not taken in time.
    /// A line is interrupted where it is not 0.
    pub missing: u64,
    /// Extremes of each signal.
    pub extremes: Vec<Extremes>,
    /// The value of each signal in the last row.
    pub last: Vec<f64>,
}

/// Minimum, maximum and last value of each signal over windows of a number of ticks, as points in a queue.
///
/// A window begins at each multiple of its ticks, so that all streams of the same width have the same points. A window
/// in which the stream begins or the width changes is shorter.
#[derive(Clone, Debug)]
pub struct Envelope {
    signals: Vec<usize>,
    ticks: u64,
    /// The current window; empty before its first row.
    window: Point,
    points: VecDeque<Point>,
    /// Largest number of waiting points.
    room: usize,
    account: Account,
}

impl Envelope {
    /// An envelope of these signals, by index: a point every `ticks`; at most `room` points wait for the reader.
    ///
    /// # Errors
    /// No signal, `ticks` or `room` 0, or more than `limit` bytes.
    pub fn new(signals: Vec<usize>, ticks: u64, room: usize, limit: usize) -> Result<Self, Error> {
        let remedy = "Choose at least one.";
        for (what, found) in [("signals of an envelope", signals.len()), ("waiting points of an envelope", room)] {
            if found == 0 {
                return Err(Error::TooFew { what, found, needed: 1, remedy });
            }
        }
        let point = size_of::<Point>() + signals.len() * (size_of::<Extremes>() + size_of::<f64>());
        // The capacity of the queue is a power of two, and one more point is the current one.
        let bytes = (room as u128 + 1).next_power_of_two() * point as u128;
        admit("the envelope", bytes, limit, "Choose fewer signals or a shorter queue, or raise the limit.")?;
        let window = Point::empty(signals.len());
        let mut envelope =
            Envelope { signals, ticks: 1, window, points: VecDeque::new(), room, account: Account::default() };
        envelope.set_ticks(ticks)?;
        Ok(envelope)
    }

    /// Ticks of a point.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// From the next row, a point every `ticks`; the rows up to now become a separate point.
    ///
    /// # Errors
    /// 0 ticks.
    pub fn set_ticks(&mut self, ticks: u64) -> Result<(), Error> {
        if ticks == 0 {
            return Err(Error::TooFew {
                what: "ticks of a point",
                found: 0,
                needed: 1,
                remedy: "Choose 1 for every \
                row.",
            });
        }
        self.finish();
        self.ticks = ticks;
        Ok(())
    }

    /// Takes the oldest waiting point.
    pub fn take(&mut self) -> Option<Point> {
        self.points.pop_front()
    }

    /// Queues the current window.
    fn finish(&mut self) {
        if self.window.rows == 0 {
            return;
        }
        if self.points.len() == self.room
            && let Some(dropped) = self.points.pop_front()
        {
            self.account.stored -= dropped.rows;
            self.account.discarded += dropped.rows;
            let next = self.points.front_mut().unwrap_or(&mut self.window);
            next.missing += dropped.rows + dropped.missing;
        }
        let empty = Point::empty(self.signals.len());
        self.points.push_back(std::mem::replace(&mut self.window, empty));
    }
}

impl Point {
    fn empty(signals: usize) -> Self {
        Point { from: 0, to: 0, rows: 0, missing: 0, extremes: vec![Extremes::NONE; signals], last: vec![0.0; signals] }
    }
}

impl Sink for Envelope {
    fn width(&self) -> usize {
        self.signals.iter().map(|signal| signal + 1).max().unwrap_or(0)
    }

    fn push(&mut self, row: Row<'_>) {
        self.account.arrive(&row);
        let cycle = row.cycle();
        // After lost rows it may be another window.
        if cycle / self.ticks != self.window.to / self.ticks {
            self.finish();
        }
        let window = &mut self.window;
        if window.rows == 0 {
            window.from = cycle;
        }
        window.to = cycle;
        window.rows += 1;
        window.missing += row.lost();
        for (i, &signal) in self.signals.iter().enumerate() {
            let value = row.values()[signal];
            window.extremes[i].include(value);
            window.last[i] = value;
        }
        self.account.stored += 1;
        if (cycle + 1).is_multiple_of(self.ticks) {
            self.finish();
        }
    }

    fn account(&self) -> Account {
        self.account
    }
}
