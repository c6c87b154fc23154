//! The operations of a block on numbers, each stored once.

use std::collections::HashMap;

use super::Precision;

/// A number or a truth value of a graph: its position there. Operands are before their results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id(pub u32);

impl Id {
    /// As an index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Source of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// The parameters.
    Parameters,
    /// The state before the step.
    State,
    /// The input.
    Input,
    /// The time step.
    Step,
}

/// Functions of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Function {
    /// Magnitude.
    Abs,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Ln,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Nearest whole number.
    Round,
    /// Largest whole number not above.
    Floor,
    /// 2^k.
    PowerOfTwo,
    /// The whole k with 2^k ≤ |x| < 2^(k+1).
    Exponent,
}

/// Arithmetic on two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operator {
    /// a + b
    Add,
    /// a − b
    Subtract,
    /// a · b
    Multiply,
    /// a / b
    Divide,
}

/// One operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    /// An argument: struct and place.
    Source(Source, u32),
    /// A constant: the bits of its `f64`; single precision is exact in it.
    Constant(u64),
    /// −a
    Negate(Id),
    /// A function of a.
    Apply(Function, Id),
    /// Arithmetic.
    Binary(Operator, Id, Id),
    /// The mask, the result if it is true, and the result if it is false.
    Select(Id, Id, Id),
    /// A result of a call: call and place; first the new state, then the output.
    Result(u32, u32),
    /// A constant mask.
    Truth(bool),
    /// a < b
    Less(Id, Id),
    /// a ≤ b
    LessOrEqual(Id, Id),
    /// Both masks.
    And(Id, Id),
    /// Either mask.
    Or(Id, Id),
    /// The negated mask.
    Not(Id),
}

impl Node {
    /// Its operands; of a result, none: see its [`Call`].
    pub fn operands(self) -> impl Iterator<Item = Id> {
        let list = match self {
            Node::Source(..) | Node::Constant(_) | Node::Result(..) | Node::Truth(_) => [None; 3],
            Node::Negate(a) | Node::Apply(_, a) | Node::Not(a) => [Some(a), None, None],
            Node::Binary(_, a, b) | Node::Less(a, b) | Node::LessOrEqual(a, b) | Node::And(a, b) | Node::Or(a, b) => {
                [Some(a), Some(b), None]
            }
            Node::Select(mask, yes, no) => [Some(mask), Some(yes), Some(no)],
        };
        list.into_iter().flatten()
    }
}

/// A step of another block within this one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Call {
    /// Index of the function of the program.
    pub function: usize,
    /// Its parameters.
    pub parameters: Vec<Id>,
    /// Its state before the step.
    pub state: Vec<Id>,
    /// Its input.
    pub input: Vec<Id>,
    /// Its time step.
    pub step: Id,
}

/// The operations of one step, operands first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// The operations.
    pub nodes: Vec<Node>,
    /// The steps of other blocks, in order.
    pub calls: Vec<Call>,
    ids: HashMap<Node, Id>,
    call_numbers: HashMap<Call, u32>,
}

