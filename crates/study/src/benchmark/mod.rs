//! Which controller is the best for which friction? Controllers under test on the same machines, frictions and manoeuvres.
//!
//! An [`Entrant`] is a controller with compensation and hold. Those of the house are tuned first, all by the same rules
//! ([`tune`](stickslip_design::tune)); one of a file runs as it is stated. Each drives the virtual machine that truly has a
//! [`FrictionCase`], while the software believes it, or is wrong about it by a [`Variation`]; what it did is judged by the
//! true angle. Over seeds of noise follow means and 95 % intervals, over set-points off the counts the share of those at
//! which it hunts. Who did not come to the end of a manoeuvre has failed; no number hides that.
//!
//! The rank counts tracking alone: the geometric mean of the deviations over those of the first entrant. Settling, hold,
//! creep and noise stand beside it. Where intervals overlap, ranks are shared.

mod entrant;
mod friction;
mod loaded;
mod rank;
mod report;
mod run;
mod study;

pub use entrant::{Entrant, HOUSE, entrants};
pub use friction::{FRICTIONS, FrictionCase, VARIATIONS, Variation};
pub use rank::{Ranked, rank};
pub use run::{run_abreast, simulated_time};
pub use stickslip_simulate::manoeuvre::{MANOEUVRES, Manoeuvre, Measure};
pub use study::{CellResult, Outcome, Plan, run_plan};

/// Whose results they are: another version may compute otherwise.
const PROGRAM: &str = concat!("stickslip ", env!("CARGO_PKG_VERSION"));

#[cfg(test)]
mod tests;
