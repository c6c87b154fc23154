//! The statements of a step.

use std::collections::{HashMap, HashSet};

use stickslip_core::fields::Order;

use super::idiom::{self, Idiom};
use super::kernel::Needs;
use super::plan::Plan;
use super::text::{literal, wrap};
use super::types::Types;
use super::uses::count;
use crate::record::{Function, Graph, Id, Law, LawBook, Node, Operator, Real, Source, Step};
use crate::tree::Tree;

/// Largest length of an expression that is used once and emitted at the place of its use.
const INLINE: usize = 44;
pub(super) const INDENT: &str = "    ";

/// An expression; not atomic if it needs parentheses within another.
#[derive(Clone)]
pub(super) struct Expression {
    pub(super) text: String,
    pub(super) atomic: bool,
}

/// Writes the statements of a graph one after the other.
pub(super) struct Body<'a> {
    pub(super) graph: &'a Graph,
    pub(super) uses: Vec<u32>,
    pub(super) expressions: Vec<Option<Expression>>,
    pub(super) idioms: Vec<Option<Idiom>>,
    /// Preferred names of each number, best first.
    pub(super) preferred_names: Vec<Vec<String>>,
    pub(super) used_names: HashSet<String>,
    pub(super) temporaries: usize,
    /// Operations in statements of their own: choices and their true branches are hard to read within others.
    pub(super) alone: HashSet<Id>,
    /// Operations that are used once, by a store or a return.
    pub(super) final_only: HashSet<Id>,
    /// Constant structs by type and initialiser.
    pub(super) structs: HashMap<(String, String), String>,
    /// The statements.
    pub(super) lines: String,
    /// The helper functions that it calls.
    pub(super) needs: Needs,
}

/// Context of the calls of a step.
pub(super) struct Callees<'a> {
    pub(super) steps: &'a [Step],
    pub(super) labels: &'a [String],
    pub(super) types: &'a Types,
    pub(super) prefix: &'a str,
}

/// The statements of a step, without its frame.
pub(super) fn step<'a>(real: Real, step: &'a Step, plan: &Plan, callees: &Callees<'a>) -> Body<'a> {
    let mut body = Body::new(&step.graph, plan.uses.clone());
    body.name_results(step);
    body.used_names.extend(plan.names());
    body.final_only = plan.stores.iter().map(|store| store.1).filter(|id| body.uses[id.index()] == 1).collect();
    body.load(real, &[&step.parameters, &step.state, &step.input]);
    let mut emitted = vec![false; step.graph.calls.len()];
    for position in 0..step.graph.nodes.len() {
        let id = Id(position as u32);
        if let Node::Result(call, _) = step.graph.node(id)
            && !std::mem::replace(&mut emitted[call as usize], true)
            && let Some(planned) = &plan.calls[call as usize]
        {
            body.call(real, call, planned, callees);
        }
        body.statement(real, id);
    }
    body.blank_line();
    for (place, id) in &plan.stores {
        let value = body.plain(*id);
        body.lines += &wrap(INDENT, &format!("{place} = {value};"));
    }
    body
}

/// The statements of a function of one number, ending with its return.
pub(super) fn function<'a>(real: Real, graph: &'a Graph, result: Id) -> Body<'a> {
    let mut body = Body::new(graph, count(graph, [&result]).0);
    body.final_only.insert(result);
    for (position, node) in graph.nodes.iter().enumerate() {
        if *node == Node::Source(Source::Input, 0) {
            body.expressions[position] = Some(Expression { text: "x".into(), atomic: true });
        }
        body.statement(real, Id(position as u32));
    }
    let value = body.plain(result);
    body.lines += &wrap(INDENT, &format!("return {value};"));
    body
}

/// The statements that compute values and bounds from the parameters, and each law as a condition.
pub(super) fn laws<'a>(real: Real, book: &'a LawBook, parameters: &Tree) -> (Body<'a>, Vec<String>) {
    let graph = &book.graph;
    let mut body = Body::new(graph, count(graph, book.laws.iter().flat_map(|law| [&law.value, &law.bound])).0);
    body.load(real, &[parameters]);
    (0..graph.nodes.len()).for_each(|position| body.statement(real, Id(position as u32)));
    let condition = |law: &Law| {
        let order = if law.order == Order::AtMost { "<=" } else { ">=" };
        format!("{} {order} {}", body.operand(law.value), body.operand(law.bound))
    };
    let conditions = book.laws.iter().map(condition).collect();
    (body, conditions)
}

impl<'a> Body<'a> {
    fn new(graph: &'a Graph, mut uses: Vec<u32>) -> Self {
        let idioms = idiom::find(graph, &mut uses);
        let mut alone = HashSet::new();
        for (position, node) in graph.nodes.iter().enumerate() {
            if let (Node::Select(_, yes, _), None) = (node, idioms[position]) {
                alone.extend([Id(position as u32), *yes]);
            }
        }
        Body {
            graph,
            uses,
            expressions: vec![None; graph.nodes.len()],
            idioms,
            preferred_names: vec![Vec::new(); graph.nodes.len()],
            used_names: ["p", "s", "in", "out", "dt", "x", "i"].map(String::from).into(),
            temporaries: 0,
            alone,
            final_only: HashSet::new(),
            structs: HashMap::new(),
            lines: String::new(),
            needs: Needs::default(),
        }
    }

