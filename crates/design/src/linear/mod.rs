//! Linear systems: poles, zeros, responses, margins, and how systems are joined.
//!
//!   ẋ = A·x + B·u or x⁺ = A·x + B·u,   y = C·x + D·u
//!
//! Plain `f64`, at design time. A system comes from a [`Block`](stickslip_core::block::Block) by
//! [`linearise`], from the model of a machine by [`axis`], or from its matrices.

mod axis;
mod join;
mod linearise;
mod margins;
mod response;
mod spectrum;
mod state_space;
#[cfg(test)]
mod tests;

pub use axis::{Operating, axis, axis_under_control, port};
pub use linearise::linearise;
pub use margins::{Margins, Peak};
pub use response::{decibels, unwrapped};
pub use spectrum::size;
pub use state_space::{Port, StateSpace};
