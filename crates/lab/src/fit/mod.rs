//! Fits with covariance: parameters never come without what is known of their error.

mod drop;
mod projection;
mod statistics;
mod stribeck;
#[cfg(test)]
mod tests;

pub use drop::SIGNIFICANCE;
pub use statistics::{f_test, student_t95};
pub use stribeck::{CurvePoint, Side, StribeckDrop, StribeckFit, StribeckPlan, Uncertainty, fit_stribeck};
