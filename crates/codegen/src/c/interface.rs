//! The interface of a block: the structs, and the functions on them.

use std::ops::Range;

use super::kernel::Needs;
use super::{Printer, check, guard, prose, structs, text};
use crate::record::Real;
use crate::tree::Tree;

/// A public function.
pub(super) struct Public {
    /// Its description, in paragraphs.
    pub(super) about: Vec<String>,
    /// Its declaration, without the semicolon.
    pub(super) head: String,
    /// Its statements.
    pub(super) body: String,
    /// The helper functions that these call.
    pub(super) needs: Needs,
}

impl Printer<'_> {
    /// `NAME.h`.
    pub(super) fn header(&self, real: Real) -> String {
        let (name, guard) = (self.name, format!("{}_H", self.name.to_uppercase()));
        let mut out = format!(
            "/* {}, written by stickslip. Change the model, not this file. */\n#ifndef {guard}\n#define {guard}\n\n",
            self.top.name
        );
        let mut defined = Vec::new();
        for (kind, tree) in structs(self.top) {
            out += &self.types.define(real, tree, &mut defined);
            let own = format!("{name}_{kind}");
            if let Some(shared) = self.types.name(tree).filter(|shared| *shared != own) {
                out += &format!("typedef {shared} {own};\n\n");
            }
        }
        out += &guard::status(name);
        for function in self.interface(real) {
            out +=
                &format!("{}{};\n\n", prose::comment("", &function.about), text::wrap("", &function.head).trim_end());
        }
        out + &format!("#endif /* {guard} */\n")
    }

    /// The public functions.
    pub(super) fn interface(&self, real: Real) -> Vec<Public> {
        let name = self.name;
        let mut out = Vec::new();
        let mut add = |about: &str, head: String, (body, needs): (String, Needs)| {
            out.push(Public { about: prose::plain(about), head, body, needs });
        };
        if self.top.parameters.numbers() > 0 {
            add(
                "Sets the parameters to their values at code generation.",
                format!("void {name}_parameters_init({name}_parameters *p)"),
                (set(real, name, "p", &self.top.parameters, &self.program.parameters), Needs::default()),
            );
            add(
                "Returns NULL, or the first fault of the parameters.",
                format!("const char *{name}_check(const {name}_parameters *p)"),
                check::body(real, self.program),
            );
        }
        if self.top.state.numbers() > 0 {
            add(
                "Sets the state to its initial value.",
                format!("void {name}_init({name}_state *s)"),
                (set(real, name, "s", &self.top.state, &self.program.start), Needs::default()),
            );
        }
        add(
            &format!(
                "{}\n\nOne step of dt [s]. Output and state are finite after it for any input. The pointers must not \
                 overlap.",
                self.top.help
            ),
            self.head(real, self.top, &format!("{name}_status {name}_step")),
            (guard::body(real, name, self.top, &self.types), Needs::default()),
        );
        out
    }
}

/// The identification of the code in a program: declaration and definition.
pub(super) fn epk(name: &str, text: &str) -> (String, String) {
    let about = "Identification of this code. A calibration tool compares it with that of its description; a linker \
    that drops unused symbols must be configured to keep it.";
    let length = text.len() + 1;
    let declaration =
        format!("{}extern const char {name}_epk[{length}];\n\n", prose::comment("", &prose::plain(about)));
    (declaration, format!("const char {name}_epk[{length}] =\n    \"{text}\";\n"))
}

/// Longest line.
const WIDTH: usize = 120;
/// Fewest equal elements of a list that are set in a loop.
const LOOP: usize = 3;

/// Most zeros that are set one by one.
const ZEROS: usize = 3;

/// Statements that set a struct of the block `name`, by its pointer: each number, equal elements of a list in a loop.
/// State and outputs are set to 0 as a whole first, if many of their numbers are; parameters are all visible.
pub(super) fn set(real: Real, name: &str, pointer: &str, tree: &Tree, values: &[f64]) -> String {
    let is_zero = |value: f64| value.to_bits() == 0;
    let kind = match pointer {
        "p" => "parameters",
        "s" => "state",
        _ => "output",
    };
    let at_once = kind != "parameters" && values.iter().filter(|value| is_zero(**value)).count() > ZEROS;
    let mut out = if at_once { format!("    *{pointer} = ({name}_{kind}){{ 0 }};\n") } else { String::new() };
    let (paths, mut at) = (tree.paths(), 0);
    while at < paths.len() {
        if at_once && is_zero(values[at]) {
            at += 1;
            continue;
        }
        let value = text::literal(real, values[at]);
        let equal = |place: &usize| values[*place].to_bits() == values[at].to_bits();
        let count = element(&paths[at]).map_or(1, |(list, first)| {
            let follows = |place: &usize| element(&paths[*place]) == Some((list, first + place - at));
            (at..paths.len()).take_while(|place| equal(place) && follows(place)).count()
        });
        match element(&paths[at]) {
            Some((list, first)) if count >= LOOP => {
                out += &for_each(&format!("{pointer}->{}", text::path(list)), first..first + count, &value);
                at += count;
            }
            _ => {
                out += &format!("    {pointer}->{} = {value};\n", text::path(&paths[at]));
                at += 1;
            }
        }
    }
    out
}

/// The loop that sets these elements of a list.
fn for_each(list: &str, elements: Range<usize>, value: &str) -> String {
    let head = format!("    for (int k = {}; k < {}; k++) {{", elements.start, elements.end);
    let body = format!("{list}[k] = {value};");
    if head.len() + body.len() < WIDTH - 3 {
        format!("{head} {body} }}\n")
    } else {
        format!("{head}\n        {body}\n    }}\n")
    }
}

/// List and index of an element.
fn element(path: &str) -> Option<(&str, usize)> {
    let (list, index) = path.strip_suffix(']')?.rsplit_once('[')?;
    Some((list, index.parse().ok()?))
}
