//! A block as an FMU: a model for tools with FMI 2.0 or 3.0 (co-simulation).
//!
//! The FMU is the C code of [`c::project`](crate::c::project) with the functions of the standard. Its variables are the
//! numbers of the block: `input.…`, `output.…`, `parameters.…` (tunable) and `state.…`, each with its unit, range,
//! value and documentation from the tables of the fields. Its step size is that of the block, for any communication
//! steps of the importer. FMI 2.0.4 and 3.0.1, <https://fmi-standard.org>.

mod derivative;
mod description;
mod service;
mod units;

use std::fmt::Write as _;

use stickslip_core::fields::Field;

pub use service::{EPK, EVENT, FOLDER, MAX_CTO, MAX_DTO, NUMBERS, Service};

use crate::c::{Project, identifier_path};
use crate::record::Step;
use crate::tree::Tree;

/// A version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

impl Version {
    /// Number of the version: `2` or `3`.
    pub fn number(self) -> u32 {
        match self {
            Version::Two => 2,
            Version::Three => 3,
        }
    }

    /// Folder and ending of a library for this machine, as named in the standard; `None` if it has no name for the
    /// machine.
    pub fn platform(self) -> Option<(&'static str, &'static str)> {
        match (std::env::consts::OS, std::env::consts::ARCH, self) {
            ("linux", "x86_64", Version::Two) => Some(("linux64", "so")),
            ("linux", "x86_64", Version::Three) => Some(("x86_64-linux", "so")),
            ("linux", "aarch64", Version::Three) => Some(("aarch64-linux", "so")),
            ("windows", "x86_64", Version::Two) => Some(("win64", "dll")),
            ("windows", "x86_64", Version::Three) => Some(("x86_64-windows", "dll")),
            ("macos", "x86_64" | "aarch64", Version::Two) => Some(("darwin64", "dylib")),
            ("macos", "x86_64", Version::Three) => Some(("x86_64-darwin", "dylib")),
            ("macos", "aarch64", Version::Three) => Some(("aarch64-darwin", "dylib")),
            _ => None,
        }
    }

    fn functions(self) -> (&'static str, &'static str) {
        match self {
            Version::Two => ("fmi2.c", include_str!("fmi2.c")),
            Version::Three => ("fmi3.c", include_str!("fmi3.c")),
        }
    }
}

/// The files of an FMU except its library, and the sources of the library.
#[derive(Clone, Debug, PartialEq)]
pub struct Fmu {
    /// Name of the library.
    pub name: String,
    /// Version of the standard.
    pub version: Version,
    /// Names and texts: `modelDescription.xml`, the sources, the page about the block.
    pub files: Vec<(String, String)>,
    /// The files to compile, with `sources` as the folder of headers.
    pub sources: Vec<String>,
}

/// Role of a variable for an importer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    Input,
    Output,
    Parameter,
    State,
}

/// A number of the block.
struct Variable {
    role: Role,
    /// Path in C, within its struct: `drive.load_inertia`.
    path: String,
    /// Name for importers: `parameters.drive.load_inertia`.
    name: String,
    field: &'static Field,
    /// Value before the first step; meaningless for an output.
    start: f64,
}

impl Role {
    /// Name of the struct in C, within the model, and for importers.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Role::Input => ("in", "input"),
            Role::Output => ("out", "output"),
            Role::Parameter => ("p", "parameters"),
            Role::State => ("s", "state"),
        }
    }
}

/// Makes an FMU of a project in `double`, called `name`, with steps of `step` [s]; with a `service` it serves XCP, and
/// the caller adds its description `NAME.a2l` to [`FOLDER`].
pub fn fmu(project: &Project, name: &str, step: f64, version: Version, service: Option<&Service>) -> Fmu {
    let top = project.program.top();
    let variables = variables(project, top);
    let code = |ending: &str| project.file(&format!("{name}.{ending}")).expect("each project has it").to_owned();
    let (functions, text) = version.functions();
    let described = |token: &str| description::model(top, name, token, step, version, &variables, service);
    // The token of library and description is a hash of all their sources.
    let parts = [include_str!("service.h"), include_str!("xcp.h"), include_str!("xcp_slave.h")];
    let shared = [include_str!("instance.h"), include_str!("fmi.h")];
    let token = token(&[&described(""), &code("h"), &code("c"), text, &shared.concat(), &parts.concat()]);
    // One translation unit: the derivatives call the helper functions of the block.
    let sources = vec![functions.to_owned()];
    let mut files = vec![
        ("modelDescription.xml".into(), described(&token)),
        (format!("sources/{name}.h"), code("h")),
        (format!("sources/{name}.c"), code("c")),
        ("sources/model.h".into(), model(top, name, &token, step, &variables, service)),
        ("sources/derivative.h".into(), derivative::functions(&project.program)),
        ("sources/instance.h".into(), shared[0].into()),
        ("sources/fmi.h".into(), shared[1].into()),
        (format!("sources/{functions}"), text.into()),
        ("documentation/README.md".into(), project.file("README.md").unwrap_or_default().into()),
        ("documentation/index.html".into(), description::page(top, name, step)),
    ];
    if let Some(service) = service {
        for (file, text) in ["service.h", "xcp.h", "xcp_slave.h"].into_iter().zip(parts) {
            files.push((format!("sources/{file}"), text.into()));
        }
        files.push((format!("{FOLDER}/fmi-ls-manifest.xml"), service::manifest(&format!("{name}.a2l"))));
        files.push(("documentation/fmi-ls-xcp.html".into(), service::page(name, service)));
    }
    if version == Version::Three {
        files.push(("sources/buildDescription.xml".into(), description::build(name, &sources, service)));
    }
    Fmu { name: name.into(), version, files, sources: sources.iter().map(|file| format!("sources/{file}")).collect() }
}

