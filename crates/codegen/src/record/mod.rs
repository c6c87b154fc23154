//! Numbers that remember where they come from.

mod declared;
mod evaluate;
mod graph;
mod laws;
mod program;

use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

use stickslip_core::block::Block;
use stickslip_core::scalar::{Mask, Scalar};

pub use declared::{Computed, Declared, Given, Signature, record_declared};
pub use graph::{Call, Function, Graph, Id, Node, Operator, Source};
pub use laws::{Law, LawBook};
use program::node;
pub use program::{Program, Step, record, record_function};

/// The arithmetic that is recorded: `f64` or `f32`.
pub trait Precision: Scalar<Mask = bool> + Into<f64> {
    /// What C calls it.
    const C_NAME: &'static str;
    /// What stands behind its literals and functions in C.
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

/// A number of a block that is being recorded. It lives within [`record`]; elsewhere its arithmetic panics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded<F> {
    id: Id,
    precision: PhantomData<F>,
}

/// The outcome of a comparison of [`Recorded`] numbers.
#[derive(Clone, Copy, Debug)]
pub struct RecordedMask<F> {
    id: Id,
    precision: PhantomData<F>,
}

impl<F: Precision> Recorded<F> {
    fn new(operation: Node) -> Self {
        Recorded { id: node::<F>(operation), precision: PhantomData }
    }

    fn binary(self, operator: Operator, other: Self) -> Self {
        Self::new(Node::Binary(operator, self.id, other.id))
    }
}

impl<F: Precision> RecordedMask<F> {
    fn new(operation: Node) -> Self {
        RecordedMask { id: node::<F>(operation), precision: PhantomData }
    }
}

/// Zero.
impl<F: Precision> Default for Recorded<F> {
    fn default() -> Self {
        Self::of(0.0)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $operator:ident) => {
        impl<F: Precision> $trait for Recorded<F> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self.binary(Operator::$operator, other)
            }
        }
    };
}

macro_rules! assign {
    ($trait:ident, $method:ident, $operator:ident) => {
        impl<F: Precision> $trait for Recorded<F> {
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

impl<F: Precision> Neg for Recorded<F> {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(Node::Negate(self.id))
    }
}

impl<F: Precision> BitAnd for RecordedMask<F> {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self::new(Node::And(self.id, other.id))
    }
}

impl<F: Precision> BitOr for RecordedMask<F> {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self::new(Node::Or(self.id, other.id))
    }
}

impl<F: Precision> Not for RecordedMask<F> {
    type Output = Self;
    fn not(self) -> Self {
        Self::new(Node::Not(self.id))
    }
}

impl<F: Precision> Mask<Recorded<F>> for RecordedMask<F> {
    fn select(self, yes: Recorded<F>, no: Recorded<F>) -> Recorded<F> {
        Recorded::new(Node::Select(self.id, yes.id, no.id))
    }
}

impl<F: Precision> Scalar for Recorded<F> {
    type Mask = RecordedMask<F>;

    fn of(value: f64) -> Self {
        Self::new(Node::Constant(F::of(value).into().to_bits()))
    }

    fn by_precision(double: f64, single: f64) -> Self {
        Self::new(Node::Constant(F::by_precision(double, single).into().to_bits()))
    }

    fn lt(self, other: Self) -> RecordedMask<F> {
        RecordedMask::new(Node::Less(self.id, other.id))
    }

    fn le(self, other: Self) -> RecordedMask<F> {
        RecordedMask::new(Node::LessOrEqual(self.id, other.id))
    }

    fn abs(self) -> Self {
        Self::new(Node::Apply(Function::Abs, self.id))
    }

    fn power_of_two(self) -> Self {
        Self::new(Node::Apply(Function::PowerOfTwo, self.id))
    }

    fn exponent(self) -> Self {
        Self::new(Node::Apply(Function::Exponent, self.id))
    }

    fn ln(self) -> Self {
        Self::new(Node::Apply(Function::Ln, self.id))
    }

    fn exp(self) -> Self {
        Self::new(Node::Apply(Function::Exp, self.id))
    }

    fn sin(self) -> Self {
        Self::new(Node::Apply(Function::Sin, self.id))
    }

    fn cos(self) -> Self {
        Self::new(Node::Apply(Function::Cos, self.id))
    }

    fn round(self) -> Self {
        Self::new(Node::Apply(Function::Round, self.id))
    }

    fn floor(self) -> Self {
        Self::new(Node::Apply(Function::Floor, self.id))
    }

    fn call<B: Block<Self>>(block: &B, state: &mut B::State, input: B::Input, dt: Self) -> B::Output {
        program::call(block, state, input, dt)
    }
}