impl Graph {
    /// The operation at a position.
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id.index()]
    }

    /// The value of a constant.
    pub fn constant(&self, id: Id) -> Option<f64> {
        if let Node::Constant(bits) = self.node(id) { Some(f64::from_bits(bits)) } else { None }
    }

    /// The position of an operation, which is added unless it exists or follows from constants.
    pub(super) fn add<F: Precision>(&mut self, node: Node) -> Id {
        match self.simplify::<F>(node) {
            Simple::Is(id) => id,
            Simple::Needs(node) => self.intern(node),
        }
    }

    fn intern(&mut self, node: Node) -> Id {
        *self.ids.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            Id(u32::try_from(self.nodes.len() - 1).expect("a graph of 2³² operations does not fit into memory"))
        })
    }

    /// The number of a call, which is added unless an equal one exists: a step has no effects except its results.
    pub(super) fn call(&mut self, call: Call) -> u32 {
        *self.call_numbers.entry(call.clone()).or_insert_with(|| {
            self.calls.push(call);
            u32::try_from(self.calls.len() - 1).expect("fewer calls than operations")
        })
    }

    /// Only rules that keep the bits of every result except NaN.
    fn simplify<F: Precision>(&self, node: Node) -> Simple {
        let value = |id: Id| self.constant(id).map(F::of);
        let is = |id: Id, expected: f64| self.constant(id).is_some_and(|v| v.to_bits() == expected.to_bits());
        let folded = |number: F| {
            let number: f64 = number.into();
            // The sign of a NaN differs between machines: it is computed by the machine.
            if number.is_nan() { Simple::Needs(node) } else { Simple::Needs(Node::Constant(number.to_bits())) }
        };
        let truth = |id: Id| if let Node::Truth(truth) = self.node(id) { Some(truth) } else { None };
        match node {
            Node::Negate(a) => match (value(a), self.node(a)) {
                (Some(a), _) => folded(-a),
                (None, Node::Negate(inner)) => Simple::Is(inner),
                _ => Simple::Needs(node),
            },
            Node::Apply(function, a) => match value(a) {
                Some(a) => folded(apply(function, a)),
                None => Simple::Needs(node),
            },
            Node::Binary(operator, a, b) => match (operator, value(a), value(b)) {
                (_, Some(a), Some(b)) => folded(match operator {
                    Operator::Add => a + b,
                    Operator::Subtract => a - b,
                    Operator::Multiply => a * b,
                    Operator::Divide => a / b,
                }),
                // x − 0 is x for every x; x + 0 is not, for −0.
                (Operator::Multiply | Operator::Divide, None, _) if is(b, 1.0) => Simple::Is(a),
                (Operator::Subtract, None, _) if is(b, 0.0) => Simple::Is(a),
                (Operator::Multiply, _, None) if is(a, 1.0) => Simple::Is(b),
                _ => Simple::Needs(node),
            },
            Node::Select(mask, yes, no) => match truth(mask) {
                Some(truth) => Simple::Is(if truth { yes } else { no }),
                None if yes == no => Simple::Is(yes),
                None => Simple::Needs(node),
            },
            Node::Less(a, b) => match (value(a), value(b)) {
                (Some(a), Some(b)) => Simple::Needs(Node::Truth(a.lt(b))),
                _ => Simple::Needs(node),
            },
            Node::LessOrEqual(a, b) => match (value(a), value(b)) {
                (Some(a), Some(b)) => Simple::Needs(Node::Truth(a.le(b))),
                _ => Simple::Needs(node),
            },
            Node::And(a, b) => match (truth(a), truth(b)) {
                (Some(false), _) | (_, Some(true)) => Simple::Is(a),
                (_, Some(false)) | (Some(true), _) => Simple::Is(b),
                _ => Simple::Needs(node),
            },
            Node::Or(a, b) => match (truth(a), truth(b)) {
                (Some(true), _) | (_, Some(false)) => Simple::Is(a),
                (_, Some(true)) | (Some(false), _) => Simple::Is(b),
                _ => Simple::Needs(node),
            },
            Node::Not(a) => match (truth(a), self.node(a)) {
                (Some(truth), _) => Simple::Needs(Node::Truth(!truth)),
                (None, Node::Not(inner)) => Simple::Is(inner),
                _ => Simple::Needs(node),
            },
            Node::Source(..) | Node::Constant(_) | Node::Result(..) | Node::Truth(_) => Simple::Needs(node),
        }
    }
}

enum Simple {
    Is(Id),
    Needs(Node),
}

pub(super) fn apply<F: Precision>(function: Function, a: F) -> F {
    match function {
        Function::Abs => a.abs(),
        Function::Exp => a.exp(),
        Function::Ln => a.ln(),
        Function::Sin => a.sin(),
        Function::Cos => a.cos(),
        Function::Round => a.round(),
        Function::Floor => a.floor(),
        Function::PowerOfTwo => a.power_of_two(),
        Function::Exponent => a.exponent(),
    }
}
