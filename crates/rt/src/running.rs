//! An executive on a separate thread.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};

use crate::clock::Clock;
use crate::cycle::Cycle;
use crate::executive::{Ending, Executive, Plan, PlanError, Summary};
use crate::setup::{self, Granted, ThreadSettings};
use crate::system;
use crate::timing::Timings;
use crate::watcher::{ThreadUsage, Watcher};

/// A running cycle, stopped when this is dropped.
pub struct Running {
    stop: Arc<AtomicBool>,
    granted: Granted,
    thread: Option<JoinHandle<Summary>>,
    /// Takes baselines until the end.
    _watcher: Option<Watcher>,
}

impl Running {
    /// Starts the cycle on a new thread with these settings. Its memory, including the stack, is resident before the
    /// first cycle. [`granted`](Self::granted) lists the refused settings.
    ///
    /// # Errors
    /// [`PlanError`] for an invalid plan or invalid blocks, or if the system cannot start a thread.
    pub fn start(
        plan: Plan,
        settings: ThreadSettings,
        clock: impl Clock + Send + 'static,
        cycle: impl Cycle + 'static,
    ) -> Result<(Self, Timings), PlanError> {
        let (executive, timings) = Executive::new(plan, cycle)?;
        let stop = executive.stop();
        let (started, start) = mpsc::channel();
        // This thread starts the watcher: a child of the executive's thread would inherit its CPU.
        let (go, ready) = mpsc::channel::<()>();
        let thread = thread::Builder::new().name("stickslip-rt".into()).spawn(move || {
            let held = setup::apply(&settings);
            let (usage, watch) = ThreadUsage::new();
            // The starting thread waits for this message; if it has ended, the stop flag is set.
            let _ = started.send((held.granted.clone(), watch));
            let _ = ready.recv();
            executive.run_with(&clock, system::COUNTS.then_some(usage))
        })?;
        // Without a message the thread has panicked; `join` reports it.
        let (granted, watcher) = start.recv().map(|(granted, watch)| (granted, watch())).unwrap_or_default();
        let _ = go.send(());
        Ok((Running { stop, granted, thread: Some(thread), _watcher: watcher }, timings))
    }

    /// Granted and refused settings.
    pub fn granted(&self) -> &Granted {
        &self.granted
    }

    /// Whether it has ended.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Requests a stop before the next cycle.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Waits until it ends.
    pub fn join(mut self) -> Summary {
        self.wait().expect("only `wait` and `drop` take the thread")
    }

    fn wait(&mut self) -> Option<Summary> {
        let joined = self.thread.take()?.join();
        // The executive catches panics of its cycle.
        Some(joined.unwrap_or_else(|_| Summary::of(Ending::Panicked("the executive's own thread ended".into()))))
    }
}

/// A cycle without an owner must not move hardware.
impl Drop for Running {
    fn drop(&mut self) {
        self.stop();
        self.wait();
    }
}
