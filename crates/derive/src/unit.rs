//! SI units, as written after a number: `N m/rad`, `V/(m/s^2)`, `1/s`.

/// Names that a unit may consist of. Angles count as a unit of their own, so that rad/s and Hz stay apart.
const UNITS: [&str; 21] = [
    "1", "m", "kg", "s", "A", "K", "rad", "N", "V", "W", "J", "H", "Ω", "Hz", "√Hz", "C", "T", "Pa", "lines", "counts",
    "bit",
];

/// `Err` with what is wrong, unless the text is a product and quotient of known units.
pub(crate) fn check(text: &str) -> Result<(), String> {
    let mut rest = text;
    product(&mut rest)?;
    if !rest.is_empty() {
        return Err(format!("unit \"{text}\": cannot read \"{rest}\""));
    }
    Ok(())
}

/// factor { (" " | "/") factor }
fn product(rest: &mut &str) -> Result<(), String> {
    factor(rest)?;
    while let Some(tail) = rest.strip_prefix([' ', '/']) {
        *rest = tail;
        factor(rest)?;
    }
    Ok(())
}

/// ( name | "(" product ")" ) [ "^" digits ]
fn factor(rest: &mut &str) -> Result<(), String> {
    if let Some(tail) = rest.strip_prefix('(') {
        *rest = tail;
        product(rest)?;
        *rest = rest.strip_prefix(')').ok_or("a parenthesis of a unit is not closed")?;
    } else {
        let end = rest.find([' ', '/', '(', ')', '^']).unwrap_or(rest.len());
        let (name, tail) = rest.split_at(end);
        if name.is_empty() {
            return Err("missing name of a unit; separate units by one space or one /, as in \"N m/rad\"".into());
        }
        if !UNITS.contains(&name) {
            return Err(format!("unknown unit \"{name}\"; the units are {}", UNITS.join(", ")));
        }
        *rest = tail;
    }
    if let Some(tail) = rest.strip_prefix('^') {
        let end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        if end == 0 {
            return Err("missing number in the power of a unit".into());
        }
        *rest = &tail[end..];
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::check;

    #[test]
    fn units_of_the_field_are_read() {
        for unit in ["N m/rad", "1", "1/s", "V/(m/s^2)", "kg m^2", "N m s/rad", "V s/rad", "Ω", "m/s^2/√Hz"] {
            assert_eq!(check(unit), Ok(()), "{unit}");
        }
    }

    #[test]
    fn anything_else_is_refused() {
        for unit in ["", "Nm", "N  m", "rpm", "N m/", "(N", "m^", "N·m", "N m)", "√"] {
            assert!(check(unit).is_err(), "{unit}");
        }
    }
}
