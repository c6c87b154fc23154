//! What only a fit can fail of.

/// A failure of a fit, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A motion that does not tell the parameters apart.
    #[error(
        "the motion does not tell the parameters apart: a share of {smallest:.3e} of one is left by the others, 1e-9 is \
         needed. Record several speeds and accelerations in both directions."
    )]
    Dependent {
        /// Share of a column that lies outside those before it.
        smallest: f64,
    },
}

impl From<FitError> for stickslip_base::Error {
    fn from(error: FitError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
