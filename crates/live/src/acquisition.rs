//! Acquisition: the newest cycle, recent events, and the captures and streams of all clients. The listener fills them.

use std::sync::{Mutex, MutexGuard};

use super::captures::Captures;
use super::fault::FaultStatus;
use super::lock;
use super::marks::Marks;
use super::protocol::{Answer, Mark, MarkKind};
use stickslip_bench::run::{Signals, state_name};
use stickslip_bench::tap::Sample;

/// The acquired signals. Each part has its own lock: fetching a large capture delays neither status nor axis.
pub(super) struct Acquisition {
    captures: Mutex<Captures>,
    newest: Mutex<Newest>,
    marks: Mutex<Marks>,
    /// First cycle of the last saved fault, and the number of its capture.
    fault_capture: Mutex<Option<(u64, i64)>>,
}

/// The newest cycle.
#[derive(Clone, Debug, Default)]
pub(super) struct Newest {
    pub(super) cycle: u64,
    pub(super) signals: Signals<f64>,
    pub(super) state: &'static str,
    /// The fault that stopped the bench, or is stopping it.
    pub(super) fault: Option<FaultStatus>,
    /// Why the loop has ended.
    pub(super) end: Option<String>,
    pub(super) held: u64,
    pub(super) lost: u64,
}

impl Acquisition {
    /// For a tick rate [Hz].
    pub(super) fn new(rate: f64) -> Self {
        let newest = Newest { state: "off", ..Newest::default() };
        Acquisition {
            captures: Mutex::new(Captures::new(rate)),
            newest: Mutex::new(newest),
            marks: Mutex::default(),
            fault_capture: Mutex::default(),
        }
    }

    /// The captures and streams; the listener waits while they are locked.
    pub(super) fn captures(&self) -> MutexGuard<'_, Captures> {
        lock(&self.captures)
    }

    pub(super) fn newest(&self) -> Newest {
        let mut newest = lock(&self.newest).clone();
        if let (Some(fault), Some((cycle, number))) = (&mut newest.fault, *lock(&self.fault_capture)) {
            fault.capture = (fault.cycle == cycle).then_some(number);
        }
        newest
    }

    /// Notes the capture of the fault in a cycle.
    pub(super) fn fault_saved(&self, cycle: u64, number: i64) {
        *lock(&self.fault_capture) = Some((cycle, number));
    }

    /// Stores the newest cycle and its fault, with the cycles missed and lost since the previous one.
    pub(super) fn update(
        &self,
        sample: &Sample,
        signals: Signals<f64>,
        fault: Option<FaultStatus>,
        [held, lost]: [u64; 2],
    ) {
        let (cycle, safety) = (sample.frame.cycle, &sample.frame.safety);
        let mut newest = lock(&self.newest);
        let (held, lost, end) = (newest.held + held, newest.lost + lost, newest.end.take());
        *newest = Newest { cycle, signals, state: state_name(safety), fault, end, held, lost };
    }

    /// Notes why the loop has ended.
    pub(super) fn fail(&self, reason: String) {
        lock(&self.newest).end = Some(reason);
    }

    /// Notes that no more cycles will come.
    pub(super) fn end(&self) {
        lock(&self.newest).state = "ended";
    }

    /// Position of the set-point, or of the axis without control [rad].
    pub(super) fn held_angle(&self) -> f64 {
        let newest = lock(&self.newest);
        if newest.signals.control > 0.5 { newest.signals.setpoint.position } else { newest.signals.angle }
    }

    /// Notes an event in a cycle.
    pub(super) fn mark(&self, cycle: u64, kind: MarkKind, text: String) {
        lock(&self.marks).push(Mark { cycle, kind, text });
    }

    /// Notes an event in the newest cycle.
    pub(super) fn mark_now(&self, kind: MarkKind, text: String) {
        let cycle = lock(&self.newest).cycle;
        self.mark(cycle, kind, text);
    }

    pub(super) fn marks(&self) -> Answer {
        Answer::Marks { marks: lock(&self.marks).all() }
    }

    /// Number of marks since the start.
    pub(super) fn mark_count(&self) -> u64 {
        lock(&self.marks).count()
    }
}
