//! Directional derivatives of a step, as C: each operation with its slope, as a dual number has them.
//!
//!   u = f(a, b):   u̇ = ∂f/∂a·ȧ + ∂f/∂b·ḃ
//!
//! along one direction of parameters, state and input. The values are computed by the operations of the block's own
//! code, so that each choice is the same; at a jump or kink the slope is that of the current side, and rounding to a
//! grid has the slope 0, as in `stickslip_core::scalar::Dual`.

use std::fmt::Write;

use crate::c::{function_name, literal};
use crate::record::{Function, Graph, Id, Node, Operator, Program, Real, Source, Step};

/// Functions for all steps of a program, that of the block last, and `fmu_tangent`, which is that of the block.
pub(super) fn functions(program: &Program) -> String {
    let mut out = String::from(
        "/* Directional derivatives of a step: each value v with its slope t. Of vectors, x' is named dx. Called \
         rarely, slow to optimise. */\n#if defined(__GNUC__) && !defined(__clang__)\n#pragma GCC \
         push_options\n#pragma GCC \
         optimize(\"O0\")\n#endif\n\n",
    );
    for (number, step) in program.steps.iter().enumerate() {
        out += &function(number, step, &program.steps);
    }
    let top = program.steps.len() - 1;
    let end = "#if defined(__GNUC__) && !defined(__clang__)\n#pragma GCC pop_options\n#endif";
    writeln!(out, "#define fmu_tangent fmu_tangent_{top}\n\n{end}\n").expect("writing to a String cannot fail");
    out
}

const ARGUMENTS: &str = "const double *p, const double *dp, const double *s, const double *ds, const double *in, const double \
                         *din, const double dt, double *ns, double *dns, double *out, double *dout";

/// The statements of one step.
struct Writer<'a> {
    graph: &'a Graph,
    steps: &'a [Step],
    /// Whether each number has a slope that may differ from 0.
    moves: Vec<bool>,
    out: String,
}

fn function(number: usize, step: &Step, steps: &[Step]) -> String {
    let graph = &step.graph;
    let mut writer = Writer { graph, steps, moves: vec![false; graph.nodes.len()], out: String::new() };
    let mut emitted = vec![false; graph.calls.len()];
    for position in 0..graph.nodes.len() {
        let id = Id(position as u32);
        if let Node::Result(call, _) = graph.node(id)
            && !std::mem::replace(&mut emitted[call as usize], true)
        {
            writer.call(call as usize);
        }
        writer.statement(id);
    }
    for (name, ids) in [("ns", &step.new_state), ("out", &step.results)] {
        for (k, id) in ids.iter().enumerate() {
            let (value, slope) = (writer.value(*id), writer.slope(*id));
            writer.line(format_args!("{name}[{k}] = {value}; d{name}[{k}] = {slope};"));
        }
    }
    let unused = "    (void)p; (void)dp; (void)s; (void)ds; (void)in; (void)din; (void)dt; (void)ns; (void)dns; (void)out; \
                  (void)dout;\n";
    format!("static void fmu_tangent_{number}({ARGUMENTS}) {{\n{unused}{}}}\n\n", writer.out)
}

