//! Checks of the ranges of parameters.

use stickslip_core::fields::{Field, Kind};

use super::body::function_name;
use super::kernel::Needs;
use super::text::{literal, number, path, wrap};
use crate::record::{Function, Program, Real};

/// Largest finite number of the precision, as named in C: the range of a number without limits.
fn largest(real: Real) -> &'static str {
    if real.c_suffix.is_empty() { "DBL_MAX" } else { "FLT_MAX" }
}

/// Whether only whole numbers are valid.
fn is_whole(field: &Field) -> bool {
    field.kind != Kind::Real
}

/// The functions that [`body`] calls: each returns the previous fault, or its own.
pub(super) fn functions(real: Real, program: &Program) -> String {
    let leaves = program.steps.last().map(|top| top.parameters.leaves()).unwrap_or_default();
    let value = format!("{real} value, {real} minimum, {real} maximum");
    let within = "(value >= minimum) && (value <= maximum)";
    let floor = function_name(real, Function::Floor);
    let whole = format!("{within} && (value <= {floor}(value))");
    let all: [(bool, &str, &str, &str, &str); 3] = [
        (leaves.iter().any(|leaf| !is_whole(leaf.1)), "within", &value, within, "a number out of its range, or NaN"),
        (
            leaves.iter().any(|leaf| is_whole(leaf.1)),
            "whole",
            &value,
            &whole,
            "a number out of its range, or not whole",
        ),
        (!program.laws.laws.is_empty(), "law", "bool good", "", "a violated law between parameters"),
    ];
    let mut out = String::new();
    for (_, name, arguments, condition, about) in all.into_iter().filter(|one| one.0) {
        let head =
            format!("static const char *stickslip_{name}(const char *fault, {arguments}, const char *message) {{");
        let good = if condition.is_empty() { String::new() } else { format!("    const bool good = {condition};\n") };
        out += &format!("/* The first fault: the given one, or {about}. */\n{}", wrap("", &head));
        out += &format!("{good}    return ((fault != NULL) || good) ? fault : message;\n}}\n\n");
    }
    out
}

/// The statements of `NAME_check`.
pub(super) fn body(real: Real, program: &Program) -> (String, Needs) {
    let mut needs = Needs::default();
    let mut out = String::from("    const char *fault = NULL;\n");
    let Some(top) = program.steps.last() else { return (out, needs) };
    for (place, field) in top.parameters.leaves() {
        let function = if is_whole(field) { "whole" } else { "within" };
        if is_whole(field) {
            needs.function(Function::Floor);
        }
        let bound = |value: f64, sign: &str| {
            if value.is_finite() { literal(real, value) } else { format!("{sign}{}", largest(real)) }
        };
        let (minimum, maximum) = (bound(field.minimum, "-"), bound(field.maximum, ""));
        let message = format!("\"{place} must be {}\"", allowed(field));
        let place = path(&place);
        let call = format!("fault = stickslip_{function}(fault, p->{place}, {minimum}, {maximum}, {message});");
        out += &wrap("    ", &call);
    }
    if !program.laws.laws.is_empty() {
        let (laws, conditions) = super::body::laws(real, &program.laws, &top.parameters);
        needs.extend(&laws.needs);
        out += &laws.lines;
        for (law, condition) in program.laws.laws.iter().zip(conditions) {
            let (path, order) = (law.path.as_str(), law.order.words());
            let message = format!("{path} must be {order} the limit that the other parameters set. {}", law.remedy);
            out += &wrap("    ", &format!("fault = stickslip_law(fault, {condition}, {});", string(&message)));
        }
    }
    (out + "    return fault;\n", needs)
}

/// A string of C, in pieces that fit on lines.
pub(crate) fn string(text: &str) -> String {
    let mut pieces = vec![String::new()];
    for word in text.replace('\\', "\\\\").replace('"', "\\\"").split_inclusive(' ') {
        if pieces.last().is_some_and(|piece| piece.len() + word.len() > 80) {
            pieces.push(String::new());
        }
        pieces.last_mut().expect("there is at least one piece").push_str(word);
    }
    format!("\"{}\"", pieces.join("\" \""))
}

/// The valid values of a parameter, without the unit: `1e-6 to 200`.
pub(super) fn values(field: &Field) -> String {
    let noun = if field.kind == Kind::Whole { "a whole number, " } else { "" };
    let (least, most) = (number(field.minimum), number(field.maximum));
    match (field.kind, field.minimum.is_finite(), field.maximum.is_finite()) {
        (Kind::Flag, ..) => "0 or 1".into(),
        (_, true, true) => format!("{noun}{least} to {most}"),
        (_, true, false) => format!("{noun}finite and at least {least}"),
        (_, false, true) => format!("{noun}finite and at most {most}"),
        (_, false, false) => format!("{noun}finite"),
    }
}

/// The same with the unit: `1e-6 to 200 N m`.
pub(super) fn allowed(field: &Field) -> String {
    let has_unit = !matches!(field.unit, "" | "1") && (field.minimum.is_finite() || field.maximum.is_finite());
    if has_unit { format!("{} {}", values(field), field.unit) } else { values(field) }
}
