//! Code that runs inside the deadline. All memory is allocated at the start. After that: no allocation, no lock, no
//! wait except for the next cycle, no system call except the clock's. Only a cycle that has already missed its deadline
//! queries the system for the cause.
//!
//! The [`Executive`] calls a [`Cycle`] at absolute instants, so that nothing drifts: cycle k begins k periods after the
//! start, or not at all. [`Running`] is an executive on a separate thread with the [`ThreadSettings`] that the system
//! grants. Each cycle writes a [`Timing`]; a missed deadline is recorded with its [`Cause`]. Parameters enter by
//! [`pages`]. [`doctor`] lists the settings of the computer that cost determinism. This crate is independent of
//! friction, benches and files.
//!
//! ```
//! use std::time::Duration;
//! use stickslip_rt::{Block, Cycle, Histograms, Lap, MonotonicClock, Next, Plan, Running, ThreadSettings};
//!
//! /// Counts for a hundred milliseconds.
//! struct Counter(u64);
//!
//! impl Cycle for Counter {
//!     fn blocks(&self) -> &[Block] {
//!         const { &[Block::new("count")] }
//!     }
//!     fn run(&mut self, cycle: u64, lap: &mut Lap) -> Next {
//!         self.0 += 1;
//!         lap.done(0);
//!         if cycle < 100 { Next::Continue } else { Next::Stop }
//!     }
//!     fn hold(&mut self, _missed: u64) {}
//!     fn end(&mut self) {}
//! }
//!
//! let plan = Plan { warm_up: 0, ..Plan::new(Duration::from_millis(1)) };
//! let (running, mut timings) = Running::start(plan, ThreadSettings::default(), MonotonicClock::default(), Counter(0))?;
//! print!("{}", running.granted());
//! let summary = running.join();
//! let mut histograms = Histograms::new(timings.blocks());
//! histograms.take(&mut timings);
//! println!("{:?}, late by {:?} ns", summary.ending, histograms.lateness());
//! # Ok::<(), stickslip_rt::PlanError>(())
//! ```

mod cause;
mod clock;
mod cycle;
mod datagrams;
#[cfg(unix)]
mod dialogue;
pub mod doctor;
mod executive;
mod floating_point;
mod fmu;
#[cfg(unix)]
mod handover;
mod histograms;
mod module;
pub mod pages;
mod rate;
mod running;
mod segment;
mod serial;
mod setup;
#[cfg(unix)]
mod slot;
mod sync;
mod system;
mod timing;
mod watcher;

pub use cause::{Cause, Evidence, Overrun};
pub use clock::{Clock, MonotonicClock, Nanoseconds, SPIN, ShiftedClock, SimulatedClock};
pub use cycle::{Block, Cycle, Lap, MAX_BLOCKS, Next};
pub use datagrams::report_closed_ports;
#[cfg(unix)]
pub use dialogue::{ANSWER, Alarm, Requester, Responder};
pub use executive::{Ending, Executive, OverrunPolicy, Plan, PlanError, Summary};
pub use floating_point::FloatingPoint;
pub use fmu::{FmiVersion, Fmu, FmuError, FmuLibrary};
#[cfg(unix)]
pub use handover::{hand_over, take_over};
pub use histograms::{Durations, Histograms, Quantiles};
pub use module::{MODULE_ABI, MOST_PARAMETERS, Module, ModuleError, ModuleParameter, ModuleSample};
pub use rate::Rate;
pub use running::Running;
pub use segment::Segment;
pub use serial::open_serial;
pub use setup::{Cpu, Granted, Outcome, ThreadSetting, ThreadSettings, hurry, keep_off};
pub use timing::{Timing, Timings};
