//! Decimal numbers of more digits than `f64` holds, as exact differences from an origin.

/// Digits behind the point of a fixed-point number.
const PLACES: usize = 12;
const ONE: i128 = 10_i128.pow(PLACES as u32);
/// Any decimal number with this number of digits is exact to its last digit.
const DIGITS: usize = 15;
/// Smaller numbers are not stamps.
const LEAST: i128 = 1_000_000_000;

/// A decimal number of many digits that is large enough for a stamp, as `f64` and rest.
pub(super) fn origin(cell: &str) -> Option<i128> {
    if cell.len() <= DIGITS {
        return None;
    }
    let digits = cell.bytes().filter(u8::is_ascii_digit).count();
    let number = fixed(cell).filter(|number| digits > DIGITS && number.abs() >= LEAST * ONE)?;
    Some(whole(number))
}

/// A whole number close to this one that is an `f64`, so that origin and difference add up exactly.
pub(super) fn whole(number: i128) -> i128 {
    (number / ONE) as f64 as i128 * ONE
}

/// A decimal number without exponent and with at most twelve decimals.
pub(super) fn fixed(cell: &str) -> Option<i128> {
    let (negative, digits) = match cell.as_bytes().first()? {
        b'-' => (true, &cell[1..]),
        b'+' => (false, &cell[1..]),
        _ => (false, cell),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || whole.len() > 22 || fraction.len() > PLACES || !is_number(whole) || !is_number(fraction) {
        return None;
    }
    let fraction = format!("{fraction:0<PLACES$}");
    let number = whole.parse::<i128>().ok()?.checked_mul(ONE)?.checked_add(fraction.parse().ok()?)?;
    Some(if negative { -number } else { number })
}

/// The difference of two fixed-point numbers.
pub(super) fn difference(number: i128, origin: i128) -> f64 {
    let difference = number - origin;
    (difference / ONE) as f64 + (difference % ONE) as f64 / ONE as f64
}

/// The nearest `f64`.
pub(super) fn value(number: i128) -> f64 {
    difference(number, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_of_nineteen_digits_differ_exactly() {
        for (first, second, step) in [
            ("1709632360004000000", "1709632360004250001", 250_001.0),
            ("133546915600040000", "133546915600050000", 10_000.0),
            ("1709632360.004000000", "1709632360.004250000", 250e-6),
        ] {
            let origin = origin(first).unwrap();
            let at = |cell: &str| difference(fixed(cell).unwrap(), origin);
            assert!((at(second) - at(first) - step).abs() < 1e-15 * step.max(1.0), "{first}");
            assert_eq!(value(origin).fract(), 0.0);
        }
        for usual in ["0.12345678901234567", "1709632360.5", "12", "-7e3", "", "1.2.3", "abc456789012345678"] {
            assert_eq!(origin(usual), None, "{usual}");
        }
    }
}
