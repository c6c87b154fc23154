//! What only a simulation can fail of.

/// A failure of a simulation, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// A step that an integrator cannot take without becoming wrong.
    #[error("a {scheme} step of {step:?} s is beyond the bound of {largest:.2e} s. {remedy}")]
    StepTooLarge {
        /// Which scheme.
        scheme: &'static str,
        /// Asked for [s].
        step: f64,
        /// The bound [s].
        largest: f64,
        /// What to do.
        remedy: &'static str,
    },
}

impl From<SimulateError> for stickslip_base::Error {
    fn from(error: SimulateError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
