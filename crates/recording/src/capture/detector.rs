//! Detection of the events of a trigger, row by row.

use super::stream::Row;
use super::trigger::{Condition, Side, Slope, Test, Trigger};
use crate::RecordingError;
use stickslip_base::Error;
use stickslip_base::parameters::schema::nearest;

/// Memory of a condition on a signal by its index. NaN does not change it.
#[derive(Clone, Debug)]
pub(super) struct Detector {
    /// `None`: any row is an event.
    watched: Option<(usize, Test)>,
    /// Whether the signal has been on the side from which an event starts: below and above for an edge, outside the end
    /// for a window, both in the first.
    ready: [bool; 2],
    /// The signal's last value; NaN before the first.
    last: f64,
}

impl Detector {
    /// A detector for rows whose signals have these names.
    ///
    /// # Errors
    /// An unknown signal, or a trigger whose text is not valid.
    pub(super) fn new(trigger: &Trigger, names: &[impl AsRef<str>]) -> Result<Self, Error> {
        // A trigger may be built from any numbers; its text is parsed to check them and to get the column of a fault.
        let text = trigger.to_string();
        let watched = match text.parse::<Trigger>()?.condition {
            Condition::Immediate => None,
            Condition::Signal { name, test } => {
                let Some(index) = names.iter().position(|other| other.as_ref() == name) else {
                    let remedy = match nearest(&name, names.iter().map(AsRef::as_ref)) {
                        Some(nearest) => format!("Did you mean `{nearest}`?"),
                        None => format!("None of the {} signals has a similar name.", names.len()),
                    };
                    let fault = format!("unknown signal `{name}`");
                    return Err(RecordingError::Trigger { text, column: 1, fault, remedy }.into());
                };
                Some((index, test))
            }
        };
        Ok(Detector { watched, ready: [false; 2], last: f64::NAN })
    }

    /// Smallest number of signals in a row.
    pub(super) fn width(&self) -> usize {
        self.watched.map_or(0, |(signal, _)| signal + 1)
    }

    /// Whether this row is an event.
    pub(super) fn sees(&mut self, row: &Row<'_>) -> bool {
        let Some((signal, test)) = self.watched else { return true };
        let value = row.values()[signal];
        match test {
            Test::Above(level) => value > level,
            Test::Below(level) => value < level,
            Test::Edge { slope, level, hysteresis } => {
                let rises = value >= level && self.leave(0);
                let falls = value <= level && self.leave(1);
                self.ready[0] |= value < level - hysteresis;
                self.ready[1] |= value > level + hysteresis;
                rises && slope != Slope::Falling || falls && slope != Slope::Rising
            }
            Test::Window { side: Side::Enters, low, high, hysteresis } => {
                let enters = low <= value && value <= high && self.leave(0);
                self.ready[0] |= value < low - hysteresis || value > high + hysteresis;
                enters
            }
            Test::Window { side: Side::Leaves, low, high, hysteresis } => {
                let leaves = (value < low || value > high) && self.leave(0);
                self.ready[0] |= low + hysteresis <= value && value <= high - hysteresis;
                leaves
            }
            Test::Is(expected) => value == f64::from(expected),
            Test::Becomes(expected) => self.changes(value) && value == f64::from(expected),
            Test::Changes => self.changes(value),
        }
    }

    /// Whether it was ready; resets it.
    fn leave(&mut self, end: usize) -> bool {
        std::mem::take(&mut self.ready[end])
    }

    /// Whether the value differs from the one before.
    fn changes(&mut self, value: f64) -> bool {
        if value.is_nan() {
            return false;
        }
        let last = std::mem::replace(&mut self.last, value);
        !last.is_nan() && last != value
    }
}
