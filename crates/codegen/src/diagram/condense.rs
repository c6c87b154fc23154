//! Which operations together are one block of a diagram.
//!
//! Each rule keeps the bits: a sum adds from left to right, and is turned round only where addition commutes.

use super::{Bound, Factor, Kind, Relation};
use crate::record::{Function, Graph, Id, Node, Operator, Source};

/// Most terms of one summing point.
const TERMS: usize = 6;

/// A graph with what is known of each operation.
pub(super) struct Reading<'a> {
    pub(super) graph: &'a Graph,
    /// How often the live operations and the roots use it.
    pub(super) uses: Vec<u32>,
    /// Whether it depends on no signal.
    pub(super) fixed: Vec<bool>,
    /// Whether anybody needs the call.
    pub(super) live: Vec<bool>,
    /// Whether it belongs to a switch of a whole bus.
    pub(super) bundled: Vec<bool>,
}

/// An operation as it is drawn.
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

    /// Whether nobody else than a pattern, which uses it so many times, needs a signal.
    fn own(&self, id: Id, uses: u32) -> bool {
        !self.is_fixed(id) && self.uses[id.index()] == uses && !self.bundled[id.index()]
    }

    /// The live operations that are drawn as nodes of their own.
    pub(super) fn shapes(&self) -> Vec<Shape> {
        let mut taken = vec![false; self.graph.nodes.len()];
        let mut out = Vec::new();
        // Users first, so that what they take in is known.
        for position in (0..self.graph.nodes.len()).rev() {
            let id = Id(position as u32);
            let drawn = !matches!(self.graph.node(id), Node::Source(..) | Node::Result(..));
            if self.uses[position] == 0 || self.is_fixed(id) || taken[position] || self.bundled[position] || !drawn {
                continue;
            }
            let shape = self.shape(id);
            shape.covers.iter().for_each(|covered| taken[covered.index()] = true);
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
                unreachable!("only operations on signals are asked for")
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
        let Node::Binary(operator, a, b) = self.graph.node(id) else { unreachable!("a sum was asked for") };
        covers.push(id);
        let minus = operator == Operator::Subtract;
        let turned = !minus && !self.is_sum(a) && self.is_sum(b);
        let (first, second) = if turned { (b, a) } else { (a, b) };
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

    /// A signal with the fixed factors behind it; `None` if the last operation is no such factor.
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
        let Node::Binary(operator, a, b) = self.graph.node(id) else { unreachable!("a product was asked for") };
        covers.push(id);
        let over = operator == Operator::Divide;
        let turned = !over && !self.is_product(a) && self.is_product(b);
        let (first, second) = if turned { (b, a) } else { (a, b) };
        let mut out = if self.is_product(first) { self.product(first, covers) } else { vec![(false, first)] };
        out.push((over, second));
        out
    }

    /// Saturation, sign, minimum, maximum.
    fn choice(&self, id: Id, covers: &mut Vec<Id>) -> Option<(Kind, Vec<Id>)> {
        let graph = self.graph;
        if let Some((x, inner)) = sign(graph, id)
            && inner[1..].iter().all(|id| self.own(*id, 1))
        {
            covers.extend(inner);
            return Some((Kind::Sign, vec![x]));
        }
        let (smaller, a, b, mask) = extreme(graph, id)?;
        if !self.own(mask, 1) {
            return None;
        }
        covers.extend([id, mask]);
        if smaller
            && self.own(b, 2)
            && let Some((false, low, x, inner)) = extreme(graph, b)
            && self.own(inner, 1)
            && !self.is_fixed(x)
        {
            covers.extend([b, inner]);
            let mut operands = vec![x];
            let low = match graph.node(low) {
                _ if self.is_fixed(low) => Bound::Fixed(low),
                Node::Negate(opposite) if opposite == a && self.own(low, 2) => {
                    covers.push(low);
                    Bound::Opposite
                }
                _ => {
                    operands.push(low);
                    Bound::Signal
                }
            };
            let high = if self.is_fixed(a) {
                Bound::Fixed(a)
            } else {
                operands.push(a);
                Bound::Signal
            };
            return Some((Kind::Saturation { low, high }, operands));
        }
        Some((if smaller { Kind::Minimum } else { Kind::Maximum }, vec![a, b]))
    }

    fn comparison(&self, id: Id, covers: &mut Vec<Id>) -> (Kind, Vec<Id>) {
        let (relation, a, b) = match self.graph.node(id) {
            Node::Less(a, b) => (Relation::Less, a, b),
            Node::LessOrEqual(a, b) => (Relation::LessOrEqual, a, b),
            _ => unreachable!("a comparison was asked for"),
        };
        covers.push(id);
        let (signal, bound) = match (self.is_fixed(a), self.is_fixed(b)) {
            (false, false) => return (Kind::Compare(relation), vec![a, b]),
            (true, _) => (b, (relation.reversed(), a)),
            (_, true) => (a, (relation, b)),
        };
        let (magnitude, signal) = match self.graph.node(signal) {
            Node::Apply(Function::Abs, inner) if self.own(signal, 1) => {
                covers.push(signal);
                (true, inner)
            }
            _ => (false, signal),
        };
        (Kind::Within { magnitude, bounds: vec![bound] }, vec![signal])
    }

    /// Two bounds of one signal.
    fn range(&self, id: Id, covers: &mut Vec<Id>) -> Option<(Kind, Vec<Id>)> {
        let Node::And(a, b) = self.graph.node(id) else { return None };
        let is_comparison = |id| matches!(self.graph.node(id), Node::Less(..) | Node::LessOrEqual(..));
        if !(self.own(a, 1) && self.own(b, 1) && is_comparison(a) && is_comparison(b)) {
            return None;
        }
        let mut inner = vec![id];
        let (first, second) = (self.comparison(a, &mut inner), self.comparison(b, &mut inner));
        match (first, second) {
            (
                (Kind::Within { magnitude, mut bounds }, signal),
                (Kind::Within { magnitude: same, bounds: more }, other),
            ) if magnitude == same && signal == other => {
                bounds.extend(more);
                covers.extend(inner);
                Some((Kind::Within { magnitude, bounds }, signal))
            }
            _ => None,
        }
    }

    /// The operands of an `and` or `or` of several.
    fn all_of(&self, id: Id, covers: &mut Vec<Id>) -> Vec<Id> {
        covers.push(id);
        let node = self.graph.node(id);
        let alike = |other: Node| std::mem::discriminant(&other) == std::mem::discriminant(&node);
        let part = |operand: Id| {
            if self.own(operand, 1) && alike(self.graph.node(operand)) {
                self.all_of(operand, covers)
            } else {
                vec![operand]
            }
        };
        node.operands().collect::<Vec<_>>().into_iter().flat_map(part).collect()
    }
}

