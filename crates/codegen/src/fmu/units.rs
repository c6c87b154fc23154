//! Units of the fields in FMI: a name, and its exponents over the base units of the SI.

/// Base units in the order of the attributes of `BaseUnit`, with their names there.
pub(super) const BASES: [&str; 6] = ["kg", "m", "s", "A", "K", "rad"];

/// The words of units as exponents over [`BASES`].
const WORDS: [(&str, [i32; 6]); 14] = [
    ("kg", [1, 0, 0, 0, 0, 0]),
    ("m", [0, 1, 0, 0, 0, 0]),
    ("s", [0, 0, 1, 0, 0, 0]),
    ("A", [0, 0, 0, 1, 0, 0]),
    ("K", [0, 0, 0, 0, 1, 0]),
    ("rad", [0, 0, 0, 0, 0, 1]),
    ("N", [1, 1, -2, 0, 0, 0]),
    ("W", [1, 2, -3, 0, 0, 0]),
    ("J", [1, 2, -2, 0, 0, 0]),
    ("V", [1, 2, -3, -1, 0, 0]),
    ("Ω", [1, 2, -3, -2, 0, 0]),
    ("H", [1, 2, -2, -2, 0, 0]),
    ("Hz", [0, 0, -1, 0, 0, 0]),
    ("1", [0, 0, 0, 0, 0, 0]),
];

/// The name of a unit: `N.m/rad` of `N m/rad`; `None` of a pure number.
pub(super) fn name(unit: &str) -> Option<String> {
    (!unit.is_empty() && unit != "1").then(|| unit.replace(' ', ".").replace('^', ""))
}

/// Exponents over [`BASES`]; `None` if it is not a product of powers of the words above, such as `counts` or `√Hz`.
pub(super) fn exponents(unit: &str) -> Option<[i32; 6]> {
    let mut all = [0; 6];
    let (mut remainder, mut sign) = (unit, 1);
    // A slash divides by the single factor after it: a word or a bracket.
    while !remainder.is_empty() {
        let (factor, after) = if let Some(inner) = remainder.strip_prefix('(') {
            let (inner, after) = inner.split_at(closing(inner)?);
            (exponents(inner)?, &after[1..])
        } else {
            let (word, after) = remainder.split_at(remainder.find([' ', '/']).unwrap_or(remainder.len()));
            (power(word)?, after)
        };
        all.iter_mut().zip(factor).for_each(|(sum, exponent)| *sum += sign * exponent);
        sign = if after.starts_with('/') { -1 } else { 1 };
        remainder = after.get(1..).unwrap_or_default();
    }
    Some(all)
}

/// Position of the closing bracket of the one that was opened before the text.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 1;
    text.find(|letter| {
        depth += i32::from(letter == '(') - i32::from(letter == ')');
        depth == 0
    })
}

/// `s^2`.
fn power(word: &str) -> Option<[i32; 6]> {
    let (word, power) = word.split_once('^').unwrap_or((word, "1"));
    let (_, exponents) = WORDS.iter().find(|(name, _)| *name == word)?;
    let power: i32 = power.parse().ok()?;
    Some(exponents.map(|exponent| power * exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_products_of_base_units() {
        assert_eq!(exponents("N m s/rad"), Some([1, 2, -1, 0, 0, -1]));
        assert_eq!(exponents("1/(N m)"), Some([-1, -2, 2, 0, 0, 0]));
        assert_eq!(exponents("V/A"), exponents("Ω"));
        assert_eq!(exponents("kg m^2"), Some([1, 2, 0, 0, 0, 0]));
        assert_eq!(exponents("V/(m/s^2)"), Some([1, 1, -1, -1, 0, 0]));
        assert_eq!(exponents("m/(s^2 rad)"), Some([0, 1, -2, 0, 0, -1]));
        assert_eq!((exponents("√Hz"), exponents("counts")), (None, None));
        assert_eq!((name("N m/rad"), name("m/s^2"), name("1")), (Some("N.m/rad".into()), Some("m/s2".into()), None));
    }
}
