//! Parameters in files: [`read`], [`write_commented`], [`set`]; by path: [`flatten`], [`describe`], [`diff`].
//!
//! Everything follows from the tables of `stickslip_core::fields`. A path such as `plant.drive.motor_inertia` is for
//! files, forms and the command line; in Rust use the field.

mod change;
mod entry;
mod laws;
mod node;
pub(crate) mod number;
pub mod presets;
mod problem;
mod read;
pub(crate) mod schema;
mod set;
#[cfg(test)]
mod tests;
mod write;

pub(crate) use change::{change, check};
pub use entry::{Difference, Entry, Value, diff, flatten};
pub(crate) use entry::{differences, within};
pub use problem::{Fault, ParameterProblems, Problem};
pub use read::read;
pub use schema::{Description, describe};
pub use set::{set, set_all};
pub use write::write_commented;
