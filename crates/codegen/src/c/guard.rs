//! The guarded step: neither outputs nor state become NaN or infinite.

use super::interface::assign;
use super::prose::comment;
use super::text::{literal, path, wrap};
use crate::record::{Real, Step};
use crate::tree::Tree;

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

/// The statements of `NAME_step`.
pub(super) fn body(real: Real, name: &str, step: &Step) -> String {
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
    let mut out = String::new();
    if state {
        out += &format!("    {name}_state before;\n");
    }
    out += &format!("    {name}_status status;\n\n");
    if state {
        out += "    before = *s;\n";
    }
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
    if state {
        out += "        *s = before;\n";
    }
    let zeros = vec![0.0; step.output.numbers()];
    for line in assign(real, "out", &step.output, &zeros).lines() {
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
