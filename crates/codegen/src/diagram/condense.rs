//! Grouping of operations to blocks of a diagram.
//!
//! Each rule keeps the bits: a sum adds from left to right, and is reordered only where addition commutes.

mod choice;

use super::{Factor, Kind};
use crate::record::{Graph, Id, Node, Operator, Source};
pub(super) use choice::{extreme, sign};

/// Most terms of one summing point.
const TERMS: usize = 6;

/// A graph with properties of each operation.
pub(super) struct Reading<'a> {
    pub(super) graph: &'a Graph,
    /// Number of uses by the live operations and the roots.
    pub(super) uses: Vec<u32>,
    /// Whether it depends on no signal.
    pub(super) fixed: Vec<bool>,
    /// Whether the call is used.
    pub(super) live: Vec<bool>,
    /// Whether it belongs to a switch of a whole bus.
    pub(super) bundled: Vec<bool>,
}

/// A drawn operation.
pub(super) struct Shape {
    pub(super) kind: Kind,
    pub(super) operands: Vec<Id>,
    pub(super) covers: Vec<Id>,
}

impl<'a> Reading<'a> {
    pub(super) fn of(graph: &'a Graph, roots: impl Iterator<Item = Id>) -> Self {
        let fixed = fixed(graph);
        let mut uses = vec![0; graph.nodes.len()];
        let mut live = vec![false; graph.calls.len()];
        roots.for_each(|root| uses[root.index()] += 1);
        for position in (0..graph.nodes.len()).rev() {
            if uses[position] == 0 {
                continue;
            }
            graph.nodes[position].operands().for_each(|operand| uses[operand.index()] += 1);
            if let Node::Result(call, _) = graph.nodes[position]
                && !std::mem::replace(&mut live[call as usize], true)
            {
                let call = &graph.calls[call as usize];
                let operands = call.parameters.iter().chain(&call.state).chain(&call.input).chain([&call.step]);
                operands.for_each(|operand| uses[operand.index()] += 1);
            }
        }
        Reading { graph, uses, fixed, live, bundled: vec![false; graph.nodes.len()] }
    }

    pub(super) fn is_fixed(&self, id: Id) -> bool {
        self.fixed[id.index()]
    }

    /// Whether a signal is used only by a pattern, which uses it this number of times.
    fn own(&self, id: Id, uses: u32) -> bool {
        !self.is_fixed(id) && self.uses[id.index()] == uses && !self.bundled[id.index()]
    }

    /// The live operations that are drawn as nodes of their own.
    pub(super) fn shapes(&self) -> Vec<Shape> {
        let mut covered_before = vec![false; self.graph.nodes.len()];
        let mut out = Vec::new();
        // Users first, so that the operations that they include are known.
        for position in (0..self.graph.nodes.len()).rev() {
            let id = Id(position as u32);
            let drawn = !matches!(self.graph.node(id), Node::Source(..) | Node::Result(..));
            if self.uses[position] == 0
                || self.is_fixed(id)
                || covered_before[position]
                || self.bundled[position]
                || !drawn
            {
                continue;
            }
            let shape = self.shape(id);
            shape.covers.iter().for_each(|covered| covered_before[covered.index()] = true);
            out.push(shape);
        }
        out.reverse();
        out
    }

    fn shape(&self, id: Id) -> Shape {
        let mut covers = Vec::new();
        let (kind, operands) = match self.graph.node(id) {
            Node::Binary(Operator::Add | Operator::Subtract, ..) => {
                let terms = self.terms(id, &mut covers, TERMS);
                (Kind::Sum(terms.iter().map(|t| t.0).collect()), terms.into_iter().map(|t| t.1).collect())
            }
            Node::Negate(_) | Node::Binary(..) => match self.factors(id, &mut covers) {
                Some((signal, factors)) => (Kind::Gain(factors), vec![signal]),
                None => {
                    let terms = self.product(id, &mut covers);
                    (Kind::Product(terms.iter().map(|t| t.0).collect()), terms.into_iter().map(|t| t.1).collect())
                }
            },
            Node::Apply(function, a) => (Kind::Apply(function), vec![a]),
            Node::Select(mask, yes, no) => self.choice(id, &mut covers).unwrap_or((Kind::Switch, vec![mask, yes, no])),
            Node::Not(a) => (Kind::Not, vec![a]),
            Node::Less(..) | Node::LessOrEqual(..) => self.comparison(id, &mut covers),
            Node::And(..) => match self.range(id, &mut covers) {
                Some(range) => range,
                None => (Kind::And, self.all_of(id, &mut covers)),
            },
            Node::Or(..) => (Kind::Or, self.all_of(id, &mut covers)),
            Node::Source(..) | Node::Constant(_) | Node::Result(..) | Node::Truth(_) => {
                unreachable!("only operations on signals are requested")
            }
        };
        if !covers.contains(&id) {
            covers.push(id);
        }
        Shape { kind, operands, covers }
    }

