//! Whether parameters are within their ranges.

use stickslip_core::fields::{Field, Kind};

use super::text::{literal, path, wrap};
use crate::record::{Function, Precision};
use crate::tree::Tree;

/// Largest finite number of the precision, as C calls it: the range of a number that has none.
fn largest<F: Precision>() -> &'static str {
    if F::C_SUFFIX.is_empty() { "DBL_MAX" } else { "FLT_MAX" }
}

/// Whether only whole numbers make sense.
fn is_whole(field: &Field) -> bool {
    field.kind != Kind::Real
}

/// The functions of one number that the checks call.
pub(super) fn needs(parameters: &Tree) -> Option<Function> {
    parameters.leaves().iter().any(|(_, field)| is_whole(field)).then_some(Function::Floor)
}

/// The functions that [`body`] calls: each hands on what is known to be wrong, or says what is.
pub(super) fn functions<F: Precision>(parameters: &Tree) -> String {
    let real = F::C_NAME;
    let function = |name: &str, condition: &str| {
        format!(
            "/* The first fault: the one found before, or that a number is not {name}. NaN is not. */\n\
             static const char *stickslip_{name}(const char *fault, {real} value, {real} minimum, {real} maximum,\n    \
             const char *message) {{\n    const bool good = {condition};\n    \
             return ((fault != NULL) || good) ? fault : message;\n}}\n\n"
        )
    };
    let within = "(value >= minimum) && (value <= maximum)";
    let mut out = String::new();
    if parameters.leaves().iter().any(|(_, field)| !is_whole(field)) {
        out += &function("within", within);
    }
    if needs(parameters).is_some() {
        let floor = super::body::function_name::<F>(Function::Floor);
        out += &function("whole_within", &format!("{within} && (value <= {floor}(value))"));
    }
    out
}

/// The statements of `NAME_check`.
pub(super) fn body<F: Precision>(parameters: &Tree) -> String {
    let mut out = String::from("    const char *fault = NULL;\n");
    for (number, field) in parameters.leaves() {
        let function = if is_whole(field) { "whole_within" } else { "within" };
        let bound = |value: f64, sign: &str| {
            if value.is_finite() { literal::<F>(value) } else { format!("{sign}{}", largest::<F>()) }
        };
        let (minimum, maximum) = (bound(field.minimum, "-"), bound(field.maximum, ""));
        let place = path(&number);
        let message = format!("\"{number} must be {}\"", allowed(field));
        let call = format!("fault = stickslip_{function}(fault, p->{place}, {minimum}, {maximum}, {message});");
        out += &wrap("    ", &call);
    }
    out + "    return fault;\n"
}

/// Which values a parameter may have: `1e-6 to 200 N m`.
pub(super) fn allowed(field: &Field) -> String {
    let unit = if matches!(field.unit, "" | "1") { String::new() } else { format!(" {}", field.unit) };
    match (field.kind, field.minimum.is_finite(), field.maximum.is_finite()) {
        (Kind::Flag, ..) => "0 or 1".into(),
        (kind, least, most) => {
            let noun = if kind == Kind::Whole { "a whole number" } else { "" };
            let range = match (least, most) {
                (true, true) => format!("{} to {}{unit}", field.minimum, field.maximum),
                (true, false) => format!("finite and at least {}{unit}", field.minimum),
                (false, true) => format!("finite and at most {}{unit}", field.maximum),
                (false, false) => "finite".into(),
            };
            format!("{noun} {range}").trim().to_string()
        }
    }
}
