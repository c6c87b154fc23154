//! Prints a recorded block as C99.
//!
//! Each block is four structs and a function. Empty structs, which C does not have, are omitted, also as arguments. The
//! code needs no heap and no library besides `fabs`; it has no loop and no branch on a signal but `?:`.

mod body;
mod call;
mod check;
mod example;
mod excitation;
mod guard;
mod idiom;
mod interface;
mod kernel;
mod names;
mod page;
mod plan;
mod project;
mod prose;
mod ready;
mod selftest;
mod text;
mod types;
mod uses;
mod vectors;

use sha2::{Digest as _, Sha256};
use stickslip_core::block::Block;
use stickslip_core::fields::Fields;

use crate::record::{self, Precision, Program, Real, Recorded, Step};
use crate::tree::Tree;
use body::Callees;
pub(crate) use body::function_name;
pub(crate) use check::string;
use kernel::Needs;
pub use project::{Project, project, project_of};
pub(crate) use prose::plain;
pub use ready::Ready;
pub(crate) use text::{literal, path as identifier_path};
use types::Types;

/// Deviations from MISRA C:2012, with reasons. The page of a project states them; a test compares them with the
/// findings of cppcheck.
pub const DEVIATIONS: [(&str, &str); 1] = [(
    "19.2",
    "A union shows the bits of a floating-point number as an integer, which C99 defines (6.5.2.3); the exponential and \
     the self-test need it.",
)];

/// A header and the source that includes it.
#[derive(Clone, Debug, PartialEq)]
pub struct CSource {
    /// `NAME.h`: the structs, and
    ///
    /// ```c
    /// void NAME_parameters_init(NAME_parameters *p);       /* the values at code generation */
    /// const char *NAME_check(const NAME_parameters *p);    /* NULL, or the first fault */
    /// void NAME_init(NAME_state *s);                       /* the state at the start */
    /// NAME_status NAME_step(const NAME_parameters *p, NAME_state *s, const NAME_input *in, double dt,
    ///                       NAME_output *out);             /* stickslip_core::block::guarded */
    /// extern const char NAME_epk[];                        /* `epk` */
    /// ```
    pub header: String,
    /// `NAME.c`.
    pub source: String,
    /// Identification of the code: version, name and a hash of the rest of both files. It is `NAME_epk` in a program;
    /// calibration tools compare it with their description.
    pub epk: String,
}

/// A name that is not valid in C.
#[derive(Clone, Debug, PartialEq)]
pub struct NotAName(
    /// The name.
    pub String,
);

impl std::fmt::Display for NotAName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "\"{}\" is not a valid name of a C function: use letters, digits and _, a letter first, no \
            keyword",
            self.0
        )
    }
}

impl std::error::Error for NotAName {}

/// Writes a block as C in the precision `F`, `f64` or `f32`. The choices in the parameters are fixed here; their
/// numbers stay variable, and `NAME_parameters_init` sets them to the values of the block.
///
/// # Errors
/// If the name is not valid in C.
pub fn generate<B, F>(parameters: &B, name: &str) -> Result<CSource, NotAName>
where
    F: Precision,
    B: Fields<f64>,
    B::With<Recorded>: Block<Recorded, Input: Default>,
{
    print_in(Real::of::<F>(), &record::record::<B, F>(parameters), name)
}

/// Writes a recorded block as C.
///
/// # Errors
/// If the name is not valid in C.
pub fn print<F: Precision>(program: &Program, name: &str) -> Result<CSource, NotAName> {
    print_in(Real::of::<F>(), program, name)
}

fn print_in(real: Real, program: &Program, name: &str) -> Result<CSource, NotAName> {
    if !text::is_identifier(name) {
        return Err(NotAName(name.into()));
    }
    let printer = Printer::new(program, name);
    let (header, source) = (printer.header(real), printer.source(real));
    let hash = Sha256::new().chain_update(&header).chain_update(&source).finalize();
    let hash: String = hash[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    let epk = format!("stickslip {} {name} {hash}", env!("CARGO_PKG_VERSION"));
    let (declaration, definition) = interface::epk(name, &epk);
    // The declaration is before the end of the guard.
    let end = header.rfind("#endif").expect("a header is guarded");
    let header = format!("{}{declaration}{}", &header[..end], &header[end..]);
    Ok(CSource { header, source: source + &definition, epk })
}

struct Printer<'a> {
    program: &'a Program,
    top: &'a Step,
    name: &'a str,
    /// Name of each step after the prefix.
    labels: Vec<String>,
    types: Types,
}

/// Kind and tree of the structs of a step.
fn structs(step: &Step) -> [(&'static str, &Tree); 4] {
    [("parameters", &step.parameters), ("state", &step.state), ("input", &step.input), ("output", &step.output)]
}

impl<'a> Printer<'a> {
    fn new(program: &'a Program, name: &'a str) -> Self {
        let top = program.top();
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

    /// The head of a step's function: the text before the parenthesis, then the arguments.
    fn head(&self, real: Real, step: &Step, function: &str) -> String {
        let mut arguments = Vec::new();
        for (kind, tree) in structs(step) {
            let type_name = if std::ptr::eq(step, self.top) {
                format!("{}_{kind}", self.name)
            } else {
                self.types.name(tree).unwrap_or_default().to_string()
            };
            if kind == "output" {
                arguments.push(format!("{} dt", real.c_name));
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
        format!("{function}({})", arguments.join(", "))
    }

    fn source(&self, real: Real) -> String {
        let name = self.name;
        let mut needs = Needs::default();
        let mut steps = String::new();
        for (step, label) in self.program.steps.iter().zip(&self.labels) {
            let label = if std::ptr::eq(step, self.top) { "raw" } else { label };
            let head = self.head(real, step, &format!("static void {name}_{label}_step"));
            steps += &prose::comment("", &prose::plain(step.help));
            steps += &self.function(real, step, &head, &mut needs);
        }
        for function in self.interface(real) {
            needs.extend(&function.needs);
            steps += &format!("{} {{\n{}}}\n\n", text::wrap("", &function.head).trim_end(), function.body);
        }
        let kernels = kernel::functions(real, &needs);
        let mut types = String::new();
        let mut defined = Vec::new();
        for (_, tree) in structs(self.top) {
            self.types.define(real, tree, &mut defined);
        }
        for (_, tree) in self.program.steps.iter().flat_map(structs) {
            types += &self.types.define(real, tree, &mut defined);
        }
        let code = format!("{types}{kernels}{}{steps}", check::functions(real, self.program));
        format!("{}{code}", kernel::preamble(self.top.name, name, &code))
    }

    fn function(&self, real: Real, step: &Step, head: &str, needs: &mut Needs) -> String {
        let plan = plan::plan(step, &self.program.steps, &self.labels, &self.types);
        let callees =
            Callees { steps: &self.program.steps, labels: &self.labels, types: &self.types, prefix: self.name };
        let body = body::step(real, step, &plan, &callees);
        needs.extend(&body.needs);
        let mut out = format!("{} {{\n", text::wrap("", head).trim_end());
        for argument in ["p", "s", "in", "dt", "out"] {
            if body::mentions(head, argument) && !body::mentions(&body.lines, argument) {
                out += &format!("    (void){argument};\n");
            }
        }
        out + &body.lines + "}\n\n"
    }
}

/// A name for each step: the block's, with its choices, with a number if several have the same name.
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
