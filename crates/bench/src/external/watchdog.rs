//! The thread that minds a process: it says why it has ended, and ends one that hangs.
//!
//! Whoever waits for an answer, or may not wait, looks here and at nothing else.

use std::io;
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, ExitStatus};
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use stickslip_core::supervise::ExternalFault;
use stickslip_rt::{Alarm, Clock as _, MonotonicClock, hurry};

/// From look to look.
const LOOK: Duration = Duration::from_millis(5);

/// What both threads know.
#[derive(Default)]
struct Known {
    stop: AtomicBool,
    /// Since when an answer is due [ns]; 0 where none is.
    asked: AtomicU64,
    /// Without an answer for so long it hangs [ns].
    patience: AtomicU64,
    /// Real-time priority that it is to have; 0 where it stays as it is.
    priority: AtomicU8,
    ended: OnceLock<ExternalFault>,
}

/// Of a process, which ends with it.
pub(super) struct Watchdog {
    known: Arc<Known>,
    thread: Option<JoinHandle<()>>,
}

impl Watchdog {
    /// Minds a process: without an answer for so long it hangs and is ended. How it ended, it says after the alarm.
    pub(super) fn start(mut child: Child, alarm: Alarm, patience: Duration) -> io::Result<Self> {
        let known = Arc::new(Known { patience: AtomicU64::new(nanoseconds(patience)), ..Known::default() });
        let knows = known.clone();
        let mind = move || {
            let fault = knows.mind(&mut child);
            // Nobody else sets it.
            let _ = knows.ended.set(fault);
            alarm.ring();
        };
        let thread = thread::Builder::new().name("stickslip-mind".into()).spawn(mind)?;
        Ok(Watchdog { known, thread: Some(thread) })
    }

    /// From now on it hangs without an answer for so long.
    pub(super) fn be_patient_for(&self, patience: Duration) {
        self.known.patience.store(nanoseconds(patience), Ordering::Relaxed);
    }

    /// From now on it runs at this real-time priority, where the system lets it.
    pub(super) fn hurry(&self, priority: u8) {
        self.known.priority.store(priority, Ordering::Relaxed);
        self.thread.iter().for_each(|thread| thread.thread().unpark());
    }

    /// From now on an answer is due: the time [ns].
    pub(super) fn asked(&self) -> u64 {
        let now = now();
        self.known.asked.store(now, Ordering::Relaxed);
        now
    }

    /// None is due any more.
    pub(super) fn answered(&self) {
        self.known.asked.store(0, Ordering::Relaxed);
    }

    /// Why it has ended, if it has.
    pub(super) fn ended(&self) -> Option<ExternalFault> {
        self.known.ended.get().copied()
    }

    /// Waits until that is known: where an answer is due, not for ever.
    pub(super) fn why(&self) -> ExternalFault {
        *self.known.ended.wait()
    }
}

impl Known {
    fn mind(&self, child: &mut Child) -> ExternalFault {
        loop {
            match child.try_wait() {
                Ok(Some(status)) => return named(status),
                Ok(None) => {}
                Err(_) => return ExternalFault::Ended { code: -1 },
            }
            // Here nobody else can have its number.
            match self.priority.swap(0, Ordering::Relaxed) {
                0 => {}
                // Refused, it stays an ordinary process.
                priority => drop(hurry(child.id(), priority)),
            }
            let asked = self.asked.load(Ordering::Relaxed);
            let patience = self.patience.load(Ordering::Relaxed);
            let hangs = asked != 0 && now().saturating_sub(asked) > patience;
            if hangs || self.stop.load(Ordering::Relaxed) {
                // Whatever it does, it does it no more.
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

/// How it ended.
fn named(status: ExitStatus) -> ExternalFault {
    match status.signal() {
        Some(signal) => ExternalFault::Crashed { signal },
        None => ExternalFault::Ended { code: status.code().unwrap_or(-1) },
    }
}

/// The monotonic time of the system, which all its processes have [ns].
pub(super) fn now() -> u64 {
    MonotonicClock::default().now()
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        self.known.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It has nothing to say.
            let _ = thread.join();
        }
    }
}
