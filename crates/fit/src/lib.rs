//! Fits with covariance: each parameter has an error.
#![forbid(unsafe_code)]

mod choice;
mod drop;
mod error;
mod findings;
mod linear;
mod nonlinear;
mod optimum;
mod profile;
mod projection;
mod statistics;
mod stribeck;
#[cfg(test)]
mod tests;
pub mod uncertainty;

pub use choice::{Choice, choose};
pub use drop::SIGNIFICANCE;
pub use error::FitError;
pub use findings::{Finding, HARDLY_KNOWN};
pub use linear::LongRun;
pub use linear::{LinearFit, fit_linear};
pub use nonlinear::{Minimum, Stop, minimise};
pub use profile::{Profile, ProfilePlan};
pub use statistics::{f_test, runs_test, student_t95};
pub use stribeck::{
    CurvePoint, HUBER, OUTLIER, PARAMETERS, Side, StribeckDrop, StribeckFit, StribeckPlan, Uncertainty, fit_stribeck,
    values, with_values,
};
