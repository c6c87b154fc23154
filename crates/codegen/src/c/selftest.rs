//! `NAME_selftest`: recomputes stored vectors and reports the first different result.
//!
//! It detects compilers and processor settings that change results despite the pragmas of the source.

use super::guard::constants;
use super::prose::comment;
use super::text::{path, wrap};
use super::vectors::{STEPS, Vector};
use crate::record::{Real, Step};
use crate::tree::Tree;

/// A state of at most this size is compared after every step, a larger one after every tenth.
const SMALL: usize = 8;

/// `NAME_selftest.h`.
pub(super) fn header(name: &str) -> String {
    let guard = format!("{}_SELFTEST_H", name.to_uppercase());
    let about = format!(
        "NULL if this build of {name} computes the bits of the model, or the first result that differs, as in \
         \"step 12: output velocity\". Not for two threads at once."
    );
    format!(
        "/* Self-test of {name}, written by stickslip. Change the model, not this file. */\n#ifndef {guard}\n#define \
         {guard}\n\n{}const char *{name}_selftest(void);\n\n#endif /* {guard} */\n",
        comment("", &[about])
    )
}

/// `NAME_selftest.c`.
pub(super) fn source(real: Real, name: &str, step: &Step, vectors: &[Vector]) -> String {
    let word = if real.c_suffix.is_empty() { "uint64_t" } else { "uint32_t" };
    let [inputs, outputs, states] = [&step.input, &step.output, &step.state].map(Tree::numbers);
    let every = if states <= SMALL { 1 } else { 10 };
    let mut out = format!(
        "/* Self-test of {name}, written by stickslip. Change the model, not this file. */\n#include \
         \"{name}_selftest.h\"\n\n#include \"{name}.h\"\n\n#include <stddef.h>\n#include <stdint.h>\n\n"
    );
    out += "/* A step: inputs and outputs, each number as its bits. */\ntypedef struct {\n";
    out += &format!("    {word} dt;\n");
    for (member, length) in [("in", inputs), ("out", outputs)].into_iter().filter(|m| m.1 > 0) {
        out += &format!("    {word} {member}[{length}];\n");
    }
    out += &format!("    {name}_status status;\n}} {name}_vector;\n\n");
    let longest = [&step.output, &step.state].into_iter().flat_map(Tree::paths).map(|path| path.len()).max();
    let length = "step 123: output ".len() + longest.unwrap_or(0) + 1;
    out += &helpers(name, real, word, length);
    out + &function(name, real, step, &tables(real, word, name, step, vectors, every), every)
}

/// Vectors, states and names, as static constants of the function.
fn tables(real: Real, word: &str, name: &str, step: &Step, vectors: &[Vector], every: usize) -> String {
    let states = step.state.numbers();
    let mut out = format!("    static const {name}_vector vectors[{STEPS}] = {{\n");
    for vector in vectors {
        let lists = [&vector.input, &vector.output].map(|numbers| list(real, numbers));
        let lists: Vec<String> = lists.into_iter().filter(|list| !list.is_empty()).collect();
        let status = &constants(name)[vector.status as usize];
        let row = [vec![bits(real, vector.dt)], lists, vec![status.clone()]].concat().join(", ");
        out += &wrap("        ", &format!("{{ {row} }},"));
    }
    out += "    };\n";
    if states > 0 {
        let rows: Vec<&Vector> = vectors.iter().skip(every - 1).step_by(every).collect();
        let when = if every == 1 { "every step".into() } else { format!("every {every}th step") };
        out += &format!("    /* The state after {when}. */\n");
        out += &format!("    static const {word} states[{}][{states}] = {{\n", rows.len());
        rows.iter().for_each(|vector| out += &wrap("        ", &format!("{},", list(real, &vector.state))));
        out += "    };\n";
    }
    for (kind, tree) in [("output", &step.output), ("state", &step.state)].into_iter().filter(|k| k.1.numbers() > 0) {
        let names: Vec<String> = tree.paths().iter().map(|path| format!("\"{kind} {path}\"")).collect();
        let names = format!("static const char *const {kind}_names[{}] = {{ {} }};", names.len(), names.join(", "));
        out += &wrap("    ", &names);
    }
    out
}

fn bits(real: Real, number: f64) -> String {
    let bits = if real.c_suffix.is_empty() { number.to_bits() } else { u64::from((number as f32).to_bits()) };
    if bits == 0 { "0U".into() } else { format!("0x{bits:x}U") }
}

fn list(real: Real, numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|number| bits(real, *number)).collect();
    if numbers.is_empty() { String::new() } else { format!("{{ {} }}", numbers.join(", ")) }
}

