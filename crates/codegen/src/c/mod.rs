//! Prints a recorded block as C99.
//!
//! Each block is four structs and a function. An empty struct, which C does not have, is left out, also as an argument.
//! The code needs no heap and no library besides `fabs`; it has no loop and no branch on a signal but `?:`.

mod body;
mod kernel;
mod plan;
mod text;
mod types;

use stickslip_core::block::Block;
use stickslip_core::fields::Fields;

use crate::record::{self, Function, Precision, Program, Recorded, Step};
use crate::tree::Tree;
use body::Callees;
use types::Types;

/// A header and the source that includes it.
#[derive(Clone, Debug, PartialEq)]
pub struct CSource {
    /// `NAME.h`: the structs, and
    ///
    /// ```c
    /// void NAME_parameters_init(NAME_parameters *p);   /* the values that were given */
    /// void NAME_init(NAME_state *s);                   /* the state at the start */
    /// void NAME_step(const NAME_parameters *p, NAME_state *s, const NAME_input *in, double dt, NAME_output *out);
    /// ```
    pub header: String,
    /// `NAME.c`.
    pub source: String,
}

/// A name that C would not take.
#[derive(Clone, Debug, PartialEq)]
pub struct NotAName(
    /// The name.
    pub String,
);

impl std::fmt::Display for NotAName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "\"{}\" cannot name a C function: use letters, digits and _, a letter first, no keyword", self.0)
    }
}

impl std::error::Error for NotAName {}

/// Writes a block as C in the precision `F`, `f64` or `f32`. The choices in the parameters are made here; their numbers
/// stay open, and `NAME_parameters_init` sets them to those given.
///
/// # Errors
/// If C would not take the name.
pub fn generate<B, F>(parameters: &B, name: &str) -> Result<CSource, NotAName>
where
    F: Precision,
    B: Fields<f64>,
    B::With<Recorded<F>>: Block<Recorded<F>, Input: Default>,
{
    print::<F>(&record::record::<B, F>(parameters), name)
}

/// Writes a recorded block as C.
///
/// # Errors
/// If C would not take the name.
pub fn print<F: Precision>(program: &Program, name: &str) -> Result<CSource, NotAName> {
    if !text::is_identifier(name) {
        return Err(NotAName(name.into()));
    }
    let printer = Printer::new(program, name);
    Ok(CSource { header: printer.header::<F>(), source: printer.source::<F>() })
}

struct Printer<'a> {
    program: &'a Program,
    top: &'a Step,
    name: &'a str,
    /// What each step is called behind the prefix.
    labels: Vec<String>,
    types: Types,
}

