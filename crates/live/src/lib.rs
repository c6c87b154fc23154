//! A bench that runs in real time and is operated by terminals, scripts and browsers at the same time.
//!
//! All clients use [`Live::call`] with the calls of [`protocol`], whose types are also the schema. HTTP, WebSocket, token
//! and page are in `crates/app/src/serve`. [`xcp`] serves the same bench to measurement and calibration tools.
//!
//! Threads: the real-time loop of `stickslip_bench` does not use this crate and never waits for it. One thread commands
//! the axis (`axis.rs`), one takes every cycle from the tap and feeds captures and recordings (`listener.rs`), one writes
//! the record to the disk (`Scribe` of `stickslip_bench`). Everything else, including the design of parameters, runs on the thread of the
//! caller. Slow readers lose rows; the loss is counted.
//!
//! ```
//! use stickslip_live::protocol::Call;
//!
//! let call = Call::from_json(serde_json::json!({ "call": "status" }))?;
//! assert_eq!(call.to_json()["call"], "status");
//! # Ok::<(), String>(())
//! ```
#![forbid(unsafe_code)]

mod access;
mod acquisition;
mod axis;
mod breakaway;
mod calls;
pub mod capture_report;
mod captures;
pub mod catalogue;
mod controller;
mod curve;
mod error;
mod fault;
mod following;
mod form;
mod frictions;
mod health;
mod implementation;
mod jog;
mod links;
mod listener;
mod loaded;
mod machine;
mod marks;
mod measurements;
mod motion;
mod operation;
mod orders;
mod parameters;
mod preload;
pub mod protocol;
mod recorder;
mod rendered;
mod runs;
mod shots;
mod signals;
mod start;
mod state;
mod status;
#[cfg(test)]
mod tests;
mod trials;
pub mod xcp;

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread::JoinHandle;

use acquisition::Acquisition;
use axis::Job;
use controller::ControllerDesign;
pub use error::LiveError;
use health::Health;
use implementation::Implementation;
use links::Links;
use measurements::Measurements;
use motion::Motion;
use operation::Operation;
use parameters::Parameters;
use recorder::Recorder;
use runs::{CatalogueThread, Runs};
pub use start::{RECORD_LIMIT, Start};
use state::TargetState;
use stickslip_bench::TimingReport;
use trials::Trials;

/// A running bench.
pub struct Live {
    shared: Arc<Shared>,
    jobs: mpsc::Sender<Job>,
    axis: JoinHandle<Option<TimingReport>>,
    listener: JoinHandle<()>,
    catalogue_thread: CatalogueThread,
    refused: Vec<String>,
}

/// The services that all threads use; each has its state and its locks.
///
/// A thread holds the lock of one service while it calls another in four cases only. A change of parameters holds
/// [`Parameters::changing`], then [`Motion::at_most_moving`]. The start of a recording holds the former while the loop
/// reports its state. The start of a motion is marked under the lock of [`Motion`]. The listener holds
/// [`Recorder::recordings`] while it takes cycles.
struct Shared {
    parameters: Parameters,
    state: TargetState,
    motion: Motion,
    operation: Operation,
    acquisition: Acquisition,
    recorder: Recorder,
    runs: Runs,
    measurements: Measurements,
    trials: Trials,
    health: Health,
    implementation: Implementation,
    controller: ControllerDesign,
    links: Links,
    /// Whether a client has ended the program.
    closed: AtomicBool,
}

/// Locks a mutex, also after a thread panicked while it held the lock: the data are still valid.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Live {
    /// Settings of the real-time thread that the system refused, each with its effect and a remedy.
    pub fn refused(&self) -> Vec<String> {
        self.refused.clone()
    }

    /// Ends the bench: the axis comes to rest. Returns the timing report.
    pub fn stop(self) -> Option<TimingReport> {
        let Shared { motion, runs, implementation, controller, .. } = &*self.shared;
        motion.halt();
        runs.end_replay();
        implementation.end_build();
        controller.cancel();
        // The axis may have ended already.
        let _ = self.jobs.send(Job::End);
        let timing = self.axis.join().ok().flatten();
        let _ = self.listener.join();
        self.catalogue_thread.finish();
        timing
    }
}
