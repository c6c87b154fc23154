//! The machines of a trajectory comparison, their scenarios and scores.
//!
//! The comparison itself, its report and its plan are in `stickslip_study::fidelity`.

mod cell;
mod cycle;
pub mod law;
mod machine;
mod mismatch;
mod pick;
mod run;
pub mod scenario;
mod score;
mod staircase;

pub use cell::{Cell, Correct, Runs};
pub use cycle::LimitCycle;
pub use law::{AUTO, LAWS, law_names};
pub use machine::{Role, machine};
pub use mismatch::{MISMATCHES, Mismatch, sliding_mut};
pub use pick::{Pick, Prediction, pick_law};
pub use run::Trace;
pub use scenario::{CLOSED_LOOP, SCENARIOS, Scenario};
pub use score::{Score, scores};
