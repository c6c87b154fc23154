//! A live stream of every row, in batches of a bounded queue: the source of the scope in the browser. Slow readers lose
//! batches; the loss is counted.

use std::collections::VecDeque;

use super::admit;
use super::stream::{Account, Row, Sink};
use stickslip_base::Error;

/// Rows of a batch at most.
const LONGEST: usize = 4096;

/// Rows of cycles that follow each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// Cycle of its first row.
    pub from: u64,
    /// Cycles before `from` that are in no batch, since the batch before: lost, or in batches that nobody took in time.
    pub missing: u64,
    rows: usize,
    /// Row after row.
    values: Vec<f64>,
}

impl Batch {
    /// Its rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Its signals.
    pub fn signals(&self) -> usize {
        self.values.len().checked_div(self.rows).unwrap_or(0)
    }

    /// Of one signal, its value in each row.
    pub fn column(&self, signal: usize) -> impl Iterator<Item = f64> {
        self.values.iter().skip(signal).step_by(self.signals().max(1)).copied()
    }
}

/// Every row of some signals. Whoever takes them too late finds the newest, and told how many there were before.
#[derive(Clone, Debug)]
pub struct Batches {
    signals: Vec<usize>,
    /// Oldest first; the last one grows.
    batches: VecDeque<Batch>,
    /// Rows in them, and how many there may be.
    rows: usize,
    room: usize,
    /// Rows of a batch.
    longest: usize,
    account: Account,
}

impl Batches {
    /// Of these signals, by index, `room` rows of which may wait to be taken.
    ///
    /// # Errors
    /// No signal or room at all, or more than `limit` bytes.
    pub fn new(signals: Vec<usize>, room: usize, limit: usize) -> Result<Self, Error> {
        let remedy = "Choose one at least.";
        for (what, found) in [("signals of a stream", signals.len()), ("waiting rows of a stream", room)] {
            if found == 0 {
                return Err(Error::TooFew { what, found, needed: 1, remedy });
            }
        }
        // Few rows: one batch more than there is room for is the one that grows.
        let longest = LONGEST.min(room.div_ceil(8));
        // What grows by doubling has room for twice what it holds at most.
        let bytes = 2 * (room + longest) as u128 * (signals.len() * size_of::<f64>()) as u128;
        admit("the stream", bytes, limit, "Choose fewer signals or a shorter queue, or raise the limit.")?;
        let (batches, account) = (VecDeque::new(), Account::default());
        Ok(Batches { signals, batches, rows: 0, room, longest, account })
    }

    /// Takes the oldest batch that waits.
    pub fn take(&mut self) -> Option<Batch> {
        let batch = self.batches.pop_front()?;
        self.rows -= batch.rows;
        Some(batch)
    }

    /// Leaves the oldest rows, so that there is room for the next.
    fn make_room(&mut self) {
        while self.rows >= self.room
            && let Some(left) = self.take()
        {
            self.account.stored -= left.rows as u64;
            self.account.discarded += left.rows as u64;
            let missing = left.missing + left.rows as u64;
            match self.batches.front_mut() {
                Some(next) => next.missing += missing,
                None => self.begin(left.from + left.rows as u64, missing),
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
            // Nothing is in it but what is missing.
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
