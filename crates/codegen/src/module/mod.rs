//! A controller or a friction as the shared library for `stickslip load`: the five functions of `stickslip_module.h`
//! around the code of [`c::project_of`](crate::c::project_of).
//!
//! All variables are in the instance that `stickslip_begin` creates: any number of instances run in parallel.

mod law;

pub use law::{LawSample, record_law};

use crate::c::{identifier_path, literal, plain, string};
use stickslip_core::fields::Field;

use crate::record::{Declared, Program, Real, Signature};
use crate::tree::Tree;

/// Name of the input for the torque limit, which a library gets once.
const LIMIT: &str = "torque_limit";
/// Name of the output of a controller.
const TORQUE: &str = "torque";

/// Inputs of a controller: all but the last are members of `stickslip_sample`.
fn sample() -> Vec<(String, &'static Field)> {
    Tree::of(&LawSample::<f64>::default()).leaves()
}

/// The signature of a controller with these parameters and this state.
pub fn signature(name: &str, help: &str, parameters: Vec<Declared>, state: Vec<Declared>) -> Signature {
    let number = |(name, unit, help): (&str, &str, &str)| {
        let minimum = if ["time", LIMIT].contains(&name) { 0.0 } else { f64::NEG_INFINITY };
        let maximum = f64::INFINITY;
        Declared { name: name.into(), unit: unit.into(), help: help.into(), minimum, maximum, value: 0.0 }
    };
    Signature {
        name: name.into(),
        help: help.into(),
        parameters,
        state,
        input: sample().iter().map(|(name, field)| number((name, field.unit, field.help))).collect(),
        output: vec![number((TORQUE, "N m", "Torque of the drive."))],
    }
}

/// Member of the sample for an input of a program; `None` if it is not a signal of the bench.
fn signal(input: &str) -> Option<&str> {
    match input {
        // Names of the inputs of a friction.
        "velocity" => Some("sample->estimated_velocity"),
        "angle" => Some("sample->measured_angle"),
        LIMIT => Some("instance->torque_limit"),
        _ => None,
    }
}

/// `NAME_module.c` of a program with that [`signature`], or of a friction: velocity and angle in, torque out; all other
/// inputs are 0. `NAME.c` and `stickslip_module.h` must be in the same folder.
pub fn source(program: &Program, name: &str) -> String {
    let head = format!(
        "/* {name} as a library that stickslip loads, written by stickslip. Change the model, not this file. */\n\
         #include \"{name}.c\"\n\n#include <stdlib.h>\n\n\
         #if defined(__GNUC__)\n#pragma GCC visibility push(default)\n#endif\n#include \"stickslip_module.h\"\n\
         #if defined(__GNUC__)\n#pragma GCC visibility pop\n#endif\n\n"
    );
    let end = "void stickslip_end(void *controller) {\n    free(controller);\n}\n".into();
    let parts = [
        head,
        parameter_table(program),
        description(program, name),
        instance(program, name),
        set_function(program, name),
        begin_function(program, name),
        step_function(program, name),
        end,
    ];
    parts.concat()
}

/// Whether the block has parameters.
fn is_tuned(program: &Program) -> bool {
    !program.top().parameters.leaves().is_empty()
}

fn has_state(program: &Program) -> bool {
    program.top().state.numbers() > 0
}

/// A row for each parameter, if there are any.
fn parameter_table(program: &Program) -> String {
    if !is_tuned(program) {
        return String::new();
    }
    let row = |((path, field), value): ((String, &Field), &f64)| {
        // The name of a parameter in a library has no dots.
        let texts = [&path.replace('.', "_"), field.unit, &plain(field.help).join(" ")].map(string).join(", ");
        // Values without a bound must be finite.
        let bounds = [field.minimum.max(f64::MIN), field.maximum.min(f64::MAX), *value];
        format!("    {{{texts}, {}}},\n", bounds.map(|value| literal(Real::DOUBLE, value)).join(", "))
    };
    let rows: String = program.top().parameters.leaves().into_iter().zip(&program.parameters).map(row).collect();
    format!("static const stickslip_parameter PARAMETERS[] = {{\n{rows}}};\n\n")
}

