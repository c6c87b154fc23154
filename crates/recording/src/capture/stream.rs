//! One stream of rows, any number of sinks, and the account of each.

use crate::RecordingError;
use std::any::Any;
use std::fmt;
use std::marker::PhantomData;

use stickslip_base::Error;

/// Largest cycle, so that no sum of two cycles overflows; at 100 kHz it is reached after three million years.
const END_OF_CYCLES: u64 = 1 << 63;

/// A row for the sinks: its stream has checked order and width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row<'a> {
    cycle: u64,
    lost: u64,
    values: &'a [f64],
}

impl Row<'_> {
    /// Number of its tick.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// Cycles without a row between the previous row and this one.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// All signals, by index.
    pub fn values(&self) -> &[f64] {
        self.values
    }
}

/// Account of the cycles since a sink was added: `produced = stored + discarded + lost`, always.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Account {
    /// Cycles up to and including the newest row.
    pub produced: u64,
    /// Rows that are stored or were taken.
    pub stored: u64,
    /// Rows that are not stored: too old, decimated, after the end, or never taken.
    pub discarded: u64,
    /// Cycles without a row.
    pub lost: u64,
}

impl Account {
    /// Counts a row and the cycles lost before it; the sink counts it as stored or discarded.
    pub fn arrive(&mut self, row: &Row<'_>) {
        self.produced += row.lost + 1;
        self.lost += row.lost;
    }

    /// Whether all cycles are accounted for.
    pub fn balances(&self) -> bool {
        self.produced == self.stored + self.discarded + self.lost
    }
}

/// A receiver of rows. It gets each row of its stream after it was added, in order.
pub trait Sink: Any + Send {
    /// Smallest number of signals in a row.
    fn width(&self) -> usize;

    /// Receives a row.
    fn push(&mut self, row: Row<'_>);

    /// The account of the cycles.
    fn account(&self) -> Account;
}

/// Handle of a sink in its stream.
pub struct Tap<S> {
    number: u64,
    sink: PhantomData<fn() -> S>,
}

impl<S> fmt::Debug for Tap<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Tap({})", self.number)
    }
}

/// Passes each row to all sinks.
pub struct Stream {
    width: usize,
    last: Option<u64>,
    lost: u64,
    /// The sinks with the numbers of their taps.
    sinks: Vec<(u64, Box<dyn Sink>)>,
    added: u64,
}

impl Stream {
    /// A stream of rows of `width` signals, without sinks.
    pub fn new(width: usize) -> Self {
        Stream { width, last: None, lost: 0, sinks: Vec::new(), added: 0 }
    }

    /// Cycle of the newest row.
    pub fn last(&self) -> Option<u64> {
        self.last
    }

    /// Cycles without a row since the first one.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Adds the signals of a cycle. Skipped cycles since the last row are lost.
    ///
    /// # Errors
    /// A cycle that is not after the last one, or a row of another width; no sink gets it then.
    pub fn push(&mut self, cycle: u64, values: &[f64]) -> Result<(), Error> {
        if values.len() != self.width {
            let remedy = "All rows of a stream have the same signals; start a new stream for others.";
            return Err(Error::Dimension { what: "row", found: values.len(), expected: self.width, remedy });
        }
        if cycle >= END_OF_CYCLES || self.last.is_some_and(|last| cycle <= last) {
            return Err(RecordingError::RowOrder { cycle, last: self.last }.into());
        }
        let lost = self.last.map_or(0, |last| cycle - last - 1);
        self.last = Some(cycle);
        self.lost += lost;
        for (_, sink) in &mut self.sinks {
            sink.push(Row { cycle, lost, values });
        }
        Ok(())
    }

    /// Adds a sink: its account begins with the cycle after the newest row, lost or not.
    ///
    /// # Errors
    /// A sink that requires signals that the rows do not have.
    pub fn add<S: Sink>(&mut self, sink: S) -> Result<Tap<S>, Error> {
        if sink.width() > self.width {
            let remedy = "Choose signals that the rows have; the first one has the index 0.";
            return Err(Error::Dimension { what: "row", found: self.width, expected: sink.width(), remedy });
        }
        let number = self.added;
        self.added += 1;
        self.sinks.push((number, Box::new(sink)));
        Ok(Tap { number, sink: PhantomData })
    }

    /// The sink of a tap; `None` for a tap of another stream.
    pub fn get<S: Sink>(&self, tap: &Tap<S>) -> Option<&S> {
        let (_, sink) = self.sinks.iter().find(|(number, _)| *number == tap.number)?;
        let sink: &dyn Any = &**sink;
        sink.downcast_ref()
    }

    /// The sink of a tap, mutable; `None` for a tap of another stream.
    pub fn get_mut<S: Sink>(&mut self, tap: &Tap<S>) -> Option<&mut S> {
        let (_, sink) = self.sinks.iter_mut().find(|(number, _)| *number == tap.number)?;
        let sink: &mut dyn Any = &mut **sink;
        sink.downcast_mut()
    }

    /// Removes a sink and returns it with its contents; `None` for a tap of another stream, which stays unchanged.
    pub fn remove<S: Sink>(&mut self, tap: Tap<S>) -> Option<S> {
        self.get(&tap)?;
        let index = self.sinks.iter().position(|(number, _)| *number == tap.number)?;
        let sink: Box<dyn Any> = self.sinks.remove(index).1;
        sink.downcast().ok().map(|sink| *sink)
    }
}
