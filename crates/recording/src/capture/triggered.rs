//! A capture: what happened before and after its trigger.

use std::collections::VecDeque;

use super::detector::Detector;
use super::history::History;
use super::plan::{Keep, Plan};
use super::segment::Segment;
use super::stream::{Account, Row, Sink};
use super::trigger::Trigger;
use stickslip_base::Error;

/// How far a capture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The history fills. The trigger may come, and then has less before it than was asked for.
    Filling,
    /// The history is full; the trigger is awaited.
    Armed,
    /// The event has come, its delay passes.
    Delayed,
    /// The trigger has come, its segment grows.
    Triggered,
    /// All segments that were asked for are there.
    Complete,
}

/// Keeps what happens around a trigger: the asked for ticks before it, its own, and those after it.
///
/// Segments never share a row: the history begins anew after each. The history is kept at full rate, so that a
/// decimated segment is even and has its trigger exactly on a row.
#[derive(Clone, Debug)]
pub struct Capture {
    plan: Plan,
    detector: Detector,
    delay: u64,
    hold_off: u64,
    auto: Option<u64>,
    history: History,
    /// First cycle that the next segment may have; `None` before the first row.
    seen: Option<u64>,
    /// Newest cycle.
    last: u64,
    /// An event that awaits its delay: cycle, rows lost right before it.
    event: Option<(u64, u64)>,
    /// From here on there may be an event again.
    quiet_until: u64,
    growing: Option<Segment>,
    segments: VecDeque<Segment>,
    /// Segments that were begun.
    begun: usize,
    /// But for the rows in the history.
    account: Account,
}

impl Capture {
    /// Armed from the first row on. The trigger knows signals by the `names` of a row's values.
    ///
    /// # Errors
    /// A plan that keeps nothing or takes more than `limit` bytes, a trigger that makes no sense on these signals.
    pub fn new(plan: Plan, trigger: &Trigger, names: &[impl AsRef<str>], limit: usize) -> Result<Self, Error> {
        plan.check(limit)?;
        Ok(Capture {
            detector: Detector::new(trigger, names)?,
            delay: trigger.delay,
            hold_off: trigger.hold_off,
            auto: trigger.auto,
            history: History::new(plan.before as usize, plan.signals.len()),
            seen: None,
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

    /// What it keeps.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// How far it is.
    pub fn stage(&self) -> Stage {
        if self.growing.is_some() {
            Stage::Triggered
        } else if self.is_complete() {
            Stage::Complete
        } else if self.event.is_some() {
            Stage::Delayed
        } else if self.seen.is_some_and(|seen| self.last + 1 >= seen.saturating_add(self.plan.before)) {
            Stage::Armed
        } else {
            Stage::Filling
        }
    }

    /// The segment that grows.
    pub fn growing(&self) -> Option<&Segment> {
        self.growing.as_ref()
    }

    /// Finished segments, oldest first.
    pub fn segments(&self) -> impl ExactSizeIterator<Item = &Segment> {
        self.segments.iter()
    }

    /// Hands out the oldest finished segment.
    pub fn take(&mut self) -> Option<Segment> {
        self.segments.pop_front()
    }

    fn is_complete(&self) -> bool {
        matches!(self.plan.keep, Keep::First(segments) if self.begun >= segments) && self.growing.is_none()
    }

    /// A row while the trigger is awaited.
    fn await_trigger(&mut self, row: &Row<'_>, event: bool) {
        let cycle = row.cycle();
        let seen = *self.seen.get_or_insert(cycle - row.lost());
        if event && self.event.is_none() && cycle >= self.quiet_until {
            self.event = Some((cycle, row.lost()));
            self.quiet_until = cycle.saturating_add(self.hold_off).saturating_add(1);
        }
        let due = self.event.is_some_and(|(event, _)| cycle >= event.saturating_add(self.delay));
        let by_itself = self.event.is_none() && self.auto.is_some_and(|ticks| cycle - seen >= ticks);
        if due || by_itself {
            self.begin(cycle, seen);
            self.grow(row);
        } else if self.history.push(cycle, self.plan.signals.iter().map(|&signal| row.values()[signal])) {
            self.account.discarded += 1;
        }
    }

    /// The trigger has come: the history becomes the begin of a segment.
    fn begin(&mut self, trigger: u64, seen: u64) {
        let mut segment = Segment::new(&self.plan, trigger, seen, self.event.take());
        for (cycle, values) in self.history.iter() {
            let keeps = cycle >= segment.from && segment.push(cycle, trigger - cycle, values.iter().copied());
            *(if keeps { &mut self.account.stored } else { &mut self.account.discarded }) += 1;
        }
        self.history.clear();
        segment.trigger = segment.rows();
        self.growing = Some(segment);
        self.begun += 1;
    }

    /// A row of the segment that grows, from its trigger on.
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

    /// The segment that grows has all that it will get.
    fn finish(&mut self) {
        let Some(mut segment) = self.growing.take() else { return };
        segment.expect(segment.to + 1);
        self.seen = Some(segment.to + 1);
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
        // It sees each row: an edge while a segment grows is over when the next one is awaited.
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
