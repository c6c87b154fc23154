//! The rows that a capture has stored around one trigger.

use super::plan::Plan;

/// Cycles without a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The first cycle.
    pub cycle: u64,
    /// Number of cycles.
    pub lost: u64,
}

/// The cycles around one trigger, from `from` to `to`: each cycle is a row, decimated, or in a gap.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Cycle of each stored row: that of the trigger, and those at multiples of the decimation from it.
    pub cycles: Vec<u64>,
    /// Values of each signal of the plan, one per row.
    pub columns: Vec<Vec<f64>>,
    /// Index of the trigger's row.
    pub trigger: usize,
    /// Cycle of the event; `None` for an automatic trigger. It is before the trigger if there is a delay.
    pub event: Option<u64>,
    /// Rows lost immediately before the event: it may have happened this number of ticks earlier.
    pub event_lost: u64,
    /// First cycle, the requested ticks before the trigger; later for an early trigger.
    pub from: u64,
    /// Last cycle, the requested ticks after the trigger. It is in the future while the segment grows.
    pub to: u64,
    /// Requested ticks before the trigger that are missing because the capture had just begun.
    pub missing: u64,
    /// Lost rows, also between decimated rows.
    pub gaps: Vec<Gap>,
    /// The next expected cycle.
    next: u64,
    decimation: u64,
}

impl Segment {
    /// A segment without rows. `first` is the first available cycle, `event` cycle and lost rows of the event.
    pub(super) fn new(plan: &Plan, trigger: u64, first: u64, event: Option<(u64, u64)>) -> Self {
        let from = trigger.saturating_sub(plan.before).max(first);
        let to = trigger.saturating_add(plan.after);
        let rows = ((trigger - from) / plan.decimation + 1 + plan.after / plan.decimation) as usize;
        Segment {
            cycles: Vec::with_capacity(rows),
            columns: plan.signals.iter().map(|_| Vec::with_capacity(rows)).collect(),
            trigger: 0,
            event: event.map(|(cycle, _)| cycle),
            event_lost: event.map_or(0, |(_, lost)| lost),
            from,
            to,
            missing: plan.before - (trigger - from),
            gaps: Vec::new(),
            next: from,
            decimation: plan.decimation,
        }
    }

    /// Adds a row within `from` and `to`, `ahead` ticks before the trigger or after it. Returns whether it is stored.
    pub(super) fn push(&mut self, cycle: u64, ahead: u64, values: impl Iterator<Item = f64>) -> bool {
        self.expect(cycle);
        self.next = cycle + 1;
        let keeps = ahead.is_multiple_of(self.decimation);
        if keeps {
            self.cycles.push(cycle);
            for (column, value) in self.columns.iter_mut().zip(values) {
                column.push(value);
            }
        }
        keeps
    }

    /// Enters the missing cycles before this one as a gap.
    pub(super) fn expect(&mut self, cycle: u64) {
        if cycle > self.next {
            self.gaps.push(Gap { cycle: self.next, lost: cycle - self.next });
            self.next = cycle;
        }
    }

    /// Cycles without a row.
    pub fn lost(&self) -> u64 {
        self.gaps.iter().map(|gap| gap.lost).sum()
    }

    /// Time of each row [s], 0 at the trigger, with the time of a tick [s].
    pub fn times(&self, tick_time: f64) -> impl Iterator<Item = f64> {
        let zero = self.cycles.get(self.trigger).copied().unwrap_or_default();
        self.cycles.iter().map(move |&cycle| (cycle as i64 - zero as i64) as f64 * tick_time)
    }

    /// Number of stored rows.
    pub fn rows(&self) -> usize {
        self.cycles.len()
    }
}
