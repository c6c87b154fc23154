//! Axes: range, stretch, ticks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::legend::text_width;
use crate::quantity;

/// Size of the labels [px].
pub(super) const LABEL: f64 = 11.5;

/// A stretched axis is nearly linear up to this value [rad/s]; the Stribeck drop is below it.
const LINEAR_PART: f64 = 2.0;

/// Values closer than this are equal: their labels would not differ.
const LEAST_SPAN: f64 = 1e-9;

/// Quantity, unit and scale of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Axis {
    /// The quantity.
    pub(crate) quantity: String,
    /// Unit, as in a field.
    pub(crate) unit: String,
    /// asinh(x/2) instead of x.
    #[serde(default)]
    stretched: bool,
    /// ln x instead of x.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    logarithmic: bool,
    /// Fixed range instead of that of the data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    range: Option<(f64, f64)>,
}

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

impl Axis {
    /// An axis for a quantity ("speed Ω") in a unit as in a field ("rad/s").
    pub fn new(quantity: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { quantity: quantity.into(), unit: unit.into(), stretched: false, logarithmic: false, range: None }
    }

    /// Quantity and printed unit apart, empty for a pure number.
    pub(crate) fn head(&self) -> [String; 2] {
        [self.quantity.clone(), quantity::unit(&self.unit)]
    }

    /// Stretched around zero, asinh(x/2): linear within ± 2 (rad/s), logarithmic beyond.
    pub fn stretched(self) -> Self {
        Self { stretched: true, logarithmic: false, ..self }
    }

    /// Evenly in the logarithm, for values above 0; others are not drawn.
    pub fn logarithmic(self) -> Self {
        Self { stretched: false, logarithmic: true, ..self }
    }

    /// Fixed range from `low` to `high`; ignored unless `low < high`, both finite.
    pub fn range(self, low: f64, high: f64) -> Self {
        Self { range: Some((low, high)).filter(sensible), ..self }
    }

    /// "speed Ω, rad/s"; of a pure number the quantity alone.
    pub(super) fn title(&self) -> String {
        match self.unit().as_str() {
            "" => self.quantity.clone(),
            unit => format!("{}, {unit}", self.quantity),
        }
    }

    pub(super) fn unit(&self) -> String {
        quantity::unit(&self.unit)
    }

    /// The scale over these values, from pixel `start` to pixel `end`, with a margin of 5 % unless the range is fixed.
    pub(super) fn scale(&self, values: impl Iterator<Item = f64>, start: f64, end: f64) -> Scale {
        let shape = self.shape();
        let fixed = self.range.filter(sensible).map(|(low, high)| (shape.place(low), shape.place(high)));
        let (low, high) = match fixed.filter(sensible) {
            Some(ends) => ends,
            None => {
                let places = values.map(|value| shape.place(value)).filter(|place| place.is_finite());
                let (low, high) = places
                    .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| (low.min(place), high.max(place)));
                match high - low {
                    span if span > LEAST_SPAN => (low - 0.05 * span, high + 0.05 * span),
                    // For one value or none, a range around it.
                    span if span >= 0.0 => {
                        (low - 0.5 * low.abs().max(LEAST_SPAN), high + 0.5 * high.abs().max(LEAST_SPAN))
                    }
                    _ => (0.0, 1.0),
                }
            }
        };
        Scale { shape, low, high, start, end }
    }

    fn shape(&self) -> Shape {
        match (self.stretched, self.logarithmic) {
            (false, false) => Shape::Linear,
            (true, _) => Shape::Stretched,
            (false, true) => Shape::Logarithmic,
        }
    }
}

/// The function of a value that is linear along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Linear,
    Stretched,
    Logarithmic,
}

impl Shape {
    /// Not finite for a value outside the domain.
    fn place(self, value: f64) -> f64 {
        match self {
            Shape::Linear => value,
            Shape::Stretched => libm::asinh(value / LINEAR_PART),
            Shape::Logarithmic => libm::log(value),
        }
    }

    fn value(self, place: f64) -> f64 {
        match self {
            Shape::Linear => place,
            Shape::Stretched => LINEAR_PART * libm::sinh(place),
            Shape::Logarithmic => libm::exp(place),
        }
    }
}

fn sensible(&(low, high): &(f64, f64)) -> bool {
    low < high && low.is_finite() && high.is_finite()
}

