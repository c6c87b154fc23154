//! The cyclic executive: absolute deadlines, and the policy for missed ones.
//!
//! Cycle k begins at start + k·period, or not at all: a cycle whose time has passed is held, and the next one begins at
//! its own deadline. The number of a cycle is therefore a time, and lateness does not accumulate.

use std::any::Any;
use std::fmt;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::cause::{Cause, Overrun, Parts, TypicalCycle};
use crate::clock::{Clock, Nanoseconds};
use crate::cycle::{Cycle, Lap, MAX_BLOCKS, Next, short};
use crate::floating_point::FloatingPoint;
use crate::timing::{Outlet, Timing, Timings, ring};
use crate::watcher::ThreadUsage;

/// When cycles run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// From deadline to deadline.
    pub period: Duration,
    /// Cycles at the start that run but are not counted, to fill caches and branch predictors.
    pub warm_up: u64,
    /// Number of cycles after the warm-up; unlimited if `None`.
    pub cycles: Option<u64>,
    /// Policy for missed deadlines.
    pub overrun: OverrunPolicy,
    /// Capacity of the ring of timings (number of records).
    pub records: usize,
}

/// Policy for missed deadlines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverrunPolicy {
    /// Number of consecutive overruns that ends the run; unlimited if `None`.
    pub stop_after: Option<u32>,
    /// Maximum lateness at which a cycle still begins, as a fraction of the period; beyond it the cycle is held.
    pub begin_within: f64,
}

/// Error of a plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A period outside the permitted range.
    #[error("period = {0:?} is outside 1 µs … 1 s")]
    Period(Duration),
    /// More blocks than a record has room for.
    #[error("the cycle has {0} blocks; at most {MAX_BLOCKS} are possible. Merge some.")]
    TooManyBlocks(usize),
    /// A fraction of the period outside 0 … 1.
    #[error("begin_within = {0} is outside 0 … 1. It is a fraction of the period.")]
    BeginWithin(f64),
    /// A ring without capacity.
    #[error("the ring of timings has no room. Set records to the number of cycles in one second.")]
    NoRecords,
    /// The system cannot start a thread.
    #[error("the system cannot start a thread ({0})")]
    Thread(#[from] std::io::Error),
}

/// Reason of the end.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// Stopped on request.
    Stopped,
    /// All cycles of the plan are done, or the cycle returned [`Next::Stop`].
    Finished,
    /// Number of consecutive overruns.
    Overruns(u32),
    /// The cycle panicked, with this message.
    Panicked(String),
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Ending::Stopped => f.write_str("it was stopped"),
            Ending::Finished => f.write_str("all its cycles are done"),
            Ending::Overruns(overruns) => write!(f, "{overruns} consecutive deadlines were missed"),
            Ending::Panicked(message) => write!(f, "it panicked ({message})"),
        }
    }
}

/// Result of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Reason of the end.
    pub ending: Ending,
    /// Cycles without the warm-up.
    pub cycles: u64,
    /// Missed cycles: held because their time had passed.
    pub missed: u64,
    /// Missed deadlines.
    pub overruns: u64,
    /// The overrun with the largest delay.
    pub worst: Option<Overrun>,
    /// Records lost because the ring was full.
    pub lost: u64,
}

impl Summary {
    /// An empty summary.
    pub(crate) fn of(ending: Ending) -> Self {
        Summary { ending, cycles: 0, missed: 0, overruns: 0, worst: None, lost: 0 }
    }
}

impl Plan {
    /// A plan with this period, 1000 cycles of warm-up, an end after ten consecutive overruns, and a ring for one
    /// second.
    pub fn new(period: Duration) -> Self {
        let records = (1.0 / period.as_secs_f64().max(1e-6)).ceil().max(64.0) as usize;
        Plan { period, warm_up: 1000, cycles: None, overrun: OverrunPolicy::default(), records }
    }

    fn check(&self) -> Result<(), PlanError> {
        if !(Duration::from_micros(1)..=Duration::from_secs(1)).contains(&self.period) {
            return Err(PlanError::Period(self.period));
        }
        if !(0.0..=1.0).contains(&self.overrun.begin_within) {
            return Err(PlanError::BeginWithin(self.overrun.begin_within));
        }
        if self.records == 0 { Err(PlanError::NoRecords) } else { Ok(()) }
    }
}

impl Default for OverrunPolicy {
    fn default() -> Self {
        OverrunPolicy { stop_after: Some(10), begin_within: 0.5 }
    }
}

/// A cycle with its plan, ready to run.
pub struct Executive<C> {
    cycle: C,
    plan: Plan,
    io: [bool; MAX_BLOCKS],
    last_block: usize,
    outlet: Outlet,
    typical: TypicalCycle,
    stop: Arc<AtomicBool>,
    summary: Summary,
}

impl<C: Cycle> Executive<C> {
    /// Allocates all memory. The second value gives the records.
    ///
    /// # Errors
    /// [`PlanError`] for an invalid plan or invalid blocks.
    pub fn new(plan: Plan, cycle: C) -> Result<(Self, Timings), PlanError> {
        plan.check()?;
        let blocks = cycle.blocks();
        if blocks.len() > MAX_BLOCKS {
            return Err(PlanError::TooManyBlocks(blocks.len()));
        }
        let mut io = [false; MAX_BLOCKS];
        io.iter_mut().zip(blocks).for_each(|(io, block)| *io = block.io);
        let last_block = blocks.len().saturating_sub(1);
        let (outlet, timings) = ring(plan.records, blocks);
        let summary = Summary::of(Ending::Stopped);
        let (typical, stop) = (TypicalCycle::default(), Arc::default());
        Ok((Executive { cycle, plan, io, last_block, outlet, typical, stop, summary }, timings))
    }

