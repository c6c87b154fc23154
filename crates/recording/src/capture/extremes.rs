//! Extremes of the samples of a signal that share a pixel.

/// Minimum and maximum of some samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extremes {
    /// The minimum; NaN without numbers.
    pub min: f64,
    /// The maximum; NaN without numbers.
    pub max: f64,
    /// Whether a sample is NaN; minimum and maximum are those of the other samples.
    pub nan: bool,
}

impl Extremes {
    /// Extremes without samples.
    pub const NONE: Extremes = Extremes { min: f64::NAN, max: f64::NAN, nan: false };

    /// Adds a sample.
    #[inline]
    pub fn include(&mut self, value: f64) {
        self.merge(Extremes { min: value, max: value, nan: value.is_nan() });
    }

    /// Adds the samples of other extremes.
    #[inline]
    pub fn merge(&mut self, other: Extremes) {
        // Written so that a number replaces a NaN, and a NaN replaces nothing.
        self.min = if self.min <= other.min || other.min.is_nan() { self.min } else { other.min };
        self.max = if self.max >= other.max || other.max.is_nan() { self.max } else { other.max };
        self.nan |= other.nan;
    }
}
