//! The friction bench as a library: measure, fit, design, render, re-measure, rank, report.
#![forbid(unsafe_code)]

pub mod design;
mod error;

pub use error::Error;
