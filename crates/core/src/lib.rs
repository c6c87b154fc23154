//! The mathematics of the friction bench, written once over any kind of number.
//!
//! Without `std`, without allocation, without `unsafe`, without I/O. A block is a plain struct of parameters, a plain
//! struct of state and a `step`; numbers are [`Scalar`]s: `f64` and `f32` for simulation and real time, [`Lanes`] for
//! studies, [`Dual`] for gradients, and the recorder of `stickslip-codegen` for C.
//!
//! Three traits carry everything: [`Scalar`] (a number), [`fields::Fields`] (name, unit, range, default and help of each
//! number) and [`block::Block`] (parameters, state, step). A signal path has no `if`: a comparison gives a mask, the mask
//! selects, and both sides are computed.
//!
//! ```
//! use stickslip_core::friction::Stribeck;
//!
//! let friction = Stribeck::<f64>::default();
//! // Breakaway, then sliding: the friction falls with the speed and rises again with the viscous part.
//! assert_eq!(friction.magnitude(0.0), friction.breakaway_torque);
//! assert!(friction.magnitude(5.0) < friction.magnitude(0.0));
//! ```
//!
//! [`Scalar`]: scalar::Scalar
//! [`Lanes`]: scalar::Lanes
//! [`Dual`]: scalar::Dual
#![no_std]
#![forbid(unsafe_code)]

// The derive writes paths that begin with `::stickslip_core`, also within this crate.
extern crate self as stickslip_core;

#[cfg(test)]
extern crate std;

pub mod block;
pub mod control;
pub mod drive;
pub mod estimate;
pub mod fields;
pub mod friction;
pub mod plant;
pub mod render;
pub mod scalar;
pub mod sensor;
pub mod snapshot;
pub mod tick;

pub use stickslip_derive::Fields;