    /// Adds an empty line.
    pub(super) fn blank_line(&mut self) {
        if !self.lines.is_empty() {
            self.lines.push('\n');
        }
    }

    pub(super) fn assign(&mut self, position: usize, text: &str, kind: &str) {
        let name = self.name(position);
        self.lines += &wrap(INDENT, &format!("const {kind} {name} = {text};"));
        self.expressions[position] = Some(Expression { text: name, atomic: true });
    }

    /// The expression on its own.
    pub(super) fn plain(&self, id: Id) -> String {
        self.expressions[id.index()].as_ref().expect("operands are emitted before their results").text.clone()
    }

    /// The expression within another one.
    fn operand(&self, id: Id) -> String {
        let expression = self.expressions[id.index()].as_ref().expect("operands are emitted before their results");
        if expression.atomic { expression.text.clone() } else { format!("({})", expression.text) }
    }

    /// Makes an expression of an operation, and a statement if it is used twice or long.
    fn statement(&mut self, real: Real, id: Id) {
        let position = id.index();
        if self.uses[position] == 0 || self.expressions[position].is_some() {
            return;
        }
        if let Some(idiom) = self.idioms[position] {
            return self.idiom(real, id, idiom);
        }
        let (text, atomic) = match self.graph.node(id) {
            Node::Constant(bits) => {
                let text = literal(real, f64::from_bits(bits));
                self.expressions[position] = Some(Expression { text, atomic: true });
                return;
            }
            Node::Source(..) | Node::Result(..) => return,
            Node::Negate(a) => (format!("-{}", self.operand(a)), false),
            Node::Apply(function, a) => {
                self.needs.function(function);
                (format!("{}({})", function_name(real, function), self.plain(a)), true)
            }
            Node::Binary(operator, a, b) => {
                let sign = match operator {
                    Operator::Add => '+',
                    Operator::Subtract => '-',
                    Operator::Multiply => '*',
                    Operator::Divide => '/',
                };
                (format!("{} {sign} {}", self.operand(a), self.operand(b)), false)
            }
            Node::Select(mask, yes, no) => {
                (format!("{} ? {} : {}", self.operand(mask), self.operand(yes), self.operand(no)), false)
            }
            Node::Truth(truth) => (truth.to_string(), true),
            Node::Less(a, b) => (format!("{} < {}", self.operand(a), self.operand(b)), false),
            // False only for NaN.
            Node::LessOrEqual(a, b) if a == b => (format!("!isnan({})", self.plain(a)), false),
            Node::LessOrEqual(a, b) => (format!("{} <= {}", self.operand(a), self.operand(b)), false),
            Node::And(a, b) => (format!("{} && {}", self.operand(a), self.operand(b)), false),
            Node::Or(a, b) => (format!("{} || {}", self.operand(a), self.operand(b)), false),
            Node::Not(a) => (format!("!{}", self.operand(a)), false),
        };
        self.put(real, id, Expression { text, atomic });
    }

    /// The call of a small function.
    fn idiom(&mut self, real: Real, id: Id, idiom: Idiom) {
        self.needs.helper(idiom.helper());
        let arguments: Vec<String> = idiom.arguments().into_iter().map(|id| self.plain(id)).collect();
        let text = format!("{}({})", idiom.helper().name(real), arguments.join(", "));
        self.put(real, id, Expression { text, atomic: true });
    }

    /// Keeps an expression for its only use, or gives it a name.
    fn put(&mut self, real: Real, id: Id, expression: Expression) {
        let short = expression.text.len() <= INLINE && !self.alone.contains(&id);
        if self.uses[id.index()] == 1 && (short || self.final_only.contains(&id)) {
            self.expressions[id.index()] = Some(expression);
        } else {
            let kind = if is_mask(self.graph.node(id)) { "bool" } else { real.c_name };
            self.assign(id.index(), &expression.text, kind);
        }
    }
}

fn is_mask(node: Node) -> bool {
    matches!(
        node,
        Node::Truth(_) | Node::Less(..) | Node::LessOrEqual(..) | Node::And(..) | Node::Or(..) | Node::Not(_)
    )
}

/// Name of a function of one number in C.
pub(crate) fn function_name(real: Real, function: Function) -> String {
    let name = match function {
        Function::Abs => return format!("fabs{}", real.c_suffix),
        Function::Exp => "exp",
        Function::Ln => "ln",
        Function::Sin => "sin",
        Function::Cos => "cos",
        Function::Round => "round",
        Function::Floor => "floor",
        Function::PowerOfTwo => "power_of_two",
        Function::Exponent => "exponent",
    };
    format!("stickslip_{name}{}", real.c_suffix)
}

/// Whether a text contains a word.
pub(super) fn mentions(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').any(|w| w == word)
}
