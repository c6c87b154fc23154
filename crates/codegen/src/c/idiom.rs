//! Maximum, minimum, clamp, sign: several operations written as one call.

use super::text::literal;
use crate::record::{Graph, Id, Node, Real};

/// Several operations under their name in `stickslip_core::scalar::Scalar`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Idiom {
    Max(Id, Id),
    Min(Id, Id),
    /// The number, then the limits.
    Clamp(Id, Id, Id),
    Sign(Id),
}

/// The C function of an [`Idiom`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Helper {
    Max,
    Min,
    Clamp,
    Sign,
}

impl Idiom {
    pub(super) fn helper(self) -> Helper {
        match self {
            Idiom::Max(..) => Helper::Max,
            Idiom::Min(..) => Helper::Min,
            Idiom::Clamp(..) => Helper::Clamp,
            Idiom::Sign(_) => Helper::Sign,
        }
    }

    pub(super) fn arguments(self) -> Vec<Id> {
        match self {
            Idiom::Max(a, b) | Idiom::Min(a, b) => vec![a, b],
            Idiom::Clamp(x, low, high) => vec![x, low, high],
            Idiom::Sign(x) => vec![x],
        }
    }
}

impl Helper {
    pub(super) fn name(self, real: Real) -> String {
        let name = match self {
            Helper::Max => "max",
            Helper::Min => "min",
            Helper::Clamp => "clamp",
            Helper::Sign => "sign",
        };
        format!("stickslip_{name}{}", real.c_suffix)
    }

    /// The function, as in `Scalar`.
    pub(super) fn definition(self, real: Real) -> String {
        let name = self.name(real);
        let (zero, one, minus) = (literal(real, 0.0), literal(real, 1.0), literal(real, -1.0));
        let (about, arguments, body) = match self {
            Helper::Max => ("The larger; b if either is NaN.", "a b", "    return (b < a) ? a : b;\n".to_string()),
            Helper::Min => ("The smaller; b if either is NaN.", "a b", "    return (a < b) ? a : b;\n".to_string()),
            Helper::Clamp => (
                "x, limited to low ... high; NaN stays NaN.",
                "x low high",
                format!(
                    "    const {real} raised = (x < low) ? low : x;\n    return (high < raised) ? high : raised;\n"
                ),
            ),
            Helper::Sign => (
                "-1, 0 or 1; 0 for NaN.",
                "x",
                format!(
                    "    const {real} negative = (x < {zero}) ? {minus} : {zero};\n    \
                     return ({zero} < x) ? {one} : negative;\n"
                ),
            ),
        };
        let arguments: Vec<String> = arguments.split(' ').map(|a| format!("{real} {a}")).collect();
        format!("/* {about} */\nstatic {real} {name}({}) {{\n{body}}}\n\n", arguments.join(", "))
    }
}

/// Finds them, and removes the operations that they replace from the counts of uses.
pub(super) fn find(graph: &Graph, uses: &mut [u32]) -> Vec<Option<Idiom>> {
    let mut idioms = vec![None; graph.nodes.len()];
    for (position, node) in graph.nodes.iter().enumerate() {
        let Node::Select(mask, yes, no) = *node else { continue };
        let Node::Less(a, b) = graph.node(mask) else { continue };
        if uses[position] == 0 {
            continue;
        }
        let idiom = if (yes, no) == (b, a) {
            Some(Idiom::Max(b, a))
        } else if (yes, no) == (a, b) {
            Some(Idiom::Min(a, b))
        } else if is_sign(graph, (a, b), yes, no) {
            Some(Idiom::Sign(b))
        } else {
            None
        };
        if let Some(Idiom::Sign(_)) = idiom {
            // The number itself, which the inner choice used, is still used.
            release(graph, uses, no);
            uses[b.index()] += 1;
        }
        if idiom.is_some() {
            release(graph, uses, mask);
        }
        idioms[position] = match idiom {
            Some(Idiom::Min(high, raised)) if uses[raised.index()] == 1 => match idioms[raised.index()] {
                Some(Idiom::Max(low, x)) => {
                    uses[raised.index()] = 0;
                    Some(Idiom::Clamp(x, low, high))
                }
                _ => idiom,
            },
            _ => idiom,
        };
    }
    idioms
}

/// `0 < x ? 1 : (x < 0 ? -1 : 0)`.
fn is_sign(graph: &Graph, (zero, x): (Id, Id), yes: Id, no: Id) -> bool {
    let is = |id: Id, value: f64| graph.constant(id).is_some_and(|v| v.to_bits() == value.to_bits());
    let Node::Select(mask, minus, zero_branch) = graph.node(no) else { return false };
    let below = graph.node(mask) == Node::Less(x, zero);
    is(zero, 0.0) && is(yes, 1.0) && below && is(minus, -1.0) && is(zero_branch, 0.0)
}

/// One use less; an unused operation uses no operands.
fn release(graph: &Graph, uses: &mut [u32], id: Id) {
    uses[id.index()] -= 1;
    if uses[id.index()] == 0 {
        graph.node(id).operands().for_each(|operand| release(graph, uses, operand));
    }
}
