//! Parameter studies on the virtual bench: what becomes of a manoeuvre when parameters of the machine, of the belief or of
//! the controller change.
//!
//! A [`Plan`] names a machine, who drives it ([`Entrant`](crate::benchmark::Entrant)), manoeuvres with their measures
//! ([`Manoeuvre`](crate::benchmark::Manoeuvre)), axes of parameters, and a [`Design`]: a grid, a sample, or what a
//! sensitivity analysis asks for. [`read`] reads it from a file. Truth and belief are apart in the parameters, so that an
//! axis changes the machine, what is believed of it, or both.
//!
//! The step of the virtual machine is the program's choice, case by case, so that no measure moves by more than the
//! tolerance of the plan when it is halved; what is left is in each row.
//!
//! Each case is a function of its number: threads, order, lanes and interruptions do not show in the result. [`run_study`]
//! runs them here; [`Parts`] hands the [`Work`] to whoever will.
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

/// What came out.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was asked for.
    pub plan: Plan,
    /// Its file, one row a case.
    pub file: PathBuf,
    /// Cases.
    pub cases: u64,
    /// Those of them that an earlier run had left.
    pub kept: u64,
}

#[cfg(test)]
mod tests;
