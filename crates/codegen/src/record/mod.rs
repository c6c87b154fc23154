//! Numbers that record their operations.

mod declared;
mod evaluate;
mod graph;
mod laws;
mod program;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

use stickslip_core::block::Block;
use stickslip_core::scalar::{Mask, Scalar};

pub use declared::{Computed, Declared, Given, Signature, record_declared};
pub use graph::{Call, Function, Graph, Id, Node, Operator, Source};
pub use laws::{Law, LawBook};
use program::node;
pub(crate) use program::record_function;
pub use program::{Program, Step, record};

/// The recorded arithmetic: `f64` or `f32`.
pub trait Precision: Scalar<Mask = bool> + Into<f64> {
    /// Name of the type in C.
    const C_NAME: &'static str;
    /// Suffix of its literals and functions in C.
    const C_SUFFIX: &'static str;
    /// The shortest text that reads back to the same number.
    fn text(self) -> String;
}

impl Precision for f64 {
    const C_NAME: &'static str = "double";
    const C_SUFFIX: &'static str = "";
    fn text(self) -> String {
        format!("{self:?}")
    }
}

impl Precision for f32 {
    const C_NAME: &'static str = "float";
    const C_SUFFIX: &'static str = "f";
    fn text(self) -> String {
        format!("{self:?}")
    }
}

/// A precision as a value: the code that prints is compiled once for both.
#[derive(Clone, Copy)]
pub(crate) struct Real {
    /// [`Precision::C_NAME`].
    pub(crate) c_name: &'static str,
    /// [`Precision::C_SUFFIX`].
    pub(crate) c_suffix: &'static str,
    /// [`Precision::text`] of the nearest number.
    pub(crate) text: fn(f64) -> String,
    /// Adds an operation to a graph.
    add: fn(&mut Graph, Node) -> Id,
    /// The nearest number to the first in double precision, to the second in single precision.
    round: fn(f64, f64) -> f64,
}

impl Real {
    pub(crate) const DOUBLE: Real = Real::of::<f64>();

    pub(crate) const fn of<F: Precision>() -> Self {
        Real {
            c_name: F::C_NAME,
            c_suffix: F::C_SUFFIX,
            text: |value| F::of(value).text(),
            add: Graph::add::<F>,
            round: |double, single| F::by_precision(double, single).into(),
        }
    }

    /// The nearest number of the precision.
    pub(crate) fn nearest(self, value: f64) -> f64 {
        (self.round)(value, value)
    }
}

/// As in C: `double`.
impl std::fmt::Display for Real {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.c_name)
    }
}

/// A number of a block during its recording, in the precision of the recording. It is valid within [`record`];
/// elsewhere its arithmetic panics.
///
/// Each operation is a call of one function that is not inlined: the code of a block over recorded numbers runs only
/// once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded {
    id: Id,
}

/// The outcome of a comparison of [`Recorded`] numbers.
#[derive(Clone, Copy, Debug)]
pub struct RecordedMask {
    id: Id,
}

impl Recorded {
    fn new(operation: Node) -> Self {
        Recorded { id: node(operation) }
    }

    #[inline(never)]
    fn binary(self, operator: Operator, other: Self) -> Self {
        Self::new(Node::Binary(operator, self.id, other.id))
    }

    #[inline(never)]
    fn apply(self, function: Function) -> Self {
        Self::new(Node::Apply(function, self.id))
    }
}

impl RecordedMask {
    fn new(operation: Node) -> Self {
        RecordedMask { id: node(operation) }
    }
}

/// Zero.
impl Default for Recorded {
    fn default() -> Self {
        Self::of(0.0)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $operator:ident) => {
        impl $trait for Recorded {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self.binary(Operator::$operator, other)
            }
        }
    };
}

macro_rules! assign {
    ($trait:ident, $method:ident, $operator:ident) => {
        impl $trait for Recorded {
            fn $method(&mut self, other: Self) {
                *self = self.binary(Operator::$operator, other);
            }
        }
    };
}

operator!(Add, add, Add);
operator!(Sub, sub, Subtract);
operator!(Mul, mul, Multiply);
operator!(Div, div, Divide);
assign!(AddAssign, add_assign, Add);
assign!(SubAssign, sub_assign, Subtract);
assign!(MulAssign, mul_assign, Multiply);

impl Neg for Recorded {
    type Output = Self;
    #[inline(never)]
    fn neg(self) -> Self {
        Self::new(Node::Negate(self.id))
    }
}

impl BitAnd for RecordedMask {
    type Output = Self;
    #[inline(never)]
    fn bitand(self, other: Self) -> Self {
        Self::new(Node::And(self.id, other.id))
    }
}

impl BitOr for RecordedMask {
    type Output = Self;
    #[inline(never)]
    fn bitor(self, other: Self) -> Self {
        Self::new(Node::Or(self.id, other.id))
    }
}

impl Not for RecordedMask {
    type Output = Self;
    #[inline(never)]
    fn not(self) -> Self {
        Self::new(Node::Not(self.id))
    }
}

impl Mask<Recorded> for RecordedMask {
    #[inline(never)]
    fn select(self, yes: Recorded, no: Recorded) -> Recorded {
        Recorded::new(Node::Select(self.id, yes.id, no.id))
    }
}

impl Scalar for Recorded {
    type Mask = RecordedMask;

    fn of(value: f64) -> Self {
        program::constant(value, value)
    }

    fn by_precision(double: f64, single: f64) -> Self {
        program::constant(double, single)
    }

    #[inline(never)]
    fn lt(self, other: Self) -> RecordedMask {
        RecordedMask::new(Node::Less(self.id, other.id))
    }

    #[inline(never)]
    fn le(self, other: Self) -> RecordedMask {
        RecordedMask::new(Node::LessOrEqual(self.id, other.id))
    }

    fn abs(self) -> Self {
        self.apply(Function::Abs)
    }

    fn power_of_two(self) -> Self {
        self.apply(Function::PowerOfTwo)
    }

    fn exponent(self) -> Self {
        self.apply(Function::Exponent)
    }

    fn ln(self) -> Self {
        self.apply(Function::Ln)
    }

    fn exp(self) -> Self {
        self.apply(Function::Exp)
    }

    fn sin(self) -> Self {
        self.apply(Function::Sin)
    }

    fn cos(self) -> Self {
        self.apply(Function::Cos)
    }

    fn round(self) -> Self {
        self.apply(Function::Round)
    }

    fn floor(self) -> Self {
        self.apply(Function::Floor)
    }

    fn call<B: Block<Self>>(block: &B, state: &mut B::State, input: B::Input, dt: Self) -> B::Output {
        program::call(block, state, input, dt)
    }
}
