//! What is left of many samples of a signal when they share a pixel.

/// The least and the greatest of some samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes {
    /// The least number among them; NaN if there is none.
    pub min: f64,
    /// The greatest number among them; NaN if there is none.
    pub max: f64,
    /// Whether there is a NaN among them: it neither hides the numbers nor is hidden by them.
    pub nan: bool,
}

impl Extremes {
    /// Of no sample.
    pub const NONE: Extremes = Extremes { min: f64::NAN, max: f64::NAN, nan: false };

    /// Takes a sample in.
    #[inline]
    pub fn include(&mut self, value: f64) {
        self.merge(Extremes { min: value, max: value, nan: value.is_nan() });
    }

    /// Takes other samples in.
    #[inline]
    pub fn merge(&mut self, other: Extremes) {
        // Written so that a number replaces a NaN, and a NaN replaces nothing.
        self.min = if self.min <= other.min || other.min.is_nan() { self.min } else { other.min };
        self.max = if self.max >= other.max || other.max.is_nan() { self.max } else { other.max };
        self.nan |= other.nan;
    }
}
