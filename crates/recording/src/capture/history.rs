//! The newest rows: a ring of fixed size.

/// The newest rows, up to a fixed number.
#[derive(Clone, Debug)]
pub(super) struct History {
    cycles: Vec<u64>,
    /// Values, row by row.
    values: Vec<f64>,
    width: usize,
    /// Slot of the oldest row.
    first: usize,
    rows: usize,
}

impl History {
    /// A history of this number of rows of `width` values.
    pub(super) fn new(rows: usize, width: usize) -> Self {
        History { cycles: vec![0; rows], values: vec![0.0; rows * width], width, first: 0, rows: 0 }
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Adds a row. Returns whether a row was dropped for it; without capacity it is this one.
    pub(super) fn push(&mut self, cycle: u64, values: impl Iterator<Item = f64>) -> bool {
        let room = self.cycles.len();
        if room == 0 {
            return true;
        }
        let slot = self.slot(self.rows);
        self.cycles[slot] = cycle;
        for (place, value) in self.values[slot * self.width..][..self.width].iter_mut().zip(values) {
            *place = value;
        }
        let full = self.rows == room;
        if full {
            self.first = self.slot(1);
        } else {
            self.rows += 1;
        }
        full
    }

    /// The rows, oldest first.
    pub(super) fn iter(&self) -> impl Iterator<Item = (u64, &[f64])> {
        (0..self.rows).map(|row| {
            let slot = self.slot(row);
            (self.cycles[slot], &self.values[slot * self.width..][..self.width])
        })
    }

    pub(super) fn clear(&mut self) {
        self.rows = 0;
    }

    /// Slot of the row that is `row` after the oldest; the slots are cyclic.
    fn slot(&self, row: usize) -> usize {
        let slot = self.first + row;
        if slot < self.cycles.len() { slot } else { slot - self.cycles.len() }
    }
}
