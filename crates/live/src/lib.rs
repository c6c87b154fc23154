//! A bench that runs in real time and is operated by terminals, scripts and browsers at the same time.
//!
//! All clients use [`Live::call`] with the calls of [`protocol`], whose types are also the schema. The doors are in
//! `crates/app/src/serve`: HTTP, WebSocket, token and page. [`xcp`] serves the same bench to measurement and calibration
//! tools.
//!
//! Threads: the real-time loop of `stickslip_bench` does not know this crate and never waits for it. One thread commands
//! the axis (`axis.rs`), one takes every cycle from the tap and feeds captures and recordings (`listener.rs`), one writes
//! the record to the disk (`scribe.rs`). Everything else, including the design of parameters, runs on the thread of the
//! caller. Slow readers lose rows; the loss is counted.
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
mod form;
mod health;
mod implementation;
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
pub mod realtime;
mod recorder;
mod rendered;
mod runs;
mod scribe;
mod signals;
mod start;
mod status;
#[cfg(test)]
mod tests;
pub mod xcp;

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
pub use start::Start;
use stickslip_bench::TimingReport;

/// A bench that runs.
pub struct Live {
    shared: Arc<Shared>,
    jobs: mpsc::Sender<Job>,
    axis: JoinHandle<Option<TimingReport>>,
    listener: JoinHandle<()>,
    clerk: CatalogueThread,
    refused: Vec<String>,
}

/// The services that all threads use; each has its state and its locks.
///
/// A thread holds the lock of one service while it calls another in four cases only. A change of parameters holds
/// [`Parameters::changing`], then [`Motion::at_most_moving`]. The begin of a record holds the former while the loop
/// gives its state. The begin of a motion is marked under the lock of [`Motion`]. The listener holds
/// [`Recorder::recording`] while it takes cycles.
struct Shared {
    parameters: Parameters,
    motion: Motion,
    operation: Operation,
    acquisition: Acquisition,
    recorder: Recorder,
    runs: Runs,
    measurements: Measurements,
    health: Health,
    implementation: Implementation,
    controller: ControllerDesign,
    links: Links,
}

/// A thread that panicked has left what it held as it was.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Live {
    /// What the system refused to the real-time thread, each with its effect and a remedy.
    pub fn refused(&self) -> Vec<String> {
        self.refused.clone()
    }

    /// Ends it: the axis comes to rest. Returns how the clock was kept.
    pub fn stop(self) -> Option<TimingReport> {
        let Shared { motion, runs, implementation, controller, .. } = &*self.shared;
        motion.halt();
        runs.end_replay();
        implementation.end_build();
        controller.cancel();
        // An axis that has ended already needs no end.
        let _ = self.jobs.send(Job::End);
        let clocked = self.axis.join().ok().flatten();
        let _ = self.listener.join();
        self.clerk.finish();
        clocked
    }
}
