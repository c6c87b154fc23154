//! Inputs of a block without a recording: each within its range, or of a size typical for its unit.

use stickslip_core::fields::{Field, Kind};

/// The span of an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
    /// Whether only whole numbers are valid.
    pub(super) whole: bool,
}

/// The span of an input.
pub(super) fn span(field: &Field) -> Span {
    let size = match field.unit {
        "rad/s" => 10.0,
        "rad/s^2" | "counts" => 1000.0,
        "N m" => 0.5,
        "V" | "A" | "m/s^2" => 5.0,
        _ => 1.0,
    };
    let (low, high) = (field.minimum.max(-size), field.maximum.min(size));
    Span { low, high, whole: field.kind != Kind::Real || field.unit == "counts" }
}

impl Span {
    /// From `low` at −1 to `high` at 1.
    pub(super) fn at(self, position: f64) -> f64 {
        let value = 0.5 * (self.low + self.high) + 0.5 * (self.high - self.low) * position;
        if self.whole { value.round() } else { value }
    }
}

/// Steps in a period of an input; different for all inputs.
pub(super) fn period(input: usize) -> u32 {
    [100, 74, 58, 46, 34, 26, 22][input % 7]
}

/// A triangle wave between −1 and 1 that starts at 0 and rises.
pub(super) fn triangle(step: u32, period: u32) -> f64 {
    let quarters = 4.0 * f64::from(step % period) / f64::from(period);
    if quarters <= 1.0 {
        quarters
    } else if quarters <= 3.0 {
        2.0 - quarters
    } else {
        quarters - 4.0
    }
}

/// Evenly spread between −1 and 1 without a period: multiples of an irrational number.
pub(super) fn spread(step: u32, input: usize) -> f64 {
    let golden = 0.618_033_988_749_894_9;
    2.0 * (golden * (f64::from(step) + 1.0) + 0.414_213_562_373_095_1 * input as f64).fract() - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_stay_within_their_span() {
        let span = Span { low: -2.0, high: 6.0, whole: false };
        let waves = (0..300).flat_map(|step| [span.at(triangle(step, period(1))), span.at(spread(step, 3))]);
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in waves {
            (least, most) = (least.min(value), most.max(value));
        }
        assert!((-2.0..-1.8).contains(&least) && most > 5.8 && most <= 6.0, "{least} {most}");
        assert_eq!(Span { low: 0.0, high: 1.0, whole: true }.at(0.3), 1.0);
    }
}
