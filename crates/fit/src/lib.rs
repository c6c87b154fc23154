//! Fits with covariance: each parameter has an error.
//!
//! ```
//! use stickslip_core::friction::Stribeck;
//! use stickslip_fit::{CurvePoint, StribeckPlan, fit_stribeck};
//!
//! let friction = Stribeck::default();
//! let points = [0.1, 0.5, 1.0, 2.0, 5.0, 20.0, 50.0]
//!     .map(|velocity| CurvePoint { velocity, torque: friction.torque(velocity), standard_error: 1e-3 });
//! let fit = fit_stribeck(&points, &StribeckPlan::default())?;
//! assert!((fit.parameters[0] - friction.breakaway_torque).abs() < 1e-3);
//! # Ok::<(), stickslip_base::Error>(())
//! ```
#![forbid(unsafe_code)]

mod choice;
mod coulomb;
mod drop;
mod error;
mod findings;
mod linear;
mod nonlinear;
mod optimum;
mod points;
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
pub use linear::{Instrumented, LinearFit, fit_instrumented, fit_linear};
pub use nonlinear::{Minimum, Stop, TRIALS, minimise, minimise_side_by_side};
pub use points::check_points;
pub use profile::{Profile, ProfilePlan};
pub use statistics::{f_test, runs_test, student_t95};
pub use stribeck::{
    CurvePoint, HUBER, OUTLIER, PARAMETERS, Side, StribeckDrop, StribeckFit, StribeckPlan, Uncertainty, fit_stribeck,
    values, with_values,
};
