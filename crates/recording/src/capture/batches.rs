//! A live stream of every row, in batches of a bounded queue: the source of the scope in the browser. Slow readers lose
//! batches; the loss is counted.

use std::collections::VecDeque;

use super::admit;
use super::stream::{Account, Row, Sink};
use stickslip_base::Error;

/// Largest number of rows of a batch.
const LONGEST: usize = 4096;

/// Rows of consecutive cycles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// Cycle of its first row.
    pub from: u64,
    /// Cycles between the previous batch and `from` that are in no batch: lost, or in batches that were not taken in
    /// time.
    pub missing: u64,
    rows: usize,
    /// Values, row by row.
    values: Vec<f64>,
}

impl Batch {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of signals.
    pub fn signals(&self) -> usize {
        self.values.len().checked_div(self.rows).unwrap_or(0)
    }

    /// The values of one signal, one per row.
    pub fn column(&self, signal: usize) -> impl Iterator<Item = f64> {
        self.values.iter().skip(signal).step_by(self.signals().max(1)).copied()
    }
}

/// Every row of some signals. Slow readers get the newest rows and the number of missing ones.
#[derive(Clone, Debug)]
pub struct Batches {
    signals: Vec<usize>,
    /// Oldest first; the last one grows.
    batches: VecDeque<Batch>,
    /// Number of waiting rows, and its limit `room`.
    rows: usize,
    room: usize,
    /// Largest number of rows of a batch.
    longest: usize,
    account: Account,
}

impl Batches {
    /// Batches of these signals, by index; at most `room` rows wait for the reader.
    ///
    /// # Errors
    /// No signal, `room` 0, or more than `limit` bytes.
    pub fn new(signals: Vec<usize>, room: usize, limit: usize) -> Result<Self, Error> {
        let remedy = "Choose at least one.";
        for (what, found) in [("signals of a stream", signals.len()), ("waiting rows of a stream", room)] {
            if found == 0 {
                return Err(Error::TooFew { what, found, needed: 1, remedy });
            }
        }
        // Short batches: the batch that is being filled is in addition to `room`.
        let longest = LONGEST.min(room.div_ceil(8));
        // A buffer that grows by doubling has space for twice its largest content.
        let bytes = 2 * (room + longest) as u128 * (signals.len() * size_of::<f64>()) as u128;
        admit("the stream", bytes, limit, "Choose fewer signals or a shorter queue, or raise the limit.")?;
        let (batches, account) = (VecDeque::new(), Account::default());
        Ok(Batches { signals, batches, rows: 0, room, longest, account })
    }

    /// Takes the oldest waiting batch.
    pub fn take(&mut self) -> Option<Batch> {
        let batch = self.batches.pop_front()?;
        self.rows -= batch.rows;
        Some(batch)
    }

    /// Drops the oldest rows, so that there is space for the next.
    fn make_room(&mut self) {
        while self.rows >= self.room
            && let Some(dropped) = self.take()
        {
            self.account.stored -= dropped.rows as u64;
            self.account.discarded += dropped.rows as u64;
            let missing = dropped.missing + dropped.rows as u64;
            match self.batches.front_mut() {
                Some(next) => next.missing += missing,
                None => self.begin(dropped.from + dropped.rows as u64, missing),
            }
        }
    }

    fn begin(&mut self, from: u64, missing: u64) {
        let values = Vec::with_capacity(self.longest.min(64) * self.signals.len());
        self.batches.push_back(Batch { from, missing, rows: 0, values });
    }
}

impl Sink for Batches {
    fn width(&self) -> usize {
        self.signals.iter().map(|signal| signal + 1).max().unwrap_or(0)
    }

    fn push(&mut self, row: Row<'_>) {
        self.account.arrive(&row);
        self.make_room();
        match self.batches.back_mut() {
            // It has no rows, only missing cycles.
            Some(last) if last.rows == 0 => {
                last.from = row.cycle();
                last.missing += row.lost();
            }
            Some(last) if row.lost() == 0 && last.rows < self.longest => {}
            _ => self.begin(row.cycle(), row.lost()),
        }
        if let Some(last) = self.batches.back_mut() {
            last.values.extend(self.signals.iter().map(|&signal| row.values()[signal]));
            last.rows += 1;
            self.rows += 1;
            self.account.stored += 1;
        }
    }

    fn account(&self) -> Account {
        self.account
    }
}
