//! What a capture has kept around one trigger.

use super::plan::Plan;

/// Cycles without a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The first one.
    pub cycle: u64,
    /// How many.
    pub lost: u64,
}

/// What happened around one trigger, from `from` to `to`: there each cycle is a row, thinned out, or in a gap.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Cycle of each row that is kept: the trigger's, and those a multiple of the decimation away from it.
    pub cycles: Vec<u64>,
    /// Of each signal of the plan, its value in each row.
    pub columns: Vec<Vec<f64>>,
    /// Index of the trigger's row.
    pub trigger: usize,
    /// Cycle of the event; `None` where the trigger came by itself. Before the trigger if there is a delay.
    pub event: Option<u64>,
    /// Rows that were lost right before the event: it may have happened so many ticks earlier.
    pub event_lost: u64,
    /// First cycle, the asked for ticks before the trigger; later if the trigger came early.
    pub from: u64,
    /// Last cycle, the asked for ticks after the trigger. It is in the future while the segment grows.
    pub to: u64,
    /// Ticks before the trigger that were asked for, but not seen: the capture had just begun.
    pub missing: u64,
    /// Where rows are lost, also between rows that are thinned out.
    pub gaps: Vec<Gap>,
    /// The cycle that is expected next.
    next: u64,
    decimation: u64,
}

impl Segment {
    /// Without its rows. `seen` is the first cycle that could have been kept, `event` cycle and lost rows of the event.
    pub(super) fn new(plan: &Plan, trigger: u64, seen: u64, event: Option<(u64, u64)>) -> Self {
        let from = trigger.saturating_sub(plan.before).max(seen);
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

    /// Takes a row within `from` and `to`, `ahead` ticks before the trigger or after it. Whether it is kept.
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

    /// All cycles before this one have come or are lost.
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

    /// Rows that are kept.
    pub fn rows(&self) -> usize {
        self.cycles.len()
    }
}
