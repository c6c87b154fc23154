//! An executive on a thread of its own.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::{self, JoinHandle};

use crate::clock::MonotonicClock;
use crate::cycle::Cycle;
use crate::executive::{Ending, Executive, Plan, PlanError, Summary};
use crate::setup::{self, Granted, ThreadSettings};
use crate::system;
use crate::timing::Timings;
use crate::watcher::{ThreadUsage, Watcher};

/// A cycle that runs; stopped when this is dropped.
pub struct Running {
    stop: Arc<AtomicBool>,
    granted: Granted,
    thread: Option<JoinHandle<Summary>>,
    /// Takes its baselines until the end.
    _watcher: Option<Watcher>,
}

impl Running {
    /// Starts the cycle on a thread that has asked for its wishes. Its memory, stack included, is there before the first
    /// cycle; what the system refused is in [`granted`](Self::granted).
    ///
    /// # Errors
    /// [`PlanError`] where plan or blocks cannot be, or the system has no thread.
    pub fn start(
        plan: Plan,
        wishes: ThreadSettings,
        clock: MonotonicClock,
        cycle: impl Cycle + 'static,
    ) -> Result<(Self, Timings), PlanError> {
        let (executive, timings) = Executive::new(plan, cycle)?;
        let stop = executive.stop();
        let (tell, told) = mpsc::channel();
        // The watcher is started by this thread: one that the executive started would be pinned as it is.
        let (go, ready) = mpsc::channel::<()>();
        let thread = thread::Builder::new().name("stickslip-rt".into()).spawn(move || {
            let held = setup::ask(&wishes);
            let (witness, watch) = ThreadUsage::new();
            // Who has started this waits for it; should it have gone, the stop flag tells.
            let _ = tell.send((held.granted.clone(), watch));
            let _ = ready.recv();
            executive.run_with(&clock, system::COUNTS.then_some(witness))
        })?;
        // Without an answer the thread has panicked, which joining it tells.
        let (granted, watcher) = told.recv().map(|(granted, watch)| (granted, watch())).unwrap_or_default();
        let _ = go.send(());
        Ok((Running { stop, granted, thread: Some(thread), _watcher: watcher }, timings))
    }

    /// What the system granted.
    pub fn granted(&self) -> &Granted {
        &self.granted
    }

    /// Whether it has ended by itself.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Asks it to stop, before its next cycle.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Waits until it ends.
    pub fn join(mut self) -> Summary {
        self.wait().expect("nobody else takes the thread")
    }

    fn wait(&mut self) -> Option<Summary> {
        let joined = self.thread.take()?.join();
        // The executive catches what its cycle panics with.
        Some(joined.unwrap_or_else(|_| Summary::of(Ending::Panicked("the executive's own thread ended".into()))))
    }
}

/// A cycle that nobody holds any more must not go on moving something.
impl Drop for Running {
    fn drop(&mut self) {
        self.stop();
        self.wait();
    }
}
