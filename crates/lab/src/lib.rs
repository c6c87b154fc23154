//! The friction bench as a library: measure, fit, design, render, re-measure, rank, report.
#![forbid(unsafe_code)]

mod error;
pub mod figure;
pub mod quantity;
pub mod report;

pub use error::Error;
