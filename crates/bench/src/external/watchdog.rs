//! Watchdog thread of a host process: it reports why the process ended, and ends a hanging process.
//!
//! It is the only source for the state of the process.

use std::io;
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, ExitStatus};
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use stickslip_rt::{Alarm, Clock as _, MonotonicClock, hurry};
use stickslip_software::supervise::ExternalFault;

/// Polling interval.
const LOOK: Duration = Duration::from_millis(5);

/// State shared by both threads.
#[derive(Default)]
struct Shared {
    stop: AtomicBool,
    /// Time since when an answer is due [ns]; 0 if none is due.
    due_since: AtomicU64,
    /// Time-out of an answer [ns].
    patience: AtomicU64,
    /// Requested real-time priority; 0 for no change.
    priority: AtomicU8,
    ended: OnceLock<ExternalFault>,
}

/// Watchdog of a process, which ends with it.
pub(super) struct Watchdog {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Watchdog {
    /// Starts the watchdog: without an answer within `patience` the process is ended. The alarm rings after its end.
    pub(super) fn start(mut child: Child, alarm: Alarm, patience: Duration) -> io::Result<Self> {
        let shared = Arc::new(Shared { patience: AtomicU64::new(nanoseconds(patience)), ..Shared::default() });
        let state = shared.clone();
        let watch = move || {
            let fault = state.watch(&mut child);
            // It is set only here.
            let _ = state.ended.set(fault);
            alarm.ring();
        };
        let thread = thread::Builder::new().name("stickslip-mind".into()).spawn(watch)?;
        Ok(Watchdog { shared, thread: Some(thread) })
    }

    /// Changes the time-out of an answer.
    pub(super) fn be_patient_for(&self, patience: Duration) {
        self.shared.patience.store(nanoseconds(patience), Ordering::Relaxed);
    }

    /// Requests a real-time priority for the process.
    pub(super) fn hurry(&self, priority: u8) {
        self.shared.priority.store(priority, Ordering::Relaxed);
        self.thread.iter().for_each(|thread| thread.thread().unpark());
    }

    /// Starts the time-out of an answer. Returns the time [ns].
    pub(super) fn start_timeout(&self) -> u64 {
        let now = now();
        self.shared.due_since.store(now, Ordering::Relaxed);
        now
    }

    /// Stops the time-out.
    pub(super) fn stop_timeout(&self) {
        self.shared.due_since.store(0, Ordering::Relaxed);
    }

    /// Reason of its end, if it has ended.
    pub(super) fn ended(&self) -> Option<ExternalFault> {
        self.shared.ended.get().copied()
    }

    /// Waits for the end of the process; bounded while an answer is due.
    pub(super) fn wait_for_end(&self) -> ExternalFault {
        *self.shared.ended.wait()
    }
}

impl Shared {
    fn watch(&self, child: &mut Child) -> ExternalFault {
        loop {
            match child.try_wait() {
                Ok(Some(status)) => return fault_of(status),
                Ok(None) => {}
                Err(_) => return ExternalFault::Ended { code: -1 },
            }
            // The process exists, so its number is not reused.
            match self.priority.swap(0, Ordering::Relaxed) {
                0 => {}
                // If refused, it remains an ordinary process.
                priority => drop(hurry(child.id(), priority)),
            }
            let due_since = self.due_since.load(Ordering::Relaxed);
            let patience = self.patience.load(Ordering::Relaxed);
            let hangs = due_since != 0 && now().saturating_sub(due_since) > patience;
            if hangs || self.stop.load(Ordering::Relaxed) {
                // The process hangs or is not needed any more.
                let _ = child.kill();
                let _ = child.wait();
                return ExternalFault::Silent { time: 1e-9 * patience as f64 };
            }
            thread::park_timeout(LOOK);
        }
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Fault for an exit status.
fn fault_of(status: ExitStatus) -> ExternalFault {
    match status.signal() {
        Some(signal) => ExternalFault::Crashed { signal },
        None => ExternalFault::Ended { code: status.code().unwrap_or(-1) },
    }
}

/// The monotonic time of the system, common to all processes [ns].
pub(super) fn now() -> u64 {
    MonotonicClock::default().now()
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It returns no result.
            let _ = thread.join();
        }
    }
}
