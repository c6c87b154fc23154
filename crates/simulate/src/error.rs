//! Errors of simulations.

/// Errors of simulations, besides those common to all crates.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// A step above the accuracy bound of an integrator.
    #[error("a {scheme} step of {step:?} s is above the bound of {largest:.2e} s. {remedy}")]
    StepTooLarge {
        /// The scheme.
        scheme: &'static str,
        /// The requested step [s].
        step: f64,
        /// The bound [s].
        largest: f64,
        /// The remedy.
        remedy: &'static str,
    },
}

impl From<SimulateError> for stickslip_base::Error {
    fn from(error: SimulateError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
