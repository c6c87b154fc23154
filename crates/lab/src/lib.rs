//! The friction bench as a library: measure, fit, design, render, re-measure, rank, report.
#![forbid(unsafe_code)]

pub mod design;
mod error;
pub mod filter;
pub mod fit;
pub mod integrator;
pub mod machine;
pub mod output;
pub mod parameters;
pub mod recording;
pub mod summary;
pub mod units;
pub mod watch;

pub use error::Error;
pub use summary::Summary;
pub use watch::Watch;
