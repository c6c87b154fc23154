//! `README.md` of a project: a page about the block.

use stickslip_core::fields::Field;

use super::guard::constants;
use super::prose::plain;
use super::text::{literal, number, path};
use super::vectors::STEPS;
use super::{DEVIATIONS, check};
use crate::record::{Program, Real, Step};
use crate::tree::Tree;

/// The page for steps of `dt` [s].
pub(super) fn page(real: Real, program: &Program, top: &Step, name: &str, dt: f64) -> String {
    let mut out = format!("# {name}\n\n{}", about(top));
    out += &format!(
        "Written by stickslip from its block {}: change the model, not these files. C99 without heap, recursion, \
         global variables or libraries, in `{}`. Every operation rounds once, in the order of the model, so that the \
         results have the bits of the model.\n\n",
        top.name, real.c_name
    );
    out += &format!(
        "| file | purpose |\n|-|-|\n| `{name}.h`, `{name}.c` | the block: all code for the target |\n\
         | `{name}_selftest.h`, `{name}_selftest.c` | {STEPS} steps of the model, recomputed and compared |\n\
         | `main.c` | a runnable example |\n\n"
    );
    out += &format!("## How to call it\n\n```c\n{}```\n\n", calls(real, top, name, dt));
    out += &status(name);
    for (title, tree) in [("Inputs", &top.input), ("Outputs", &top.output)] {
        out += &signals(title, tree);
    }
    out += &parameters(real, program, top);
    out += &state(real, top);
    out += &choices(top);
    out + &building(real, name) + &misra()
}

/// The documentation of the block, with equations as separate paragraphs.
fn about(top: &Step) -> String {
    let paragraph =
        |text: String| if text.starts_with("  ") { format!("    {}\n\n", text.trim()) } else { text + "\n\n" };
    plain(top.help).into_iter().map(paragraph).collect()
}

/// The sequence of calls, with the names of this block.
fn calls(real: Real, top: &Step, name: &str, dt: f64) -> String {
    let [parameters, state, input, output] =
        [&top.parameters, &top.state, &top.input, &top.output].map(|tree| tree.numbers() > 0);
    let lines = |all: &[(bool, String)]| -> String {
        all.iter().filter(|line| line.0).map(|line| format!("{}\n", line.1)).collect()
    };
    let join = |all: &[(bool, &str)]| all.iter().filter(|a| a.0).map(|a| a.1).collect::<Vec<_>>().join(", ");
    let step = literal(real, dt);
    let arguments = join(&[(parameters, "&p"), (state, "&s"), (input, "in"), (true, &step), (output, "out")]);
    let (in_type, out_type) = (format!("const {name}_input *in"), format!("{name}_output *out"));
    let arguments_of_cycle = join(&[(input, &in_type), (output, &out_type)]);
    let arguments_of_cycle = if arguments_of_cycle.is_empty() { "void" } else { &arguments_of_cycle };
    let fault = if parameters { format!("{name}_check(&p)") } else { "0".into() };
    lines(&[
        (true, format!("#include \"{name}.h\"\n")),
        (parameters, format!("static {name}_parameters p;")),
        (state, format!("static {name}_state s;")),
        (
            true,
            "\n/* Call once. Returns NULL, or the fault of the parameters: then do not continue. */\nconst char \
             *start(void)\n{"
                .into(),
        ),
        (parameters, format!("    {name}_parameters_init(&p);   /* then set other values */")),
        (state, format!("    {name}_init(&s);")),
        (
            true,
            format!(
                "    return {fault};\n}}\n\n/* Call every {} s. */\n{name}_status \
            cycle({arguments_of_cycle})\n{{",
                number(dt)
            ),
        ),
        (true, format!("    return {name}_step({arguments});\n}}")),
    ])
}

