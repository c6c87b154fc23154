//! What runs inside the deadline. All memory is allocated at the start; then no allocation, no lock, no wait but for
//! the next cycle, and no system call but the clock's. Only a cycle that has already missed its deadline may ask the
//! system why.
//!
//! The [`Executive`] calls a [`Cycle`] at absolute instants, so that nothing drifts: cycle k begins k periods after the
//! start, or not at all. [`Running`] is an executive on a thread of its own with what [`Wishes`] the system grants. Each
//! cycle leaves a [`Timing`]; one that missed its deadline names the [`Cause`]. Parameters enter by [`pages`]. What the
//! machine itself costs, [`doctor`] says. Nothing here knows of friction, benches or files.

mod cause;
mod clock;
mod cycle;
pub mod doctor;
mod executive;
mod floating_point;
mod histograms;
pub mod pages;
mod rate;
mod running;
mod setup;
mod sync;
mod system;
mod timing;
mod watcher;

pub use cause::{Cause, Evidence, Overrun};
pub use clock::{Clock, MonotonicClock, Nanoseconds, SimulatedClock};
pub use cycle::{Block, Cycle, Lap, MAX_BLOCKS, Next};
pub use executive::{Ending, Executive, OverrunPolicy, Plan, PlanError, Summary};
pub use floating_point::FloatingPoint;
pub use histograms::{Histograms, Quantiles};
pub use rate::Rate;
pub use running::Running;
pub use setup::{Cpu, Granted, Outcome, Wish, Wishes};
pub use timing::{Timing, Timings};