    fn is_sum(&self, id: Id) -> bool {
        self.own(id, 1) && matches!(self.graph.node(id), Node::Binary(Operator::Add | Operator::Subtract, ..))
    }

    fn terms(&self, id: Id, covers: &mut Vec<Id>, most: usize) -> Vec<(bool, Id)> {
        let Node::Binary(operator, a, b) = self.graph.node(id) else { unreachable!("the operation is a sum") };
        covers.push(id);
        let minus = operator == Operator::Subtract;
        let swapped = !minus && !self.is_sum(a) && self.is_sum(b);
        let (first, second) = if swapped { (b, a) } else { (a, b) };
        let mut terms = if self.is_sum(first) && most > 2 {
            self.terms(first, covers, most - 1)
        } else {
            vec![self.term(false, first, covers)]
        };
        terms.push(self.term(minus, second, covers));
        terms
    }

    fn term(&self, minus: bool, id: Id, covers: &mut Vec<Id>) -> (bool, Id) {
        match self.graph.node(id) {
            Node::Negate(inner) if self.own(id, 1) => {
                covers.push(id);
                (!minus, inner)
            }
            _ => (minus, id),
        }
    }

    /// A signal with the fixed factors behind it; `None` if the last operation is not such a factor.
    fn factors(&self, id: Id, covers: &mut Vec<Id>) -> Option<(Id, Vec<Factor>)> {
        let (signal, factor) = match self.graph.node(id) {
            Node::Negate(a) => (a, Factor::Negated),
            Node::Binary(Operator::Multiply, a, b) if self.is_fixed(a) => (b, Factor::Times(a)),
            Node::Binary(Operator::Multiply, a, b) if self.is_fixed(b) => (a, Factor::Times(b)),
            Node::Binary(Operator::Divide, a, b) if self.is_fixed(b) => (a, Factor::Over(b)),
            _ => return None,
        };
        covers.push(id);
        let inner = if self.own(signal, 1) { self.factors(signal, covers) } else { None };
        let (signal, mut factors) = inner.unwrap_or((signal, Vec::new()));
        factors.push(factor);
        Some((signal, factors))
    }

    fn is_product(&self, id: Id) -> bool {
        let signals = |a, b| !self.is_fixed(a) && !self.is_fixed(b);
        self.own(id, 1)
            && match self.graph.node(id) {
                Node::Binary(Operator::Multiply | Operator::Divide, a, b) => signals(a, b),
                _ => false,
            }
    }

    fn product(&self, id: Id, covers: &mut Vec<Id>) -> Vec<(bool, Id)> {
        let Node::Binary(operator, a, b) = self.graph.node(id) else { unreachable!("the operation is a product") };
        covers.push(id);
        let over = operator == Operator::Divide;
        let swapped = !over && !self.is_product(a) && self.is_product(b);
        let (first, second) = if swapped { (b, a) } else { (a, b) };
        let mut out = if self.is_product(first) { self.product(first, covers) } else { vec![(false, first)] };
        out.push((over, second));
        out
    }
}

/// The operations that depend on no signal.
pub(super) fn fixed(graph: &Graph) -> Vec<bool> {
    let mut fixed = Vec::with_capacity(graph.nodes.len());
    for node in &graph.nodes {
        fixed.push(match node {
            Node::Source(source, _) => matches!(source, Source::Parameters | Source::Step),
            Node::Result(..) => false,
            _ => node.operands().all(|operand: Id| fixed[operand.index()]),
        });
    }
    fixed
}
