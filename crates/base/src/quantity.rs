//! Numbers for readers: with their uncertainty, their unit, a true minus and thin spaces.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

/// Text of an unknown number; never 0, never NaN.
const UNKNOWN: &str = "unknown";

/// Separator between groups of digits; narrow and non-breaking.
const THIN_SPACE: char = '\u{202f}';

/// Half of a 95 % interval in standard errors of a normal distribution.
pub const NORMAL95: f64 = 1.959_964;

const MINUS: char = '\u{2212}';

/// A measured or computed value with its unit and, if known, its uncertainty.
///
/// ```
/// use stickslip_base::quantity::Estimate;
///
/// let kinetic = Estimate::new(0.181_23, "N m").with_half_width(0.000_61);
/// assert_eq!(kinetic.to_string(), "0.1812 ± 0.0006 N·m");
/// ```
///
/// In JSON an unknown number is `null`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// In the unit below.
    #[serde(deserialize_with = "number_or_null")]
    pub value: f64,
    /// Half the width of the 95 % interval, in the unit below; `None` for an exact number.
    #[serde(default, skip_serializing_if = "Option::is_none", deserialize_with = "some_number_or_null")]
    pub half_width: Option<f64>,
    /// SI unit as in a field: `N m/rad`; `1` for a pure number.
    pub unit: String,
}

/// A quantity in three texts, for the columns of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// `0.1812`, `unknown`.
    pub value: String,
    /// `0.0006`, without the sign ±; empty if there is none.
    pub half_width: String,
    /// With its prefix: `mN·m·s/rad`; empty for a pure number.
    pub unit: String,
}

impl Estimate {
    /// A value without uncertainty.
    pub fn new(value: f64, unit: impl Into<String>) -> Self {
        Self { value, half_width: None, unit: unit.into() }
    }

    /// The same value, known within ± `half_width` (95 %).
    pub fn with_half_width(self, half_width: f64) -> Self {
        Self { half_width: Some(half_width), ..self }
    }

    /// The uncertainty to one significant digit (two if it begins with 1) and the value to the same place; four
    /// significant digits of a value without uncertainty. Small and large values take a prefix of the SI.
    pub fn written(&self) -> Written {
        self.written_beside(0.0)
    }

    /// The same with the prefix that suits `size`, the largest value of a column, where that is larger.
    pub(crate) fn written_beside(&self, size: f64) -> Written {
        if !self.value.is_finite() {
            return Written { value: UNKNOWN.into(), half_width: String::new(), unit: unit(&self.unit) };
        }
        let finite = self.half_width.filter(|half_width| half_width.is_finite() && *half_width >= 0.0);
        let (factor, unit) = scaled_unit(self.value.abs().max(finite.unwrap_or(0.0)).max(size), &self.unit);
        let place = finite.filter(|half_width| *half_width > 0.0).map(|half_width| last_place(half_width * factor));
        let value = self.value * factor;
        let place = place.unwrap_or_else(|| exponent(value) - 3);
        let half_width = match (self.half_width, finite) {
            (None, _) => String::new(),
            (Some(_), None) => UNKNOWN.into(),
            (Some(_), Some(half_width)) => to_place(half_width * factor, place),
        };
        Written { value: to_place(value, place), half_width, unit }
    }
}

/// The text of an estimate with non-breaking spaces.
pub fn tied(estimate: &Estimate) -> String {
    estimate.to_string().replace(' ', "\u{a0}")
}

fn number_or_null<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::NAN))
}

/// `null` is an unknown uncertainty, not a missing one.
fn some_number_or_null<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    number_or_null(from).map(Some)
}

impl fmt::Display for Estimate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.written().fmt(formatter)
    }
}

/// The three texts in one line.
impl fmt::Display for Written {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Written { value, half_width, unit } = self;
        formatter.write_str(value)?;
        if !half_width.is_empty() {
            write!(formatter, " ± {half_width}")?;
        }
        if !unit.is_empty() && value != UNKNOWN {
            write!(formatter, " {unit}")?;
        }
        Ok(())
    }
}

/// A number with a number of decimals, a true minus, and thin spaces between thousands from five digits on.
pub fn number(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return UNKNOWN.into();
    }
    let digits = format!("{:.decimals$}", value.abs());
    let (whole, fraction) = digits.split_at(digits.find('.').unwrap_or(digits.len()));
    let mut text = String::new();
    // A value that rounds to zero has no sign.
    if value < 0.0 && digits.bytes().any(|digit| digit.is_ascii_digit() && digit != b'0') {
        text.push(MINUS);
    }
    for (index, digit) in whole.chars().enumerate() {
        if index > 0 && whole.len() >= 5 && (whole.len() - index).is_multiple_of(3) {
            text.push(THIN_SPACE);
        }
        text.push(digit);
    }
    text + fraction
}

/// A positive number to two significant digits: for a rough value, not a result.
pub fn rough(value: f64) -> String {
    number(value, (1.0 - libm::log10(value).floor()).clamp(0.0, 12.0) as usize)
}

/// A unit as it is printed: `N m s/rad` becomes `N·m·s/rad`, `m/s^2` becomes `m/s²`, `1` nothing.
pub fn unit(field: &str) -> String {
    if field == "1" {
        return String::new();
    }
    let mut power = false;
    let printed = field.chars().filter_map(|letter| {
        let superscript = power.then(|| letter.to_digit(10)).flatten();
        power = letter == '^' || superscript.is_some();
        match (letter, superscript) {
            ('^', _) => None,
            (' ', _) => Some('·'),
            (_, Some(digit)) => "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit as usize),
            (other, None) => Some(other),
        }
    });
    printed.collect()
}

