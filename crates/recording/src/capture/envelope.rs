//! A live stream, thinned out so that no spike is lost.

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
    /// Rows in it.
    pub rows: u64,
    /// Cycles up to `to` that are in no point, since the point before: lost, or in points that nobody took in time. A
    /// line ends where it is not 0.
    pub missing: u64,
    /// Of each signal.
    pub extremes: Vec<Extremes>,
    /// Of each signal, the value in the last row.
    pub last: Vec<f64>,
}

/// Minimum, maximum and last of each signal over windows of so many ticks, as points in a queue.
///
/// A window begins at each multiple of its ticks, so that all streams of the same width have the same points. One in
/// which the stream begins or the width changes is shorter.
#[derive(Clone, Debug)]
pub struct Envelope {
    signals: Vec<usize>,
    ticks: u64,
    /// The window that fills; without a row none does.
    window: Point,
    points: VecDeque<Point>,
    /// Points that may wait.
    room: usize,
    account: Account,
}

impl Envelope {
    /// Of these signals, by index: a point every `ticks`, of which `room` may wait to be taken.
    ///
    /// # Errors
    /// No signal, tick or room at all, or more than `limit` bytes.
    pub fn new(signals: Vec<usize>, ticks: u64, room: usize, limit: usize) -> Result<Self, Error> {
        let remedy = "Choose one at least.";
        for (what, found) in [("signals of an envelope", signals.len()), ("waiting points of an envelope", room)] {
            if found == 0 {
                return Err(Error::TooFew { what, found, needed: 1, remedy });
            }
        }
        let point = size_of::<Point>() + signals.len() * (size_of::<Extremes>() + size_of::<f64>());
        // The queue takes a power of two, and one grows while the others wait.
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

    /// From the next row on, a point every `ticks`; what has come until now becomes a point of its own.
    ///
    /// # Errors
    /// 0 ticks.
    pub fn set_ticks(&mut self, ticks: u64) -> Result<(), Error> {
        if ticks == 0 {
            return Err(Error::TooFew { what: "ticks of a point", found: 0, needed: 1, remedy: "1 shows every row." });
        }
        self.finish();
        self.ticks = ticks;
        Ok(())
    }

    /// Takes the oldest point that waits.
    pub fn take(&mut self) -> Option<Point> {
        self.points.pop_front()
    }

    /// Queues the window that fills.
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
