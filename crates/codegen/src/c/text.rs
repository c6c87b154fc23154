//! Words, literals and lines of C.

use crate::record::Real;

/// Longest line, as far as lines can be broken.
pub(super) const WIDTH: usize = 110;

/// Reserved words of C, and names that the code uses.
const KEYWORDS: [&str; 46] = [
    "auto", "bool", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern",
    "fabs", "fabsf", "false", "float", "for", "goto", "if", "in", "inline", "int", "isfinite", "isnan", "long", "main",
    "out", "p", "register", "restrict", "return", "s", "short", "signed", "sizeof", "static", "struct", "switch",
    "true", "typedef", "union", "unsigned", "void", "volatile", "while",
];

/// Whether it is a valid name in C.
pub(super) fn is_identifier(text: &str) -> bool {
    let mut characters = text.chars();
    characters.next().is_some_and(|c| c.is_ascii_alphabetic())
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !KEYWORDS.contains(&text)
}

/// A field's name as a valid name in C.
pub(super) fn identifier(name: &str) -> String {
    if KEYWORDS.contains(&name) { format!("{name}_") } else { name.replace('-', "_") }
}

/// `friction.elements[2].default` with each name valid in C.
pub(crate) fn path(path: &str) -> String {
    let segment = |text: &str| {
        let end = text.find('[').unwrap_or(text.len());
        format!("{}{}", identifier(&text[..end]), &text[end..])
    };
    path.split('.').map(segment).collect::<Vec<_>>().join(".")
}

/// `ElastoPlastic` → `elasto_plastic`, `LuGre` → `lugre`: a capital begins a word after three or more letters.
pub(super) fn snake(name: &str) -> String {
    let mut out = String::new();
    let mut run = 0;
    for c in name.chars() {
        if c.is_uppercase() && run > 2 {
            out.push('_');
            run = 0;
        }
        run += 1;
        out.extend(c.to_lowercase());
    }
    out
}

/// A constant. Reads back to the same bits.
pub(crate) fn literal(real: Real, value: f64) -> String {
    if value.is_nan() {
        "NAN".into()
    } else if value.is_infinite() {
        if value > 0.0 { "INFINITY".into() } else { "-INFINITY".into() }
    } else {
        format!("{}{}", shorter((real.text)(value)), real.c_suffix)
    }
}

/// A number for readers: `1e12` and `2e-5`, but `1000` and `0.001`.
pub(super) fn number(value: f64) -> String {
    shorter(format!("{value}"))
}

/// In powers of ten if that is clearly shorter.
fn shorter(plain: String) -> String {
    let scientific = plain.parse().map(|decimal: f64| format!("{decimal:e}"));
    scientific.ok().filter(|text| text.len() + 2 < plain.len()).unwrap_or(plain)
}

/// A statement, broken at the lowest nesting until the lines fit.
pub(super) fn wrap(indent: &str, statement: &str) -> String {
    let mut out = String::new();
    let mut remainder = statement;
    let mut margin = indent.to_string();
    while margin.len() + remainder.len() > WIDTH {
        // Without a possible break within the width, the first one after it.
        let position = (WIDTH - margin.len()..=remainder.len()).find_map(|width| break_before(remainder, width));
        let Some(at) = position else { break };
        out.push_str(&format!("{margin}{}\n", &remainder[..at]));
        remainder = &remainder[at + 1..];
        margin = format!("{indent}    ");
    }
    format!("{out}{margin}{remainder}\n")
}

/// The space before an operator or behind a comma, within the width, with the fewest open parentheses; preferably not
/// near the start, never within a string.
fn break_before(text: &str, width: usize) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut depth = 0;
    let mut quoted = false;
    let mut best: Option<(bool, i32, usize)> = None;
    for i in 0..bytes.len().min(width) {
        match bytes[i] {
            b'"' => quoted = !quoted,
            b'(' | b'{' => depth += 1,
            b')' | b'}' => depth -= 1,
            b' ' if i > 0 && !quoted => {
                let one = bytes.get(i + 2) == Some(&b' ') && bytes.get(i + 1).is_some_and(|c| b"?:+-*/".contains(c));
                let allowed = one || bytes[i..].starts_with(b" && ") || bytes[i - 1] == b',' || bytes[i - 1] == b'"';
                let early = i <= width / 3;
                if allowed && best.is_none_or(|(e, d, _)| (early, depth) <= (e, d)) {
                    best = Some((early, depth, i));
                }
            }
            _ => {}
        }
    }
    best.map(|(_, _, at)| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reserved_words_of_c_are_changed() {
        assert_eq!(path("a.default.in[2].b"), "a.default_.in_[2].b");
        assert!(is_identifier("tick") && !is_identifier("double") && !is_identifier("2x") && !is_identifier("a-b"));
        assert_eq!(
            (snake("LuGre"), snake("ElastoPlastic"), snake("PI")),
            ("lugre".into(), "elasto_plastic".into(), "pi".into())
        );
    }

    #[test]
    fn literals_read_back_to_the_same_number() {
        assert_eq!(literal(Real::DOUBLE, 0.1), "0.1");
        assert_eq!(literal(Real::of::<f32>(), f64::from(0.1f32)), "0.1f");
        assert_eq!(literal(Real::DOUBLE, 1e300), "1e300");
        assert_eq!(literal(Real::of::<f32>(), 1e12), "1e12f");
        assert_eq!(literal(Real::DOUBLE, -0.0), "-0.0");
        assert_eq!(literal(Real::DOUBLE, f64::NEG_INFINITY), "-INFINITY");
        assert_eq!(literal(Real::of::<f32>(), 3.0), "3.0f");
    }

    #[test]
    fn long_statements_are_broken_outside_parentheses() {
        let statement = format!("const double x = ({} + b) + (c * {});", "a".repeat(60), "d".repeat(60));
        let lines: Vec<_> = wrap("    ", &statement).lines().map(String::from).collect();
        assert_eq!(lines.len(), 2);
        assert!(lines[1].starts_with("        + (c * d"), "{lines:?}");
    }
}