/// Number from bits and back, comparison, and the message.
fn helpers(name: &str, real: Real, word: &str, length: usize) -> String {
    format!(
        "static {real} {name}_from_bits({word} bits) {{
    union {{ {real} number; {word} bits; }} view;
    view.bits = bits;
    return view.number;
}}

static {word} {name}_to_bits({real} number) {{
    union {{ {real} number; {word} bits; }} view;
    view.number = number;
    return view.bits;
}}

/* \"step 12: output velocity\" */
static const char *{name}_difference(uint32_t step, const char *what) {{
    static char text[{length}];
    const char digits[10] = {{ '0', '1', '2', '3', '4', '5', '6', '7', '8', '9' }};
    const char *const parts[3] = {{ \"step \", \": \", what }};
    uint32_t length = 0U;
    uint32_t part;
    for (part = 0U; part < 3U; part++) {{
        uint32_t i;
        if (part == 1U) {{
            if (step >= 10U) {{
                text[length] = digits[(step / 10U) % 10U];
                length++;
            }}
            text[length] = digits[step % 10U];
            length++;
        }}
        for (i = 0U; (parts[part][i] != '\\0') && (length < {last}U); i++) {{
            text[length] = parts[part][i];
            length++;
        }}
    }}
    text[length] = '\\0';
    return text;
}}

/* The first number whose bits are not those that are expected. */
static const char *{name}_compare(uint32_t step, const char *const names[], const {word} expected[],
    const {real} found[], uint32_t numbers) {{
    const char *fault = NULL;
    uint32_t i;
    for (i = 0U; (i < numbers) && (fault == NULL); i++) {{
        if ({name}_to_bits(found[i]) != expected[i]) {{
            fault = {name}_difference(step, names[i]);
        }}
    }}
    return fault;
}}

",
        last = length - 1
    )
}

/// `NAME_selftest`.
fn function(name: &str, real: Real, step: &Step, tables: &str, every: usize) -> String {
    let [parameters, state, input, output] =
        [&step.parameters, &step.state, &step.input, &step.output].map(|tree| tree.numbers() > 0);
    let when = |yes: bool, text: String| if yes { text } else { String::new() };
    let set: String = step
        .input
        .paths()
        .iter()
        .enumerate()
        .map(|(i, place)| format!("        in.{} = {name}_from_bits(vector->in[{i}]);\n", path(place)))
        .collect();
    let all = |base: &str, tree: &Tree| {
        let numbers: Vec<String> = tree.paths().iter().map(|place| format!("{base}.{}", path(place))).collect();
        format!("const {real} found[{}] = {{ {} }};", numbers.len(), numbers.join(", "))
    };
    let compare = |kind: &str, expected: &str, base: &str, tree: &Tree| {
        let numbers = tree.numbers();
        wrap("            ", &all(base, tree))
            + &wrap("            ", &format!("fault = {name}_compare(k, {kind}_names, {expected}, found, {numbers}U);"))
    };
    let arguments = [(parameters, "&p"), (state, "&s"), (input, "&in"), (true, ""), (output, "&out")];
    let dt = format!("{name}_from_bits(vector->dt)");
    let arguments: Vec<&str> =
        arguments.into_iter().filter(|a| a.0).map(|a| if a.1.is_empty() { dt.as_str() } else { a.1 }).collect();
    let due = match every {
        1 => "fault == NULL".into(),
        _ => format!("(fault == NULL) && ((k % {every}U) == {}U)", every - 1),
    };
    let row = if every == 1 { "k".into() } else { format!("k / {every}U") };
    [
        format!("const char *{name}_selftest(void) {{\n{tables}    const char *fault = NULL;\n"),
        when(parameters, format!("    {name}_parameters p;\n")),
        when(state, format!("    {name}_state s;\n")),
        "    uint32_t k;\n".into(),
        when(parameters, format!("    {name}_parameters_init(&p);\n")),
        when(state, format!("    {name}_init(&s);\n")),
        format!("    for (k = 0U; (k < {STEPS}U) && (fault == NULL); k++) {{\n"),
        format!("        const {name}_vector *const vector = &vectors[k];\n"),
        when(input, format!("        {name}_input in;\n")),
        when(output, format!("        {name}_output out;\n")),
        format!("        {name}_status status;\n"),
        set,
        wrap("        ", &format!("status = {name}_step({});", arguments.join(", "))),
        when(output, format!("        {{\n{}        }}\n", compare("output", "vector->out", "out", &step.output))),
        when(
            state,
            format!(
                "        if ({due}) {{\n{}        }}\n",
                compare("state", &format!("states[{row}]"), "s", &step.state)
            ),
        ),
        format!(
            "        if ((fault == NULL) && (status != vector->status)) {{\n            \
             fault = {name}_difference(k, \"status\");\n        }}\n    }}\n    return fault;\n}}\n"
        ),
    ]
    .concat()
}
