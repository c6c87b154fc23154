//! Fits with covariance: parameters never come without what is known of their error.

mod drop;
mod linear;
mod projection;
mod statistics;
mod stribeck;
#[cfg(test)]
mod tests;

pub use drop::SIGNIFICANCE;
pub use linear::{LinearFit, fit_linear};
pub use statistics::{f_test, student_t95};
pub use stribeck::{CurvePoint, Side, StribeckDrop, StribeckFit, StribeckPlan, Uncertainty, fit_stribeck};