/// From values to pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    shape: Shape,
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl Scale {
    /// Position of a value [px].
    pub(super) fn place(&self, value: f64) -> f64 {
        self.start + (self.shape.place(value) - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// The values at both ends.
    pub(super) fn ends(&self) -> (f64, f64) {
        (self.shape.value(self.low), self.shape.value(self.high))
    }

    /// Whether a value is between the ends.
    pub(super) fn holds(&self, value: f64) -> bool {
        let (low, high) = self.ends();
        low <= value && value <= high
    }

    /// The largest number of [`ticks`](Self::ticks) whose labels do not overlap side by side.
    pub(super) fn columns(&self) -> Vec<Tick> {
        let clear = |pair: &[Tick]| {
            let half_widths: f64 = pair.iter().map(|tick| 0.5 * text_width(&tick.label, LABEL)).sum();
            self.place(pair[1].value) - self.place(pair[0].value) >= half_widths + 0.5 * LABEL
        };
        // At 240 px there are three labels, which always have room.
        let mut denser_first = (5..=48).map(|gap| self.ticks(5.0 * f64::from(gap)));
        denser_first.find(|ticks| ticks.windows(2).all(clear)).unwrap_or_default()
    }

    /// Marks at 1, 2, 5 times powers of ten, at least `gap` pixels apart.
    pub(super) fn ticks(&self, gap: f64) -> Vec<Tick> {
        match self.shape {
            Shape::Linear => self.linear_ticks(gap),
            Shape::Stretched => self.stretched_ticks(gap),
            Shape::Logarithmic => self.logarithmic_ticks(gap),
        }
    }

    /// At 1, 2, 5 of each decade where there is room, else at every decade, or at every n-th decade.
    fn logarithmic_ticks(&self, gap: f64) -> Vec<Tick> {
        let (low, high) = self.ends();
        let decade = (self.end - self.start).abs() / (self.high - self.low) * core::f64::consts::LN_10;
        let every = if libm::log10(2.0) * decade >= gap { 0 } else { (gap / decade).ceil().max(1.0) as i32 };
        // A tick at the end of an axis may be outside it by a rounding error.
        let within = |value: f64| low * (1.0 - 1e-9) <= value && value <= high * (1.0 + 1e-9);
        steps(low)
            .take_while(|&(_, value)| value <= high * (1.0 + 1e-9))
            .filter(|&(power, value)| {
                let is_decade = (value.log10() - f64::from(power)).abs() < 0.1;
                within(value) && (every == 0 || is_decade && power % every == 0)
            })
            .map(|(power, value)| Tick {
                value,
                label: quantity::number(value, (-power).max(0).unsigned_abs() as usize),
            })
            .collect()
    }

    fn linear_ticks(&self, gap: f64) -> Vec<Tick> {
        let pixels = (self.end - self.start).abs() / (self.high - self.low);
        let within = |step: f64| (self.low / step).ceil() as i64..=(self.high / step).floor() as i64;
        let (power, step) = steps((self.high - self.low) / 10.0)
            .find(|&(_, step)| step * pixels >= gap && within(step).count() <= 9)
            .expect("a large enough step has few enough ticks");
        let decimals = (-power).max(0).unsigned_abs() as usize;
        within(step)
            .map(|index| {
                let value = index as f64 * step;
                Tick { value, label: quantity::number(value, decimals) }
            })
            .collect()
    }

    fn stretched_ticks(&self, gap: f64) -> Vec<Tick> {
        let (low, high) = self.ends();
        let mut ticks = Vec::new();
        let tick = |value: f64, power: i32| Tick {
            value,
            label: quantity::number(value, (-power).max(0).unsigned_abs() as usize),
        };
        if self.holds(0.0) {
            ticks.push(tick(0.0, 0));
        }
        // From zero outwards, so that both sides have the same marks.
        for sign in [-1.0, 1.0] {
            let mut nearest = self.place(0.0);
            let largest = low.abs().max(high.abs());
            for (power, size) in steps((0.01 * largest).min(1e-3)).take_while(|&(_, size)| size <= largest) {
                let value = sign * size;
                let place = self.place(value);
                if self.holds(value) && (place - nearest).abs() >= gap {
                    ticks.push(tick(value, power));
                    nearest = place;
                }
            }
        }
        ticks.sort_by(|one, other| one.value.total_cmp(&other.value));
        ticks
    }
}

/// 1, 2, 5 times powers of ten, from `least` up, with the exponent.
fn steps(least: f64) -> impl Iterator<Item = (i32, f64)> {
    let power = libm::log10(least).floor() as i32;
    let step =
        |power: i32, factor: f64| if power < 0 { factor / 10f64.powi(-power) } else { factor * 10f64.powi(power) };
    (power..=308)
        .flat_map(move |power| [1.0, 2.0, 5.0].map(|factor| (power, step(power, factor))))
        // Rounding must not make 0.2 too small a step for 0.2.
        .skip_while(move |&(_, size)| size < least * (1.0 - 1e-9))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, low: f64, high: f64, pixels: f64, gap: f64) -> Vec<String> {
        let scale = axis.clone().range(low, high).scale(std::iter::empty(), 0.0, pixels);
        scale.ticks(gap).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_share_their_decimals() {
        let axis = Axis::new("torque", "N m");
        assert_eq!(labels(&axis, -0.31, 0.33, 360.0, 40.0), ["−0.3", "−0.2", "−0.1", "0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(
            labels(&axis, 0.0, 1e-4, 360.0, 40.0),
            ["0.00000", "0.00002", "0.00004", "0.00006", "0.00008", "0.00010"]
        );
        assert_eq!(labels(&axis, 0.0, 45e3, 700.0, 60.0).last().map(String::as_str), Some("40\u{202f}000"));
    }

    #[test]
    fn there_are_three_to_nine_linear_ticks_for_any_span() {
        let axis = Axis::new("time", "s");
        for index in 1..1000 {
            let span = 1.03f64.powi(index) * 1e-6;
            for low in [0.0, -0.37 * span, 0.11 * span] {
                let count = labels(&axis, low, low + span, 332.0, 32.0).len();
                assert!((3..=9).contains(&count), "{count} ticks from {low} over {span}");
            }
        }
    }

    #[test]
    fn labels_side_by_side_do_not_touch_however_long_they_are() {
        for (axis, low, high) in [
            (Axis::new("speed", "rad/s").stretched(), -80.0, 80.0),
            (Axis::new("velocity", "m/s").stretched(), -1e-3, 1e-3),
            (Axis::new("time", "s"), 0.0, 1.2e-4),
            (Axis::new("time", "s"), 100_000.0, 100_000.9),
        ] {
            let scale = axis.range(low, high).scale(std::iter::empty(), 72.0, 744.0);
            let ticks = scale.columns();
            assert!(ticks.len() >= 4, "{ticks:?}");
            for pair in ticks.windows(2) {
                let half_widths: f64 = pair.iter().map(|tick| 0.5 * text_width(&tick.label, LABEL)).sum();
                assert!(scale.place(pair[0].value) + half_widths < scale.place(pair[1].value), "{pair:?}");
            }
        }
    }

    #[test]
    fn a_logarithmic_axis_has_ticks_at_decades_or_within_them() {
        let axis = Axis::new("stiffness", "N m/rad").logarithmic();
        assert_eq!(labels(&axis, 0.1, 10.0, 660.0, 40.0), ["0.1", "0.2", "0.5", "1", "2", "5", "10"]);
        assert_eq!(labels(&axis, 3e-3, 2e3, 332.0, 40.0), ["0.01", "0.1", "1", "10", "100", "1000"]);
        assert_eq!(
            labels(&axis, 1e-6, 1e6, 332.0, 50.0),
            ["0.000001", "0.0001", "0.01", "1", "100", "10\u{202f}000", "1\u{202f}000\u{202f}000"]
        );
        // Values without a logarithm are not drawn and do not affect others; a range without a logarithm is ignored.
        let scale = axis.clone().range(-1.0, 1.0).scale([0.0, -3.0, 1.0, 100.0].into_iter(), 0.0, 110.0);
        assert!((scale.place(10.0) - 55.0).abs() < 1e-9 && !scale.place(0.0).is_finite());
    }

    #[test]
    fn a_stretched_axis_has_ticks_from_the_stribeck_drop_to_the_limit() {
        let axis = Axis::new("speed", "rad/s").stretched();
        let expected = ["−100", "−50", "−20", "−10", "−5", "−2", "−1", "0", "1", "2", "5", "10", "20", "50", "100"];
        assert_eq!(labels(&axis, -150.0, 150.0, 660.0, 25.0), expected);
        assert_eq!(labels(&axis, 0.0, 50.0, 660.0, 25.0), ["0", "0.5", "1", "2", "5", "10", "20", "50"]);
    }

    #[test]
    fn a_stretched_axis_is_linear_around_zero_and_logarithmic_far_out() {
        let scale =
            Axis::new("speed", "rad/s").stretched().range(-1000.0, 1000.0).scale(std::iter::empty(), 0.0, 1000.0);
        let near = scale.place(0.2) - scale.place(0.1);
        let nearer = scale.place(0.1) - scale.place(0.0);
        // asinh bends by its third-order term: (0.2/2)²/2.
        assert!((near / nearer - 1.0).abs() < 5e-3, "{near} {nearer}");
        let decade = scale.place(1000.0) - scale.place(100.0);
        let decade_before = scale.place(500.0) - scale.place(50.0);
        assert!((decade / decade_before - 1.0).abs() < 1e-3, "{decade} {decade_before}");
    }

    #[test]
    fn data_has_a_margin_of_5_percent_and_odd_data_gives_a_scale() {
        let axis = Axis::new("torque", "N m");
        let (low, high) = axis.scale([0.0, 10.0].into_iter(), 0.0, 100.0).ends();
        assert_eq!((low, high), (-0.5, 10.5));
        for values in [vec![], vec![0.0], vec![3.0], vec![-3.0, -3.0]] {
            let (low, high) = axis.scale(values.clone().into_iter(), 0.0, 100.0).ends();
            assert!(low < high && low.is_finite() && high.is_finite(), "{values:?}");
        }
    }

    #[test]
    fn an_invalid_range_is_ignored() {
        for (low, high) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            let scale = Axis::new("torque", "N m").range(low, high).scale([0.0, 10.0].into_iter(), 0.0, 100.0);
            assert_eq!(scale.ends(), (-0.5, 10.5));
        }
    }

    #[test]
    fn a_title_has_its_unit_and_a_pure_number_none() {
        assert_eq!(Axis::new("friction torque", "N m").title(), "friction torque, N·m");
        assert_eq!(Axis::new("ratio", "1").title(), "ratio");
    }
}
