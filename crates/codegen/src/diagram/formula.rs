//! Operations as formulas.

use super::condense::{extreme, sign};
use super::text;
use crate::record::{Function, Graph, Id, Node, Operator, Source, Step};

/// Longest formula; the rest is `…`.
const LONGEST: usize = 400;

/// Binding strength of an operation.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Strength {
    Choice,
    Comparison,
    Sum,
    Product,
    Whole,
}

/// An operation as a formula: `T/(T_1 + T)`. `T` is the time step. `names` returns the names of signals; without a
/// name, the formula continues with the operands.
pub fn formula(step: &Step, id: Id, name: &dyn Fn(Id) -> Option<String>) -> String {
    let names = text::names(&step.parameters);
    Writer { graph: &step.graph, names: &names, name, left: std::cell::Cell::new(LONGEST) }.write(id).0
}

struct Writer<'a> {
    graph: &'a Graph,
    names: &'a [String],
    name: &'a dyn Fn(Id) -> Option<String>,
    /// Remaining number of characters; shared operations would grow without limit.
    left: std::cell::Cell<usize>,
}

impl Writer<'_> {
    fn at_least(&self, id: Id, strength: Strength) -> String {
        let (text, own) = self.write(id);
        if own < strength { format!("({text})") } else { text }
    }

    fn call(&self, function: &str, arguments: &[Id]) -> (String, Strength) {
        let arguments: Vec<String> = arguments.iter().map(|a| self.write(*a).0).collect();
        (format!("{function}({})", arguments.join(", ")), Strength::Whole)
    }

    fn write(&self, id: Id) -> (String, Strength) {
        let known = (self.name)(id);
        let Some(left) = self.left.get().checked_sub(known.as_ref().map_or(2, String::len)) else {
            return ("…".into(), Strength::Whole);
        };
        self.left.set(left);
        if let Some(known) = known {
            return (known, Strength::Whole);
        }
        let infix = |a, sign: &str, b, strength: Strength, right: Strength| {
            (format!("{}{sign}{}", self.at_least(a, strength), self.at_least(b, right)), strength)
        };
        match self.graph.node(id) {
            Node::Source(Source::Parameters, place) => (self.names[place as usize].clone(), Strength::Whole),
            Node::Source(Source::Step, _) => ("T".into(), Strength::Whole),
            Node::Source(source, place) => (format!("{source:?}[{place}]").to_lowercase(), Strength::Whole),
            Node::Result(call, place) => (format!("call {call}[{place}]"), Strength::Whole),
            Node::Constant(bits) => {
                let negative = f64::from_bits(bits) < 0.0;
                (text::number(f64::from_bits(bits)), if negative { Strength::Sum } else { Strength::Whole })
            }
            Node::Truth(truth) => (truth.to_string(), Strength::Whole),
            Node::Negate(a) => (format!("−{}", self.at_least(a, Strength::Product)), Strength::Sum),
            Node::Apply(function, a) => self.apply(function, a),
            Node::Binary(Operator::Add, a, b) => infix(a, " + ", b, Strength::Sum, Strength::Sum),
            Node::Binary(Operator::Subtract, a, b) => infix(a, " − ", b, Strength::Sum, Strength::Product),
            Node::Binary(Operator::Multiply, a, b) => infix(a, "·", b, Strength::Product, Strength::Product),
            Node::Binary(Operator::Divide, a, b) => infix(a, "/", b, Strength::Product, Strength::Whole),
            Node::Less(a, b) => infix(a, " < ", b, Strength::Comparison, Strength::Sum),
            Node::LessOrEqual(a, b) => infix(a, " ≤ ", b, Strength::Comparison, Strength::Sum),
            Node::And(a, b) => infix(a, " and ", b, Strength::Choice, Strength::Choice),
            Node::Or(a, b) => infix(a, " or ", b, Strength::Choice, Strength::Choice),
            Node::Not(a) => (format!("not {}", self.at_least(a, Strength::Whole)), Strength::Comparison),
            Node::Select(mask, yes, no) => {
                if let Some((x, _)) = sign(self.graph, id) {
                    return self.call("sgn", &[x]);
                }
                if let Some((smaller, a, b, _)) = extreme(self.graph, id) {
                    return self.call(if smaller { "min" } else { "max" }, &[a, b]);
                }
                let [yes, mask, no] = [yes, mask, no].map(|part| self.at_least(part, Strength::Comparison));
                (format!("{yes} if {mask} else {no}"), Strength::Choice)
            }
        }
    }

    fn apply(&self, function: Function, a: Id) -> (String, Strength) {
        match function {
            Function::Abs => (format!("|{}|", self.write(a).0), Strength::Whole),
            Function::Exp => self.call("exp", &[a]),
            Function::Ln => self.call("ln", &[a]),
            Function::Sin => self.call("sin", &[a]),
            Function::Cos => self.call("cos", &[a]),
            Function::Round => self.call("round", &[a]),
            Function::Floor => self.call("floor", &[a]),
            Function::PowerOfTwo => (format!("2^{}", self.at_least(a, Strength::Whole)), Strength::Product),
            Function::Exponent => self.call("exponent", &[a]),
        }
    }
}
