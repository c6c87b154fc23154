//! A trigger at work: sees row after row, and says which one is an event.

use super::stream::Row;
use super::trigger::{Condition, Side, Slope, Test, Trigger};
use crate::RecordingError;
use stickslip_base::Error;
use stickslip_base::parameters::schema::nearest;

/// Memory of a condition on a signal by its index. NaN leaves it as it is.
#[derive(Clone, Debug)]
pub(super) struct Detector {
    /// `None`: any row is an event.
    watched: Option<(usize, Test)>,
    /// Whether the signal has been where an event must come from: below and above for an edge, beyond the end for a
    /// window, both in the first.
    ready: [bool; 2],
    /// The signal's last value; NaN before the first.
    last: f64,
}

impl Detector {
    /// For rows whose signals have these names.
    ///
    /// # Errors
    /// A signal that there is not, or a trigger whose text would be refused.
    pub(super) fn new(trigger: &Trigger, names: &[impl AsRef<str>]) -> Result<Self, Error> {
        // A trigger can be put together of any numbers; its own text knows which make sense, and in which column not.
        let text = trigger.to_string();
        let watched = match text.parse::<Trigger>()?.condition {
            Condition::Immediate => None,
            Condition::Signal { name, test } => {
                let Some(index) = names.iter().position(|known| known.as_ref() == name) else {
                    let remedy = match nearest(&name, names.iter().map(AsRef::as_ref)) {
                        Some(nearest) => format!("Did you mean `{nearest}`?"),
                        None => format!("There are {} signals, none is like it.", names.len()),
                    };
                    let fault = format!("there is no signal `{name}`");
                    return Err(RecordingError::Trigger { text, column: 1, fault, remedy }.into());
                };
                Some((index, test))
            }
        };
        Ok(Detector { watched, ready: [false; 2], last: f64::NAN })
    }

    /// Signals that a row must have at least.
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
            Test::Is(wanted) => value == f64::from(wanted),
            Test::Becomes(wanted) => self.changes(value) && value == f64::from(wanted),
            Test::Changes => self.changes(value),
        }
    }

    /// Whether it was ready; it is not any more.
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