/// The result of `stickslip_describe`.
fn description(program: &Program, name: &str) -> String {
    let table = if is_tuned(program) { "PARAMETERS" } else { "NULL" };
    format!(
        "static const stickslip_description DESCRIPTION = {{STICKSLIP_MODULE_ABI, {}U, {}, {table}}};\n\n",
        program.top().parameters.leaves().len(),
        string(name)
    )
}

/// The type of an instance, and `stickslip_describe`.
fn instance(program: &Program, name: &str) -> String {
    let parameters = if is_tuned(program) { format!("    {name}_parameters p;\n") } else { String::new() };
    let state = if has_state(program) { format!("    {name}_state s;\n") } else { String::new() };
    format!(
        "typedef struct {{\n{parameters}{state}    double sample_time;\n    double torque_limit;\n}} stickslip_instance;\n\n\
         const stickslip_description *stickslip_describe(void) {{\n    return &DESCRIPTION;\n}}\n\n"
    )
}

fn set_function(program: &Program, name: &str) -> String {
    let body = if is_tuned(program) {
        let assign =
            |(k, (path, _)): (usize, &(String, _))| format!("    p.{} = parameters[{k}];\n", identifier_path(path));
        let assigned: String = program.top().parameters.leaves().iter().enumerate().map(assign).collect();
        format!(
            "    stickslip_instance *instance = controller;\n    {name}_parameters p;\n{assigned}    \
             if ({name}_check(&p) != NULL) {{\n        return 1;\n    }}\n    instance->p = p;\n"
        )
    } else {
        "    (void)controller;\n    (void)parameters;\n".into()
    };
    format!("int32_t stickslip_set(void *controller, const double *parameters) {{\n{body}    return 0;\n}}\n\n")
}

fn begin_function(program: &Program, name: &str) -> String {
    let init = if has_state(program) { format!("    {name}_init(&instance->s);\n") } else { String::new() };
    format!(
        "void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {{\n    \
         stickslip_instance *instance;\n    \
         if (!(isfinite(sample_time) && (sample_time > 0.0) && isfinite(torque_limit) && (torque_limit >= 0.0))) {{\n        \
         return NULL;\n    }}\n    \
         instance = calloc(1, sizeof *instance);\n    if (instance == NULL) {{\n        return NULL;\n    }}\n    \
         instance->sample_time = sample_time;\n    instance->torque_limit = torque_limit;\n{init}    \
         if (stickslip_set(instance, parameters) != 0) {{\n        free(instance);\n        return NULL;\n    }}\n    \
         return instance;\n}}\n\n"
    )
}

fn step_function(program: &Program, name: &str) -> String {
    let members = sample();
    let assign = |(path, _): (String, _)| {
        let of_sample = || members.iter().any(|(name, _)| *name == path).then(|| format!("sample->{path}"));
        let value = signal(&path).map(str::to_owned).or_else(of_sample).unwrap_or_else(|| "0.0".into());
        format!("    in.{} = {value};\n", identifier_path(&path))
    };
    let input: String = program.top().input.leaves().into_iter().map(assign).collect();
    let arguments = [
        (is_tuned(program), "&instance->p"),
        (has_state(program), "&instance->s"),
        (true, "&in"),
        (true, "instance->sample_time"),
        (true, "&out"),
    ];
    let arguments: Vec<&str> = arguments.into_iter().filter(|it| it.0).map(|it| it.1).collect();
    format!(
        "int32_t stickslip_step(void *controller, const stickslip_sample *sample, double *torque) {{\n    \
         stickslip_instance *instance = controller;\n    {name}_input in;\n    {name}_output out;\n    \
         {name}_status status;\n{input}    status = {name}_step({});\n    *torque = out.{TORQUE};\n    \
         return (status == {}_NOT_COMPUTED) ? 1 : 0;\n}}\n\n",
        arguments.join(", "),
        name.to_uppercase()
    )
}