/// The factor and the unit in which a number of this size is easy to read: between 0.01 and 100 000 unchanged, else
/// with a prefix on the first unit, else with a power of ten before the unit.
fn scaled_unit(size: f64, field: &str) -> (f64, String) {
    const PREFIXED: [&str; 12] = ["m", "s", "A", "rad", "N", "V", "W", "J", "H", "Ω", "Hz", "Pa"];
    const PREFIXES: [(f64, &str); 6] = [(1e3, "m"), (1e6, "µ"), (1e9, "n"), (1e-3, "k"), (1e-6, "M"), (1e-9, "G")];
    let printed = unit(field);
    if size == 0.0 || (0.01..1e5).contains(&size) {
        return (1.0, printed);
    }
    let first = field.split([' ', '/', '(', ')']).next().unwrap_or_default();
    let prefix = PREFIXES.iter().find(|(factor, _)| (0.1..1e3).contains(&(size * factor)));
    match prefix {
        Some((factor, prefix)) if PREFIXED.contains(&first) => (*factor, format!("{prefix}{printed}")),
        _ => {
            let power = exponent(size);
            let text = format!("10^{power}").replace('-', "⁻");
            let text = format!("× {} {printed}", unit(&text.replace("^⁻", "⁻^")));
            (10f64.powi(-power), text.trim_end().into())
        }
    }
}

/// The power of ten of the last digit that an uncertainty shows.
fn last_place(half_width: f64) -> i32 {
    // Rounded first: 0.0096 reads 0.010, which begins with 1.
    let rounded = format!("{half_width:.0e}");
    exponent(half_width.max(rounded.parse().unwrap_or(half_width))) - i32::from(rounded.starts_with('1'))
}

/// The power of ten of the first digit; 0 of zero.
fn exponent(value: f64) -> i32 {
    let text = format!("{:e}", value.abs());
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// A number rounded to a power of ten.
fn to_place(value: f64, place: i32) -> String {
    if place <= 0 {
        return number(value, place.unsigned_abs() as usize);
    }
    let unit = 10f64.powi(place);
    number((value / unit).round() * unit, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64, half_width: f64, unit: &str) -> String {
        Estimate::new(value, unit).with_half_width(half_width).to_string()
    }

    #[test]
    fn an_uncertainty_has_one_digit_or_two_that_begin_with_1() {
        assert_eq!(estimate(0.181_23, 0.000_61, "N m"), "0.1812 ± 0.0006 N·m");
        assert_eq!(estimate(2.941, 0.112, "rad/s"), "2.94 ± 0.11 rad/s");
        assert_eq!(estimate(0.299_4, 0.009_6, "N m"), "0.299 ± 0.010 N·m");
        assert_eq!(estimate(0.299_4, 0.019_6, "N m"), "0.30 ± 0.02 N·m");
        assert_eq!(estimate(12_345.6, 120.0, "counts"), "12\u{202f}350 ± 120 counts");
        assert_eq!(estimate(1.5, 0.0, "1"), "1.500 ± 0.000");
    }

    #[test]
    fn a_value_without_uncertainty_has_four_digits() {
        for (value, text) in
            [(0.181_234, "0.1812"), (12.345_6, "12.35"), (1234.56, "1235"), (-3.0, "−3.000"), (0.0, "0.000")]
        {
            assert_eq!(Estimate::new(value, "1").to_string(), text);
        }
    }

    #[test]
    fn small_and_large_values_take_a_prefix_or_a_power() {
        assert_eq!(estimate(0.000_206, 0.000_007, "N m s/rad"), "0.206 ± 0.007 mN·m·s/rad");
        assert_eq!(Estimate::new(-8.2e-7, "m").to_string(), "−0.8200 µm");
        assert_eq!(Estimate::new(2.53e-4, "kg m^2").to_string(), "2.530 × 10⁻⁴ kg·m²");
        assert_eq!(Estimate::new(3.2e7, "1").to_string(), "3.200 × 10⁷");
        assert_eq!(estimate(1e-6, 0.004, "N m"), "0 ± 4 mN·m");
    }

    #[test]
    fn a_column_has_one_prefix_that_of_its_largest_value() {
        let small = Estimate::new(0.005_112, "m/s");
        assert_eq!(small.written().unit, "mm/s");
        let Written { value, unit, .. } = small.written_beside(0.128);
        assert_eq!((value.as_str(), unit.as_str()), ("0.005112", "m/s"));
    }

    #[test]
    fn unknown_numbers_are_printed_as_unknown() {
        assert_eq!(Estimate::new(f64::NAN, "N m").to_string(), "unknown");
        assert_eq!(estimate(0.3, f64::INFINITY, "N m"), "0.3000 ± unknown N·m");
        assert_eq!(estimate(0.3, -0.1, "N m"), "0.3000 ± unknown N·m");
        assert_eq!(number(f64::INFINITY, 2), "unknown");
    }

    #[test]
    fn numbers_have_a_true_minus_and_thin_spaces_from_five_digits_on() {
        assert_eq!(number(-1234.5, 1), "−1234.5");
        assert_eq!(number(1_234_567.0, 0), "1\u{202f}234\u{202f}567");
        assert_eq!(number(-0.04, 1), "0.0");
        assert_eq!(number(-0.06, 1), "−0.1");
    }

    #[test]
    fn units_are_printed_with_dots_and_powers() {
        for (field, printed) in
            [("N m s/rad", "N·m·s/rad"), ("V/(m/s^2)", "V/(m/s²)"), ("1/s", "1/s"), ("1", ""), ("m^12", "m¹²")]
        {
            assert_eq!(unit(field), printed);
        }
    }
}
