//! From a recording of an axis to its inertia and friction, with what is known of their errors.

mod axis;
mod motion;
mod rigid;

pub use axis::{AxisModel, ClosedLoop, Loop, Prediction, coulomb};
pub use motion::{Motion, Regression};
pub use rigid::{ASYMMETRIC, Asymmetric, SYMMETRIC, Symmetric};

#[cfg(test)]
mod tests;
