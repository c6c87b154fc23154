//! Simulation of the virtual bench without an experiment around it: one position loop ([`simulation`]), the signal path
//! in vector lanes ([`fast_bench`]), the machines that trajectory equivalence compares ([`fidelity`]), and the choice
//! of a rendering law based on it ([`rendering_law`]).
//!
//! ```
//! use stickslip_base::{Preset, parameters};
//! use stickslip_core::tick::Order;
//! use stickslip_simulate::fast_bench::FastBench;
//!
//! let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
//! let software = stickslip_design::software(&preset.model, &preset.bench)?;
//! let mut bench = FastBench::new(&preset.plant, software, &preset.bench, preset.bench.divider(), 1)?;
//! for _ in 0..400 {
//!     bench.tick(Order { added_torque: 0.5, ..Order::default() });
//! }
//! assert!(bench.true_state().plant.machine.velocity > 0.0);
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

mod error;
pub mod fast_bench;
pub mod fidelity;
pub mod integrator;
pub mod manoeuvre;
mod rendering_law;
pub mod simulation;
#[cfg(test)]
mod tests;

pub use error::SimulateError;
pub use rendering_law::rendering_law;
