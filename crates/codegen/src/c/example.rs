//! `main.c`: an example that runs the block and prints its signals.

use super::excitation::{period, span};
use super::text::{literal, number, path, wrap};
use crate::record::{Real, Step};

/// Number of steps.
const STEPS: u32 = 400;

/// The example, with steps of `dt` [s].
pub(super) fn main(real: Real, name: &str, step: &Step, dt: f64) -> String {
    let upper = name.to_uppercase();
    let [parameters, state, input, output] =
        [&step.parameters, &step.state, &step.input, &step.output].map(|tree| tree.numbers() > 0);
    let when = |yes: bool, text: String| if yes { text } else { String::new() };
    let arguments = [(parameters, "&p"), (state, "&s"), (input, "&in"), (true, "dt"), (output, "&out")];
    let arguments: Vec<&str> = arguments.into_iter().filter(|a| a.0).map(|a| a.1).collect();
    let columns: Vec<(String, String)> = [("in", "input", &step.input), ("out", "output", &step.output)]
        .into_iter()
        .flat_map(|(base, kind, tree)| {
            tree.leaves().into_iter().map(move |(place, field)| {
                let unit = if field.unit.is_empty() { String::new() } else { format!(" [{}]", field.unit) };
                (format!("{kind} {place}{unit}"), format!("{base}.{}", path(&place)))
            })
        })
        .collect();
    let cast = if real.c_suffix.is_empty() { "" } else { "(double)" };
    let mut prints = String::new();
    for (_, value) in &columns {
        prints += &wrap("        ", &format!("(void)printf(\",%.9g\", {cast}{value});"));
    }
    let heads: String = columns.iter().map(|column| format!("    (void)fputs(\",{}\", stdout);\n", column.0)).collect();
    [
        format!(
            "/* Runs {name} for {STEPS} steps of {} s and prints a table (CSV). Written by stickslip. */\n#include \
             \"{name}.h\"\n#include \"{name}_selftest.h\"\n\n#include <stddef.h>\n#include <stdio.h>\n\n",
            number(dt)
        ),
        when(input, triangle(real)),
        "int main(void) {\n".into(),
        format!("    const {real} dt = {};\n", literal(real, dt)),
        when(parameters, format!("    {name}_parameters p;\n")),
        when(state, format!("    {name}_state s;\n")),
        "    const char *fault;\n    int k;\n\n".into(),
        when(parameters, format!("    {name}_parameters_init(&p);\n    fault = {name}_check(&p);\n")),
        when(parameters, format!("    if (fault == NULL) {{\n        fault = {name}_selftest();\n    }}\n")),
        when(!parameters, format!("    fault = {name}_selftest();\n")),
        "    if (fault != NULL) {\n        (void)fprintf(stderr, \"%s\\n\", fault);\n        return 1;\n    }\n\n"
            .into(),
        when(state, format!("    {name}_init(&s);\n")),
        "    (void)fputs(\"time [s]\", stdout);\n".into(),
        heads,
        "    (void)fputs(\",status\\n\", stdout);\n".into(),
        format!("    for (k = 0; k < {STEPS}; k++) {{\n"),
        when(input, format!("        {name}_input in;\n")),
        when(output, format!("        {name}_output out;\n")),
        format!("        {name}_status status;\n"),
        inputs(real, step),
        format!("        status = {name}_step({});\n", arguments.join(", ")),
        "        (void)printf(\"%.9g\", (double)k * (double)dt);\n".into(),
        prints,
        format!("        (void)printf(\",%s\\n\", (status == {upper}_OK) ? \"ok\" : \"not ok\");\n    }}\n"),
        "    return 0;\n}\n".into(),
    ]
    .concat()
}

/// The triangle wave of `excitation`.
fn triangle(real: Real) -> String {
    let [one, two, three, four] = [1.0, 2.0, 3.0, 4.0].map(|value| literal(real, value));
    format!(
        "/* A triangle wave between -1 and 1 that starts at 0 and rises; its period is in steps. */\nstatic {real} \
         triangle(int step, int period) {{\n    const {real} quarters = ({four} * ({real})(step % period)) / \
         ({real})period;\n    const {real} falling = (quarters <= {three}) ? ({two} - quarters) : (quarters - {four});\n    \
         return (quarters <= {one}) ? quarters : falling;\n}}\n\n"
    )
}

/// A wave over the span of each input.
fn inputs(real: Real, step: &Step) -> String {
    let mut out = String::new();
    for (i, (place, field)) in step.input.leaves().into_iter().enumerate() {
        let (span, place, period) = (span(field), path(&place), period(i));
        let (middle, half) = (0.5 * (span.low + span.high), 0.5 * (span.high - span.low));
        let value = if span.low == 0.0 && span.high == 1.0 && span.whole {
            let (zero, one) = (literal(real, 0.0), literal(real, 1.0));
            format!("(triangle(k, {period}) < {zero}) ? {zero} : {one}")
        } else {
            let wave = format!("{} * triangle(k, {period})", literal(real, half));
            let whole = if middle == 0.0 { wave } else { format!("{} + ({wave})", literal(real, middle)) };
            if span.whole { format!("({})(int)({whole})", real.c_name) } else { whole }
        };
        out += &wrap("        ", &format!("in.{place} = {value};"));
    }
    out
}