fn status(name: &str) -> String {
    let [ok, input, not_computed] = constants(name);
    format!(
        "| status | meaning | action |\n|-|-|-|\n| `{ok}` | the step was computed | |\n\
         | `{input}` | an input is NaN or infinite; the step was computed without it (an observer coasts, a \
         controller holds) | find the fault of the sensor; the outputs are valid |\n| `{not_computed}` | a result \
         would be NaN or infinite, or the \
         time step is not positive and finite: the state is unchanged, every output is 0 | stop the drive |\n\n\
         For any input, outputs and state are finite after a step from a finite state. An output may still be large: \
         limits are parameters of the block.\n\n"
    )
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// Help on one line.
fn help(field: &Field) -> String {
    cell(&plain(field.help).join(" "))
}

fn signals(title: &str, tree: &Tree) -> String {
    if tree.numbers() == 0 {
        return String::new();
    }
    let mut out = format!("## {title}\n\n| name | symbol | unit | range | description |\n|-|-|-|-|-|\n");
    for (place, field) in tree.leaves() {
        let range = if check::values(field) == "finite" { String::new() } else { check::values(field) };
        out += &format!("| `{}` | {} | {} | {range} | {} |\n", path(&place), field.symbol, field.unit, help(field));
    }
    out + "\n"
}

fn parameters(real: Real, program: &Program, top: &Step) -> String {
    if top.parameters.numbers() == 0 {
        return String::new();
    }
    let mut out = String::from(
        "## Parameters\n\n`check` refuses values outside their range. `parameters_init` sets the values below.\n\n\
         | name | symbol | unit | range | value | description |\n|-|-|-|-|-|-|\n",
    );
    for ((place, field), value) in top.parameters.leaves().into_iter().zip(&program.parameters) {
        out += &format!(
            "| `{}` | {} | {} | {} | {} | {} |\n",
            path(&place),
            field.symbol,
            field.unit,
            check::values(field),
            number((real.text)(*value).parse().unwrap_or(*value)),
            help(field)
        );
    }
    for law in &program.laws.laws {
        let (path, order) = (&law.path, law.order.words());
        let law = format!("{path} must be {order} the limit that the other parameters set. {}", law.remedy);
        out += &format!("\n- {law}");
    }
    out + "\n\n"
}

fn state(real: Real, top: &Step) -> String {
    let numbers = top.state.numbers();
    let bytes = numbers * if real.c_suffix.is_empty() { 8 } else { 4 };
    match numbers {
        0 => "The block has no state.\n\n".into(),
        1 => format!("The state is one number, {bytes} bytes.\n\n"),
        _ => {
            format!("The state has {numbers} numbers, {bytes} bytes. A copy of the struct is a copy of the state.\n\n")
        }
    }
}

/// The choices of the configuration that are fixed in this code.
fn choices(top: &Step) -> String {
    let mut out = String::new();
    for (place, _, tree) in top.parameters.parts() {
        if let Tree::Group(group) = tree {
            for (tag, variant) in &group.chosen {
                let owner = if place.is_empty() { "the block".into() } else { format!("`{}`", path(&place)) };
                out += &format!("- {tag} of {owner}: {variant}\n");
            }
        }
    }
    if out.is_empty() { out } else { format!("Choices that are fixed in this code:\n\n{out}\n") }
}

fn building(real: Real, name: &str) -> String {
    format!(
        "## How to compile it\n\n```sh\ncc -std=c99 -O2 -o {name} {name}.c {name}_selftest.c main.c\n./{name} > \
         {name}.csv\n```\n\ngcc and clang may use any `-O` and `-march`: the source disables the contraction of \
         multiplications with additions, and refuses `-ffast-math`. On 32-bit x86 add `-msse2 -mfpmath=sse`. With \
         other compilers, switch off contraction and all relaxed floating-point modes, and run the \
         self-test:\n\n```c\nconst char *fault = {name}_selftest();   /* NULL, or \"step 12: output …\" \
         */\n```\n\nRun it \
         once at start on the target as well. The processor must round to nearest and keep subnormal numbers: on \
         x86 MXCSR without FTZ and DAZ, on Cortex-M FPSCR with FZ, DN and RMode 0, as after reset.{}\n\n",
        if real.c_suffix.is_empty() { " A Cortex-M4F computes `double` in software." } else { "" }
    )
}

fn misra() -> String {
    let rows: String = DEVIATIONS.iter().map(|(rule, reason)| format!("| {rule} | {} |\n", cell(reason))).collect();
    format!(
        "## MISRA C:2012\n\nChecked with cppcheck and its MISRA add-on; `main.c` is an example and not checked. \
         Deviations:\n\n| rule | reason |\n|-|-|\n{rows}"
    )
}