/// Which operations depend on no signal.
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

/// `min(a, b)` (true) or `max(a, b)` (false) with its mask; `b` if either is NaN.
pub(super) fn extreme(graph: &Graph, id: Id) -> Option<(bool, Id, Id, Id)> {
    let Node::Select(mask, a, b) = graph.node(id) else { return None };
    match graph.node(mask) {
        Node::Less(x, y) if (x, y) == (a, b) => Some((true, a, b, mask)),
        Node::Less(x, y) if (x, y) == (b, a) => Some((false, a, b, mask)),
        _ => None,
    }
}

/// The x of `sign(x)`, with the operations that it consists of.
pub(super) fn sign(graph: &Graph, id: Id) -> Option<(Id, [Id; 4])> {
    let is = |id: Id, value: f64| graph.constant(id).is_some_and(|v| v.to_bits() == value.to_bits());
    let Node::Select(above, one, inner) = graph.node(id) else { return None };
    let (Node::Less(zero, x), Node::Select(below, minus_one, none)) = (graph.node(above), graph.node(inner)) else {
        return None;
    };
    let same = graph.node(below) == Node::Less(x, zero);
    (same && is(one, 1.0) && is(zero, 0.0) && is(none, 0.0) && is(minus_one, -1.0))
        .then_some((x, [id, above, inner, below]))
}