impl Writer<'_> {
    fn line(&mut self, text: std::fmt::Arguments<'_>) {
        writeln!(self.out, "    {text}").expect("writing to a String cannot fail");
    }

    fn value(&self, id: Id) -> String {
        match self.graph.node(id) {
            Node::Constant(bits) => literal(Real::DOUBLE, f64::from_bits(bits)),
            Node::Source(Source::Step, _) => "dt".into(),
            Node::Source(source, number) => format!("{}[{number}]", array(source)),
            Node::Truth(truth) => u8::from(truth).to_string(),
            _ => format!("v{}", id.0),
        }
    }

    fn slope(&self, id: Id) -> String {
        match self.graph.node(id) {
            _ if !self.moves[id.index()] => "0.0".into(),
            Node::Source(source, number) => format!("d{}[{number}]", array(source)),
            _ => format!("t{}", id.0),
        }
    }

    /// A value, and its slope if it may have one.
    fn define(&mut self, id: Id, value: &str, slope: Option<String>) {
        self.moves[id.index()] = slope.is_some();
        let number = id.0;
        match slope {
            Some(slope) => self.line(format_args!("const double v{number} = {value}, t{number} = {slope};")),
            None => self.line(format_args!("const double v{number} = {value};")),
        }
    }

    fn mask(&mut self, id: Id, condition: &str) {
        self.line(format_args!("const int v{} = {condition};", id.0));
    }

    fn statement(&mut self, id: Id) {
        let number = id.0;
        let moves = |id: Id| self.moves[id.index()];
        match self.graph.node(id) {
            Node::Source(source, _) => self.moves[id.index()] = source != Source::Step,
            Node::Constant(_) | Node::Truth(_) => {}
            Node::Result(call, result) => {
                let state = self.steps[self.graph.calls[call as usize].function].new_state.len();
                let (array, k) =
                    if (result as usize) < state { ("n", result as usize) } else { ("o", result as usize - state) };
                let slope = Some(format!("c{call}d{array}[{k}]"));
                self.define(id, &format!("c{call}{array}[{k}]"), slope);
            }
            Node::Negate(a) => {
                let slope = moves(a).then(|| format!("-{}", self.slope(a)));
                self.define(id, &format!("-({})", self.value(a)), slope);
            }
            Node::Apply(function, a) => {
                let (x, dx) = (self.value(a), self.slope(a));
                let slope = match function {
                    Function::Abs => Some(format!("(double)(({x} > 0.0) - ({x} < 0.0)) * {dx}")),
                    Function::Exp => Some(format!("{}({x}) * {dx}", function_name(Real::DOUBLE, function))),
                    Function::Ln => Some(format!("{dx} / {x}")),
                    Function::Sin => Some(format!("cos({x}) * {dx}")),
                    Function::Cos => Some(format!("-sin({x}) * {dx}")),
                    Function::Round | Function::Floor | Function::PowerOfTwo | Function::Exponent => None,
                };
                let slope = slope.filter(|_| moves(a));
                self.define(id, &format!("{}({x})", function_name(Real::DOUBLE, function)), slope);
            }
            Node::Binary(operator, a, b) => self.binary(id, operator, a, b),
            Node::Select(mask, yes, no) => {
                let choice = |yes: String, no: String| format!("{} ? {yes} : {no}", self.value(mask));
                let slope = (moves(yes) || moves(no)).then(|| choice(self.slope(yes), self.slope(no)));
                let value = choice(self.value(yes), self.value(no));
                self.define(id, &value, slope);
            }
            Node::Less(a, b) => self.mask(id, &format!("{} < {}", self.value(a), self.value(b))),
            Node::LessOrEqual(a, b) => self.mask(id, &format!("{} <= {}", self.value(a), self.value(b))),
            Node::And(a, b) => self.mask(id, &format!("{} && {}", self.value(a), self.value(b))),
            Node::Or(a, b) => self.mask(id, &format!("{} || {}", self.value(a), self.value(b))),
            Node::Not(a) => self.mask(id, &format!("!{}", self.value(a))),
        }
        // Unused values are not an error.
        if !matches!(self.graph.node(id), Node::Source(..) | Node::Constant(_) | Node::Truth(_)) {
            let slope = if self.moves[id.index()] { format!(" (void)t{number};") } else { String::new() };
            self.line(format_args!("(void)v{number};{slope}"));
        }
    }

    fn binary(&mut self, id: Id, operator: Operator, a: Id, b: Id) {
        let (x, y) = (self.value(a), self.value(b));
        let [dx, dy] = [a, b].map(|id| self.moves[id.index()].then(|| self.slope(id)));
        let negative = |text: String| format!("-{text}");
        let sum = |one: Option<String>, other: Option<String>| match (one, other) {
            (Some(one), Some(other)) => Some(format!("{one} + {other}")),
            (one, other) => one.or(other),
        };
        let (sign, slope) = match operator {
            Operator::Add => ('+', sum(dx, dy)),
            Operator::Subtract => ('-', sum(dx, dy.map(negative))),
            Operator::Multiply => {
                ('*', sum(dx.map(|dx| format!("{dx} * ({y})")), dy.map(|dy| format!("({x}) * {dy}"))))
            }
            Operator::Divide => {
                let of_y = dy.map(|dy| format!("-(({x}) / ({y})) * {dy}"));
                ('/', sum(dx, of_y).map(|sum| format!("({sum}) / ({y})")))
            }
        };
        self.define(id, &format!("({x}) {sign} ({y})"), slope);
    }

    /// The step of another block: its arguments with their slopes, and space for its results.
    fn call(&mut self, number: usize) {
        let call = &self.graph.calls[number];
        let callee = &self.steps[call.function];
        for (name, ids) in [("p", &call.parameters), ("s", &call.state), ("i", &call.input)] {
            let list = |of: &dyn Fn(Id) -> String| {
                let all: Vec<String> = ids.iter().map(|id| of(*id)).collect();
                // C has no empty list.
                if all.is_empty() { "0.0".into() } else { all.join(", ") }
            };
            let (values, slopes) = (list(&|id| self.value(id)), list(&|id| self.slope(id)));
            self.line(format_args!(
                "const double c{number}{name}[] = {{{values}}}, c{number}d{name}[] = {{{slopes}}};"
            ));
        }
        let sizes = [("n", callee.new_state.len().max(1)), ("o", callee.results.len().max(1))];
        for (name, size) in sizes {
            self.line(format_args!("double c{number}{name}[{size}], c{number}d{name}[{size}];"));
        }
        let step = self.value(call.step);
        let c = format!("c{number}");
        self.line(format_args!(
            "fmu_tangent_{}({c}p, {c}dp, {c}s, {c}ds, {c}i, {c}di, {step}, {c}n, {c}dn, {c}o, {c}do);",
            call.function
        ));
    }
}

/// Name of the array of a struct.
fn array(source: Source) -> &'static str {
    match source {
        Source::Parameters => "p",
        Source::State => "s",
        Source::Input => "in",
        Source::Step => "dt",
    }
}
