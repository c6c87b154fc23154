//! Errors of a fit.

/// A failure of a fit, besides the common ones.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// A motion that does not determine the parameters.
    #[error(
        "the motion does not determine the parameters: the independent share of one is {smallest:.3e}, at least 1e-9 is \
         required. Record several speeds and accelerations in both directions."
    )]
    Dependent {
        /// Share of a column that is independent of those before it.
        smallest: f64,
    },
}

impl From<FitError> for stickslip_base::Error {
    fn from(error: FitError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
