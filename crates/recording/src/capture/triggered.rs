//! Captures: the rows before and after a trigger.

use std::collections::VecDeque;

use super::detector::Detector;
use super::history::History;
use super::plan::{Keep, Plan};
use super::segment::Segment;
use super::stream::{Account, Row, Sink};
use super::trigger::Trigger;
use stickslip_base::Error;

/// Progress of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The history fills. A trigger is possible, with fewer rows before it than requested.
    Filling,
    /// The history is full; waits for the trigger.
    Armed,
    /// The event has occurred; waits for its delay.
    Delayed,
    /// The trigger has occurred; its segment grows.
    Triggered,
    /// All requested segments are complete.
    Complete,
}

/// Stores the rows around a trigger: the requested ticks before it, its own, and those after it.
///
/// Segments never share a row: the history restarts after each. The history is stored at full rate, so that a decimated
/// segment is even and has its trigger exactly on a row.
#[derive(Clone, Debug)]
pub struct Capture {
    plan: Plan,
    detector: Detector,
    delay: u64,
    hold_off: u64,
    auto: Option<u64>,
    history: History,
    /// First cycle that the next segment may have; `None` before the first row.
    first: Option<u64>,
    /// Newest cycle.
    last: u64,
    /// An event that waits for its delay: cycle, rows lost immediately before it.
    event: Option<(u64, u64)>,
    /// First cycle after the hold-off.
    quiet_until: u64,
    growing: Option<Segment>,
    segments: VecDeque<Segment>,
    /// Number of started segments.
    begun: usize,
    /// Without the rows in the history.
    account: Account,
}

impl Capture {
    /// A capture that is armed from the first row. `names` are those of a row's values.
    ///
    /// # Errors
    /// A plan that stores nothing or requires more than `limit` bytes, a trigger that is not valid for these signals.
    pub fn new(plan: Plan, trigger: &Trigger, names: &[impl AsRef<str>], limit: usize) -> Result<Self, Error> {
        plan.check(limit)?;
        Ok(Capture {
            detector: Detector::new(trigger, names)?,
            delay: trigger.delay,
            hold_off: trigger.hold_off,
            auto: trigger.auto,
            history: History::new(plan.before as usize, plan.signals.len()),
            first: None,
            last: 0,
            event: None,
            quiet_until: 0,
            growing: None,
            segments: VecDeque::new(),
            begun: 0,
            account: Account::default(),
            plan,
        })
    }

    /// Its plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Its progress.
    pub fn stage(&self) -> Stage {
        if self.growing.is_some() {
            Stage::Triggered
        } else if self.is_complete() {
            Stage::Complete
        } else if self.event.is_some() {
            Stage::Delayed
        } else if self.first.is_some_and(|first| self.last + 1 >= first.saturating_add(self.plan.before)) {
            Stage::Armed
        } else {
            Stage::Filling
        }
    }

    /// The growing segment.
    pub fn growing(&self) -> Option<&Segment> {
        self.growing.as_ref()
    }

    /// Finished segments, oldest first.
    pub fn segments(&self) -> impl ExactSizeIterator<Item = &Segment> {
        self.segments.iter()
    }

    /// Takes the oldest finished segment.
    pub fn take(&mut self) -> Option<Segment> {
        self.segments.pop_front()
    }

    fn is_complete(&self) -> bool {
        matches!(self.plan.keep, Keep::First(segments) if self.begun >= segments) && self.growing.is_none()
    }

    /// A row before the trigger.
    fn await_trigger(&mut self, row: &Row<'_>, event: bool) {
        let cycle = row.cycle();
        let first = *self.first.get_or_insert(cycle - row.lost());
        if event && self.event.is_none() && cycle >= self.quiet_until {
            self.event = Some((cycle, row.lost()));
            self.quiet_until = cycle.saturating_add(self.hold_off).saturating_add(1);
        }
        let delay_is_over = self.event.is_some_and(|(event, _)| cycle >= event.saturating_add(self.delay));
        let automatic = self.event.is_none() && self.auto.is_some_and(|ticks| cycle - first >= ticks);
        if delay_is_over || automatic {
            self.begin(cycle, first);
            self.grow(row);
        } else if self.history.push(cycle, self.plan.signals.iter().map(|&signal| row.values()[signal])) {
            self.account.discarded += 1;
        }
    }

    /// At the trigger, the history becomes the start of a segment.
    fn begin(&mut self, trigger: u64, first: u64) {
        let mut segment = Segment::new(&self.plan, trigger, first, self.event.take());
        for (cycle, values) in self.history.iter() {
            let keeps = cycle >= segment.from && segment.push(cycle, trigger - cycle, values.iter().copied());
            *(if keeps { &mut self.account.stored } else { &mut self.account.discarded }) += 1;
        }
        self.history.clear();
        segment.trigger = segment.rows();
        self.growing = Some(segment);
        self.begun += 1;
    }

    /// A row of the growing segment, from its trigger.
    fn grow(&mut self, row: &Row<'_>) {
        let Some(segment) = &mut self.growing else { return };
        let cycle = row.cycle();
        let trigger = segment.to - self.plan.after;
        let keeps = segment.push(cycle, cycle - trigger, self.plan.signals.iter().map(|&signal| row.values()[signal]));
        *(if keeps { &mut self.account.stored } else { &mut self.account.discarded }) += 1;
        if cycle == segment.to {
            self.finish();
        }
    }

    /// Completes the growing segment.
    fn finish(&mut self) {
        let Some(mut segment) = self.growing.take() else { return };
        segment.expect(segment.to + 1);
        self.first = Some(segment.to + 1);
        self.segments.push_back(segment);
        if let Keep::Latest(segments) = self.plan.keep
            && self.segments.len() > segments
            && let Some(oldest) = self.segments.pop_front()
        {
            self.account.stored -= oldest.rows() as u64;
            self.account.discarded += oldest.rows() as u64;
        }
    }
}

impl Sink for Capture {
    fn width(&self) -> usize {
        self.plan.signals.iter().map(|signal| signal + 1).max().unwrap_or(0).max(self.detector.width())
    }

    fn push(&mut self, row: Row<'_>) {
        self.account.arrive(&row);
        self.last = row.cycle();
        // The detector gets each row: an edge while a segment grows is not an event of the next one.
        let event = self.detector.sees(&row);
        if self.growing.as_ref().is_some_and(|segment| row.cycle() > segment.to) {
            self.finish();
        }
        if self.growing.is_some() {
            self.grow(&row);
        } else if self.is_complete() {
            self.account.discarded += 1;
        } else {
            self.await_trigger(&row, event);
        }
    }

    fn account(&self) -> Account {
        Account { stored: self.account.stored + self.history.rows() as u64, ..self.account }
    }
}