/// Kind and tree of the structs of a step.
fn structs(step: &Step) -> [(&'static str, &Tree); 4] {
    [("parameters", &step.parameters), ("state", &step.state), ("input", &step.input), ("output", &step.output)]
}

impl<'a> Printer<'a> {
    fn new(program: &'a Program, name: &'a str) -> Self {
        let top = program.steps.last().expect("a program has at least the block itself");
        let mut types = Types::default();
        for (kind, tree) in structs(top).into_iter().filter(|(_, tree)| !tree.is_bare()) {
            types.register(format!("{name}_{kind}"), tree);
        }
        let labels = labels(&program.steps);
        for (step, label) in program.steps.iter().zip(&labels) {
            for (kind, tree) in structs(step) {
                let own = if tree.is_bare() { format!("{name}_number") } else { format!("{name}_{label}_{kind}") };
                types.register(own, tree);
            }
        }
        Printer { program, top, name, labels, types }
    }

    fn header<F: Precision>(&self) -> String {
        let (name, guard) = (self.name, format!("{}_H", self.name.to_uppercase()));
        let mut out = format!(
            "/* {}, written by stickslip. Change the model, not this file. */\n#ifndef {guard}\n#define {guard}\n\n",
            self.top.name
        );
        let mut done = Vec::new();
        for (kind, tree) in structs(self.top) {
            out += &self.types.define::<F>(tree, &mut done);
            let own = format!("{name}_{kind}");
            if let Some(shared) = self.types.name(tree).filter(|shared| *shared != own) {
                out += &format!("typedef {shared} {own};\n\n");
            }
        }
        for (about, declaration) in self.declarations::<F>() {
            out += &format!("{}{declaration};\n\n", text::comment("", &[about.into()]));
        }
        out + &format!("#endif /* {guard} */\n")
    }

    /// What each function does, and its head.
    fn declarations<F: Precision>(&self) -> Vec<(&'static str, String)> {
        let name = self.name;
        let mut out = Vec::new();
        if self.top.parameters.numbers() > 0 {
            let head = format!("void {name}_parameters_init({name}_parameters *p)");
            out.push(("Sets the parameters to those that this file was written with.", head));
        }
        if self.top.state.numbers() > 0 {
            out.push(("Sets the state to that before the first step.", format!("void {name}_init({name}_state *s)")));
        }
        let about = "One step of dt [s]. The pointers must not overlap.";
        out.push((about, self.head::<F>(self.top, &format!("{name}_"), &format!("{name}_step"))));
        out
    }

    /// The head of a step's function; its structs are called as registered, those of the block itself by its name.
    fn head<F: Precision>(&self, step: &Step, own: &str, function: &str) -> String {
        let mut arguments = Vec::new();
        for (kind, tree) in structs(step) {
            let type_name = if own.is_empty() {
                self.types.name(tree).unwrap_or_default().to_string()
            } else {
                format!("{own}{kind}")
            };
            if kind == "output" {
                arguments.push(format!("{} dt", F::C_NAME));
            }
            if tree.numbers() > 0 {
                arguments.push(match kind {
                    "parameters" => format!("const {type_name} *p"),
                    "state" => format!("{type_name} *s"),
                    "input" => format!("const {type_name} *in"),
                    _ => format!("{type_name} *out"),
                });
            }
        }
        format!("void {function}({})", arguments.join(", "))
    }

    fn source<F: Precision>(&self) -> String {
        let name = self.name;
        let mut functions = Vec::new();
        let mut steps = String::new();
        for (number, (step, label)) in self.program.steps.iter().zip(&self.labels).enumerate() {
            let last = number + 1 == self.program.steps.len();
            let head = if last {
                self.head::<F>(step, &format!("{name}_"), &format!("{name}_step"))
            } else {
                format!("static {}", self.head::<F>(step, "", &format!("{name}_{label}_step")))
            };
            if last {
                steps += &self.initialisers::<F>();
            }
            steps += &self.function::<F>(step, &head, &mut functions);
        }
        let kernels = kernel::functions::<F>(&functions);
        let mut types = String::new();
        let mut done = Vec::new();
        for (_, tree) in structs(self.top) {
            self.types.define::<F>(tree, &mut done);
        }
        for (_, tree) in self.program.steps.iter().flat_map(structs) {
            types += &self.types.define::<F>(tree, &mut done);
        }
        let code = format!("{types}{kernels}{steps}");
        format!("{}{code}", kernel::preamble(self.top.name, name, &code))
    }

    fn function<F: Precision>(&self, step: &Step, head: &str, functions: &mut Vec<Function>) -> String {
        let plan = plan::plan(step, &self.program.steps, &self.labels, &self.types);
        let callees =
            Callees { steps: &self.program.steps, labels: &self.labels, types: &self.types, prefix: self.name };
        let body = body::step::<F>(step, &plan, &callees);
        functions.extend(&body.functions);
        let mut out = format!("{} {{\n", text::wrap("", head).trim_end());
        for argument in ["p", "s", "in", "dt", "out"] {
            if body::mentions(head, argument) && !body::mentions(&body.lines, argument) {
                out += &format!("    (void){argument};\n");
            }
        }
        out + &body.lines + "}\n\n"
    }

    /// `NAME_parameters_init` and `NAME_init`.
    fn initialisers<F: Precision>(&self) -> String {
        let set = |base: &str, tree: &Tree, values: &[f64]| -> String {
            let number = |(path, value): (&String, &f64)| {
                format!("    {base}->{} = {};\n", text::path(path), text::literal::<F>(*value))
            };
            tree.paths().iter().zip(values).map(number).collect()
        };
        let mut out = String::new();
        for (_, head) in self.declarations::<F>() {
            let body = if head.contains("_parameters_init(") {
                set("p", &self.top.parameters, &self.program.parameters)
            } else if head.contains("_init(") {
                set("s", &self.top.state, &self.program.start)
            } else {
                continue;
            };
            out += &format!("{head} {{\n{body}}}\n\n");
        }
        out
    }
}

/// A name for each step: the block's, with its choices, with a number where several are called alike.
pub(crate) fn labels(steps: &[Step]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for step in steps {
        let mut label = text::snake(step.name);
        if let Tree::Group(group) = &step.parameters {
            for (_, variant) in &group.chosen {
                label += &format!("_{}", text::identifier(variant));
            }
        }
        let alike = |name: &String| out.contains(name);
        let numbered = (2..).map(|i| format!("{label}_{i}"));
        let free = std::iter::once(label.clone()).chain(numbered).find(|name| !alike(name));
        out.push(free.unwrap_or(label));
    }
    out
}
