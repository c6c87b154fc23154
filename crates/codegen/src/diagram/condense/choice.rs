//! Meaning of masks and selections: limits, signs, ranges.

use super::Reading;
use crate::diagram::{Bound, Kind, Relation};
use crate::record::{Function, Graph, Id, Node};

impl Reading<'_> {
    /// Saturation, sign, minimum, maximum.
    pub(super) fn choice(&self, id: Id, covers: &mut Vec<Id>) -> Option<(Kind, Vec<Id>)> {
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

    pub(super) fn comparison(&self, id: Id, covers: &mut Vec<Id>) -> (Kind, Vec<Id>) {
        let (relation, a, b) = match self.graph.node(id) {
            Node::Less(a, b) => (Relation::Less, a, b),
            Node::LessOrEqual(a, b) => (Relation::LessOrEqual, a, b),
            _ => unreachable!("the operation is a comparison"),
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
    pub(super) fn range(&self, id: Id, covers: &mut Vec<Id>) -> Option<(Kind, Vec<Id>)> {
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
    pub(super) fn all_of(&self, id: Id, covers: &mut Vec<Id>) -> Vec<Id> {
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

/// `min(a, b)` (true) or `max(a, b)` (false) with its mask; `b` if either is NaN.
pub(in crate::diagram) fn extreme(graph: &Graph, id: Id) -> Option<(bool, Id, Id, Id)> {
    let Node::Select(mask, a, b) = graph.node(id) else { return None };
    match graph.node(mask) {
        Node::Less(x, y) if (x, y) == (a, b) => Some((true, a, b, mask)),
        Node::Less(x, y) if (x, y) == (b, a) => Some((false, a, b, mask)),
        _ => None,
    }
}

/// The x of `sign(x)`, with the operations that it consists of.
pub(in crate::diagram) fn sign(graph: &Graph, id: Id) -> Option<(Id, [Id; 4])> {
    let is = |id: Id, value: f64| graph.constant(id).is_some_and(|v| v.to_bits() == value.to_bits());
    let Node::Select(above, one, inner) = graph.node(id) else { return None };
    let (Node::Less(zero, x), Node::Select(below, minus_one, none)) = (graph.node(above), graph.node(inner)) else {
        return None;
    };
    let same = graph.node(below) == Node::Less(x, zero);
    (same && is(one, 1.0) && is(zero, 0.0) && is(none, 0.0) && is(minus_one, -1.0))
        .then_some((x, [id, above, inner, below]))
}
