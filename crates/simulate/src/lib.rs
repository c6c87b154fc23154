//! Simulation of the virtual bench without an experiment around it: one position loop ([`simulation`]), the signal path
//! in vector lanes ([`fast_bench`]), the machines that trajectory equivalence compares ([`fidelity`]), and the choice
//! of a rendering law based on it ([`rendering_law`]).
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