/// Inputs, outputs, parameters, states: their value references are 1, 2, 3, …
fn variables(project: &Project, top: &Step) -> Vec<Variable> {
    let of = |role: Role, tree: &Tree, starts: Option<&[f64]>| {
        let leaves = tree.leaves().into_iter().enumerate();
        let variable = |(k, (path, field)): (usize, (String, &'static Field))| {
            let path = identifier_path(&path);
            let start = starts.map_or_else(|| field.default.clamp(field.minimum, field.maximum), |starts| starts[k]);
            Variable { role, name: format!("{}.{}", role.names().1, indexed(&path)), path, field, start }
        };
        leaves.map(variable).collect::<Vec<_>>()
    };
    [
        of(Role::Input, &top.input, None),
        of(Role::Output, &top.output, None),
        of(Role::Parameter, &top.parameters, Some(&project.program.parameters)),
        of(Role::State, &top.state, Some(&project.program.start)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// `table[0][1]` as FMI writes it: `table[0,1]`.
fn indexed(path: &str) -> String {
    path.replace("][", ",")
}

/// `{8-4-4-4-12}` hexadecimal digits as a hash of texts (FNV-1a, 128 bits).
fn token(texts: &[&str]) -> String {
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013B;
    let bytes = texts.iter().flat_map(|text| text.bytes().chain([0]));
    let hash = bytes.fold(0x6C62_272E_07BB_0142_62B8_2175_6295_C58D, |hash: u128, byte| {
        (hash ^ u128::from(byte)).wrapping_mul(PRIME)
    });
    let digits = format!("{hash:032x}");
    let parts = [&digits[..8], &digits[8..12], &digits[12..16], &digits[16..20], &digits[20..]];
    format!("{{{}}}", parts.join("-"))
}

/// `model.h`: the block in the form that `instance.h` requires.
fn model(top: &Step, name: &str, token: &str, step: f64, variables: &[Variable], service: Option<&Service>) -> String {
    // In the order of C.
    let parts = [
        (Role::Parameter, "parameters", &top.parameters),
        (Role::State, "state", &top.state),
        (Role::Input, "input", &top.input),
        (Role::Output, "output", &top.output),
    ];
    let exists = |role: Role| parts.iter().any(|(other, _, tree)| *other == role && tree.numbers() > 0);
    let mut out = format!(
        "/* {} as a model of FMI, written by stickslip. */\n#ifndef FMU_MODEL_H\n#define FMU_MODEL_H\n\n\
         #include \"{name}.c\"\n\n#define FMU_TOKEN \"{token}\"\n#define FMU_STEP {step:?}\n#define FMU_COUNT {}U\n{}\n\
         typedef struct {{\n",
        top.name,
        variables.len(),
        service.map_or_else(String::new, |service| service.definitions(name)),
    );
    let mut put = |text: std::fmt::Arguments<'_>| out.write_fmt(text).expect("writing to a String cannot fail");
    for (role, kind, _) in parts.iter().filter(|(.., tree)| tree.numbers() > 0) {
        put(format_args!("    {name}_{kind} {};\n", role.names().0));
    }
    let sizes = parts.each_ref().map(|(.., tree)| tree.numbers());
    put(format_args!(
        "}} fmu_model;\n\n/* Numbers of parameters, state, inputs, outputs. */\n#define FMU_PARAMETERS {}U\n#define FMU_STATES \
         {}U\n#define FMU_INPUTS {}U\n#define FMU_OUTPUTS {}U\n\n#include \"derivative.h\"\n\n",
        sizes[0], sizes[1], sizes[2], sizes[3]
    ));
    put(format_args!("static const fmu_variable FMU_VARIABLES[] = {{\n"));
    for Variable { role, path, name, .. } in variables {
        let kind = format!("{role:?}").to_uppercase();
        put(format_args!("    {{offsetof(fmu_model, {}.{path}), FMU_{kind}, \"{name}\"}},\n", role.names().0));
    }
    put(format_args!(
        "}};\n\nstatic void fmu_start(fmu_model *model) {{\n    (void)memset(model, 0, sizeof *model);\n"
    ));
    if exists(Role::Parameter) {
        put(format_args!("    {name}_parameters_init(&model->p);\n"));
    }
    if exists(Role::State) {
        put(format_args!("    {name}_init(&model->s);\n"));
    }
    for Variable { path, start, .. } in variables.iter().filter(|it| it.role == Role::Input && it.start != 0.0) {
        put(format_args!("    model->in.{path} = {start:?};\n"));
    }
    put(format_args!("}}\n\nstatic const char *fmu_check(const fmu_model *model) {{\n"));
    if exists(Role::Parameter) {
        put(format_args!("    return {name}_check(&model->p);\n}}\n\n"));
    } else {
        put(format_args!("    (void)model;\n    return NULL;\n}}\n\n"));
    }
    let arguments = [
        (exists(Role::Parameter), "&model->p"),
        (exists(Role::State), "&model->s"),
        (exists(Role::Input), "&model->in"),
        (true, "FMU_STEP"),
        (exists(Role::Output), "&model->out"),
    ];
    let arguments: Vec<&str> = arguments.into_iter().filter(|it| it.0).map(|it| it.1).collect();
    put(format_args!(
        "/* Not 0 if the step was not computed. */\nstatic int fmu_step(fmu_model *model) {{\n    return \
         {name}_step({}) == \
         {}_NOT_COMPUTED;\n}}\n\n#endif /* FMU_MODEL_H */\n",
        arguments.join(", "),
        name.to_uppercase()
    ));
    out
}

#[cfg(test)]
mod tests;
