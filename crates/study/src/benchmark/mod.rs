//! Benchmark of position controllers on the same machines, frictions and manoeuvres.
//!
//! An [`Entrant`] is a controller with compensation and hold. Built-in controllers are tuned first, all by the same
//! rules ([`tune`](stickslip_design::tune)); a controller of a file runs as written. Each drives the virtual machine
//! with a [`FrictionCase`], while the software's model is exact, or wrong by a [`Variation`]; the true angle is judged.
//! Seeds of noise give means and 95 % intervals, set-points between the counts give the share at which it hunts. An
//! entrant that does not complete a manoeuvre has failed, and has no number there.
//!
//! The rank counts tracking alone: the geometric mean of the deviations over those of the first entrant. Settling,
//! hold, creep and noise are listed separately. Where intervals overlap, ranks are shared.

mod courses;
mod entrant;
mod friction;
mod loaded;
mod rank;
mod report;
mod served;
mod study;

pub use entrant::{Entrant, HOUSE, entrants};
pub use friction::{FRICTIONS, FrictionCase, VARIATIONS, Variation};
pub use rank::{Ranked, rank};
pub use served::{BENCH, EntrantOnBench, Follow, run_on_bench};
pub use stickslip_simulate::manoeuvre::{Lane, MANOEUVRES, Manoeuvre, Measure, run_in_lanes, simulated_time};
pub use study::{CellResult, Outcome, Plan, run_plan};

/// Program and version of the results: another version may compute other numbers.
const PROGRAM: &str = concat!("stickslip ", env!("CARGO_PKG_VERSION"));

#[cfg(test)]
mod tests;
