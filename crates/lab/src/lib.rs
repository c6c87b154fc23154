//! The friction bench as a library: measure, fit, design, render, re-measure, rank, report.
#![forbid(unsafe_code)]

mod error;
pub mod filter;
pub mod fit;
pub mod integrator;

pub use error::Error;
