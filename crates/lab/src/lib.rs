//! The friction bench as a library: measure, fit, design, render, re-measure, rank, report.
#![forbid(unsafe_code)]

mod error;
pub mod filter;
pub mod fit;
pub mod machine;
pub mod recording;
pub mod units;

pub use error::Error;
