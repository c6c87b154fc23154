//! Parameters in files: [`read`], [`write_commented`], [`set`]; by path: [`flatten`], [`describe`], [`diff`].
//!
//! Everything follows from the tables of `stickslip_core::fields`. A path such as `plant.drive.motor_inertia` is for
//! files, forms and the command line; in Rust use the field.

/// Table of a parameter file with the results of an identification; not parameters of the bench.
pub const IDENTIFIED: &str = "identified";
/// Table of a parameter file with the covariance of a fit; not parameters of the bench.
pub const UNCERTAINTY: &str = "uncertainty";

mod change;
mod entry;
mod laws;
mod node;
pub mod number;
pub mod presets;
mod problem;
mod read;
pub mod schema;
mod set;
#[cfg(test)]
mod tests;
mod write;

pub use change::{change, check};
pub use entry::{Difference, Entry, Value, diff, differences, flatten, within};
pub use problem::{Fault, ParameterProblems, Problem};
pub use read::read;
pub use schema::{Description, describe};
pub use set::{changed, set, set_all};
pub use write::write_commented;
