//! Numbers in messages and in files; both read back to the same bits.

use stickslip_core::fields::{Field, Kind};

/// The shortest text that reads back to the same number: `-2`, `0.3`, `1e-4`, `∞`.
pub fn text(value: f64) -> String {
    let size = value.abs();
    if size == f64::INFINITY {
        if value > 0.0 { "∞".into() } else { "-∞".into() }
    } else if size == 0.0 || (1e-3..1e6).contains(&size) || value.is_nan() {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

/// As [`text`], rounded to a number of significant digits.
pub fn rounded(value: f64, digits: usize) -> String {
    // A number in scientific notation always parses; a non-finite number prints as itself.
    text(format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value))
}

/// With the unit behind it; a pure number has none.
pub(crate) fn with_unit(value: f64, unit: &str) -> String {
    if unit.is_empty() || unit == "1" { text(value) } else { format!("{} {unit}", text(value)) }
}

/// The value of a field for readers: `true`, `2500 lines`, `4.1e-4 kg m^2`.
pub(crate) fn of_field(value: f64, field: &Field) -> String {
    match flag(value, field) {
        Some(flag) => flag.to_string(),
        None => with_unit(value, field.unit),
    }
}

/// The value of a field in TOML.
pub fn toml(value: f64, field: &Field) -> String {
    if let Some(flag) = flag(value, field) {
        return flag.to_string();
    }
    let text = if value.is_infinite() { format!("{value}") } else { text(value) };
    let negative_zero = value == 0.0 && value.is_sign_negative();
    let integer_will_do = field.kind == Kind::Whole && !negative_zero;
    if integer_will_do || value.is_nan() || value.is_infinite() || text.contains(['.', 'e']) {
        text
    } else {
        format!("{text}.0")
    }
}

/// The range of a field for readers: `1e-6 … 200 N m`.
pub(crate) fn range(minimum: f64, maximum: f64, unit: &str) -> String {
    format!("{} … {}", text(minimum), with_unit(maximum, unit))
}

fn flag(value: f64, field: &Field) -> Option<bool> {
    match value {
        _ if field.kind != Kind::Flag => None,
        0.0 => Some(false),
        1.0 => Some(true),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let pairs = [(1e-4, "1e-4"), (-2.0, "-2"), (1000.0, "1000"), (0.3, "0.3"), (1e7, "1e7"), (f64::INFINITY, "∞")];
        for (value, expected) in pairs {
            assert_eq!(text(value), expected);
        }
        assert_eq!(rounded(0.000_412_345_678, 4), "4.123e-4");
        assert_eq!(rounded(2.0 / 3.0, 3), "0.667");
        assert_eq!(rounded(f64::NAN, 3), "NaN");
    }
}