    /// Stop flag: once true, the executive ends before the next cycle.
    pub fn stop(&self) -> Arc<AtomicBool> {
        self.stop.clone()
    }

    /// Runs to the end on the calling thread.
    pub fn run(self, clock: &dyn Clock) -> Summary {
        self.run_with(clock, None)
    }

    pub(crate) fn run_with(mut self, clock: &dyn Clock, mut usage: Option<ThreadUsage>) -> Summary {
        let _standard = FloatingPoint::standard();
        let ending = catch_unwind(AssertUnwindSafe(|| self.cycles(clock, usage.as_mut())));
        let outputs = catch_unwind(AssertUnwindSafe(|| self.cycle.end()));
        self.summary.ending = match (ending, outputs) {
            (Ok(ending), Ok(())) => ending,
            (Err(panic), Ok(())) => Ending::Panicked(message(&*panic)),
            (_, Err(panic)) => {
                Ending::Panicked(format!("{}, while the outputs were set to safe values", message(&*panic)))
            }
        };
        self.summary.lost = self.outlet.total_lost;
        self.summary
    }

    fn cycles(&mut self, clock: &dyn Clock, mut usage: Option<&mut ThreadUsage>) -> Ending {
        let period = self.plan.period.as_nanos() as Nanoseconds;
        let begin_within = (self.plan.overrun.begin_within * period as f64) as Nanoseconds;
        let last = self.plan.cycles.map(|cycles| self.plan.warm_up + cycles);
        let mut awake = clock.now();
        let start = awake + period;
        let (mut cycle, mut in_a_row) = (0, 0);
        while last.is_none_or(|last| cycle < last) {
            if let Some(usage) = usage.as_deref_mut() {
                usage.sleeps(clock.now() - awake);
            }
            let deadline = start + cycle * period;
            awake = clock.wait_until(deadline);
            if let Some(usage) = usage.as_deref_mut() {
                usage.wakes();
            }
            if self.stop.load(Ordering::Relaxed) {
                return Ending::Stopped;
            }
            let late = awake - deadline;
            let Turn { timing, held, next } = if late > begin_within {
                Turn::too_late(cycle, late, period)
            } else {
                self.turn(cycle, late, period, Lap::begin(clock, awake), usage.as_deref_mut())
            };
            cycle = held.end;
            let counted = timing.cycle >= self.plan.warm_up;
            if counted {
                self.outlet.push(timing);
                self.outlet.miss(held.end - held.start);
                self.count(&timing, &held);
                in_a_row = if timing.overrun.is_some() { in_a_row + 1 } else { 0 };
            }
            held.for_each(|missed| self.cycle.hold(missed));
            if next == Next::Stop {
                return Ending::Finished;
            }
            if self.plan.overrun.stop_after.is_some_and(|most| in_a_row >= most.max(1)) {
                return Ending::Overruns(in_a_row);
            }
        }
        Ending::Finished
    }

    /// Runs a cycle that began in time.
    fn turn(
        &mut self,
        cycle: u64,
        late: Nanoseconds,
        period: Nanoseconds,
        mut lap: Lap,
        usage: Option<&mut ThreadUsage>,
    ) -> Turn {
        let next = self.cycle.run(cycle, &mut lap);
        // Time after the last mark belongs to the last block.
        lap.done(self.last_block);
        let (ran, blocks) = lap.end();
        let parts = Parts { lateness: short(late), blocks };
        let mut timing = Timing { total: short(ran), blocks, ..Timing::start(cycle, late) };
        let needed = late + ran;
        if needed <= period {
            self.typical.learn(&parts);
            return Turn { timing, held: cycle + 1..cycle + 1, next };
        }
        let evidence = usage.map(|usage| usage.evidence(ran));
        let cause = self.typical.cause(&parts, &self.io, evidence);
        timing.overrun = Some(Overrun { cycle, late, by: needed - period, cause, evidence });
        Turn { timing, held: cycle + 1..cycle + needed.div_ceil(period), next }
    }

    fn count(&mut self, timing: &Timing, held: &Range<u64>) {
        // A cycle that woke too late was held itself.
        self.summary.cycles += u64::from(!held.contains(&timing.cycle));
        self.summary.missed += held.end - held.start;
        if let Some(overrun) = timing.overrun {
            self.summary.overruns += 1;
            if self.summary.worst.is_none_or(|worst| overrun.by > worst.by) {
                self.summary.worst = Some(overrun);
            }
        }
    }
}

/// Result of one cycle.
struct Turn {
    timing: Timing,
    /// Cycles whose time has passed; the next cycle follows them.
    held: Range<u64>,
    next: Next,
}

impl Turn {
    /// A cycle that woke too late to begin.
    fn too_late(cycle: u64, late: Nanoseconds, period: Nanoseconds) -> Self {
        let overrun = Overrun { cycle, late, by: late, cause: Cause::LateWakeUp, evidence: None };
        let timing = Timing { overrun: Some(overrun), ..Timing::start(cycle, late) };
        Turn { timing, held: cycle..cycle + late / period + 1, next: Next::Continue }
    }
}

/// Message of a panic.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no panic message").into()
}

#[cfg(test)]
mod tests;
