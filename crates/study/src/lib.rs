//! Parameter studies on the virtual bench: how the measures of a manoeuvre depend on parameters of the machine, of the
//! model or of the controller.
//!
//! A [`Plan`] names a machine, a controller ([`Entrant`](crate::benchmark::Entrant)), manoeuvres with their measures
//! ([`Manoeuvre`](crate::benchmark::Manoeuvre)), axes of parameters, and a [`Design`]: a grid, a sample, or the cases
//! of a sensitivity analysis. [`read`] reads it from a file. Machine and model have separate parameters, so that an
//! axis changes the machine, the model, or both.
//!
//! The step of the virtual machine is selected for each case, so that no measure moves by more than the tolerance of
//! the plan when it is halved; the remaining error is in each row.
//!
//! Each case is a function of its number: the result does not depend on threads, order, lanes and interruptions.
//! [`run_study`] runs the cases here; [`Parts`] hands the [`Work`] to other machines.
//!
//! ```
//! use stickslip_study::read_text;
//!
//! let study = r#"
//!     preset = "prototype"
//!     manoeuvres = ["reversal"]
//!     [[axis]]
//!     path = "model.own.breakaway_torque"
//!     factor = true
//!     range = [0.7, 1.3]
//!     points = 7
//! "#;
//! assert_eq!(read_text(study, None)?.cases()?, 7);
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

mod axis;
pub mod benchmark;
mod cases;
mod check;
mod design;
pub mod fidelity;
mod file;
mod outcome;
mod pictures;
mod plan;
mod report;
mod run;
mod sensitivity;
mod sobol;
mod step_size;
mod table;
pub mod trials;
mod work;

use std::path::PathBuf;

pub use axis::{Axis, Spread};
pub use design::Design;
pub use file::{read, read_text};
pub use outcome::Findings;
pub use plan::Plan;
pub use run::{Parts, run_study};
pub use table::Row;
pub use work::Work;

/// Outcome of a study.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The plan.
    pub plan: Plan,
    /// The file of the study, one row for each case.
    pub file: PathBuf,
    /// Number of cases.
    pub cases: u64,
    /// Cases reused from an earlier run.
    pub reused: u64,
}

#[cfg(test)]
mod tests;
