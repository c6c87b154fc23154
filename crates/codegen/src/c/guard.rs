//! The guarded step: neither outputs nor state become NaN or infinite.

use super::interface::set;
use super::prose::comment;
use super::text::{identifier, literal, path, wrap};
use super::types::Types;
use crate::record::{Real, Step};
use crate::tree::Tree;

/// Numbers that a step does not change are copied with the others of their struct up to this count: one statement less.
const COPIED_ALONG: usize = 8;

/// The return type of [`body`]; its cases are those of `stickslip_core::block::Status`.
pub(super) fn status(name: &str) -> String {
    let case = |about: &str, constant: String| format!("{}    {constant}", comment("    ", &[about.into()]));
    let [ok, input, not_computed] = constants(name);
    let cases = [
        case("The step was computed.", format!("{ok} = 0")),
        case("The step was computed although an input is NaN or infinite.", format!("{input} = 1")),
        case(
            "The step was not computed, since a result would be NaN or infinite or dt is not positive and finite: the \
             state is unchanged, every output is 0.",
            format!("{not_computed} = 2"),
        ),
    ];
    format!("/* Result of a step. */\ntypedef enum {{\n{}\n}} {name}_status;\n\n", cases.join(",\n"))
}

/// Names of the cases, in the order of their numbers.
pub(super) fn constants(name: &str) -> [String; 3] {
    ["OK", "INPUT_NOT_FINITE", "NOT_COMPUTED"].map(|case| format!("{}_{case}", name.to_uppercase()))
}

/// The parts of the state that a step may change: path and tree of each.
fn changed<'a>(step: &'a Step, types: &Types) -> Vec<(String, &'a Tree)> {
    let mut parts: Vec<(String, &Tree)> = Vec::new();
    let mut next = 0;
    for (path, first, tree) in step.state.parts() {
        let numbers = first..first + tree.numbers();
        let unchanged = numbers.clone().filter(|number| step.keeps(*number)).count();
        let is_value = matches!(tree, Tree::Number) || types.name(tree).is_some();
        // The parts of a tree follow it.
        if first >= next && unchanged < numbers.len() && is_value && unchanged <= COPIED_ALONG {
            next = numbers.end;
            parts.push((path, tree));
        }
    }
    parts
}

/// The statements that copy these parts of the state, and those that restore them.
fn copies(real: Real, parts: &[(String, &Tree)], types: &Types) -> [String; 2] {
    let [mut copy, mut restore] = [String::new(), String::new()];
    for (number, (place, tree)) in parts.iter().enumerate() {
        let flat = |place: &str| place.replace(['.', '['], "_").replace(']', "");
        let taken = parts[..number].iter().any(|(other, _)| flat(other) == flat(place));
        let suffix = if taken { format!("_{number}") } else { String::new() };
        let (local, source) = if place.is_empty() {
            ("before".into(), "*s".into())
        } else {
            (identifier(&format!("before_{}{suffix}", flat(place))), format!("s->{}", path(place)))
        };
        let type_name = types.name(tree).unwrap_or(real.c_name);
        copy += &if matches!(tree, Tree::Number) {
            wrap("    ", &format!("const {type_name} {local} = {source};"))
        } else {
            // cppcheck takes the initialiser of a struct with a list for that of the list.
            format!("    {type_name} {local};\n{}", wrap("    ", &format!("{local} = {source};")))
        };
        restore += &wrap("        ", &format!("{source} = {local};"));
    }
    [copy, restore]
}

/// The statements of `NAME_step`.
pub(super) fn body(real: Real, name: &str, step: &Step, types: &Types) -> String {
    let [ok, input_not_finite, not_computed] = constants(name);
    let (state, output) = (step.state.numbers() > 0, step.output.numbers() > 0);
    let arguments = [
        ("p", step.parameters.numbers() > 0),
        ("s", state),
        ("in", step.input.numbers() > 0),
        ("dt", true),
        ("out", output),
    ];
    let arguments: Vec<&str> = arguments.into_iter().filter(|a| a.1).map(|a| a.0).collect();
    let [copy, restore] = copies(real, &changed(step, types), types);
    let mut out = format!("{copy}    {name}_status status;\n\n");
    out += &format!("    {name}_raw_step({});\n", arguments.join(", "));
    let computed = [
        vec!["isfinite(dt)".into(), format!("(dt > {})", literal(real, 0.0))],
        // Numbers that the step does not change need no check.
        finite("s", &step.state, |number| !step.keeps(number)),
        finite("out", &step.output, |_| true),
    ];
    // No separate truth value: clang would load the numbers as vectors right after they were stored one by one, and
    // stall.
    out += &wrap("    ", &format!("if (!({})) {{", computed.concat().join(" && ")));
    out += &restore;
    let zeros = vec![0.0; step.output.numbers()];
    for line in set(real, name, "out", &step.output, &zeros).lines() {
        out += &format!("    {line}\n");
    }
    out += &format!("        status = {not_computed};\n");
    let inputs = finite("in", &step.input, |_| true);
    if !inputs.is_empty() {
        out += &wrap("    ", &format!("}} else if (!({})) {{", inputs.join(" && ")));
        out += &format!("        status = {input_not_finite};\n");
    }
    out + &format!("    }} else {{\n        status = {ok};\n    }}\n    return status;\n")
}

/// A condition for each number to be checked.
fn finite(base: &str, tree: &Tree, counts: impl Fn(usize) -> bool) -> Vec<String> {
    let paths = tree.paths();
    let checked = paths.iter().enumerate().filter(|(number, _)| counts(*number));
    checked.map(|(_, names)| format!("isfinite({base}->{})", path(names))).collect()
}
