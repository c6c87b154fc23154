//! What only a sweep can fail of.

/// A failure of a sweep, beside those that every crate has.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A variant of a sweep that even the finest steps do not resolve.
    #[error(
        "variant {index}: the finest steps still differ by an estimated {error:.1e} of the angle, above the tolerance of \
         {tolerance:e}. Its motion depends on the smallest causes, or runs away: ask for less, or for a shorter time."
    )]
    Unresolved {
        /// Which variant, from 0.
        index: usize,
        /// Estimated error over the largest angle.
        error: f64,
        /// Asked for.
        tolerance: f64,
    },
}

impl From<SweepError> for stickslip_base::Error {
    fn from(error: SweepError) -> Self {
        stickslip_base::Error::Of(Box::new(error))
    }
}
