//! Number types over which all blocks are generic.
//!
//! A signal path has no `if`: choices are values ([`Mask::select`]). All arithmetic is IEEE 754 with one rounding per
//! operation, so that every instance of a block agrees bit for bit (all non-NaN results).

mod dual;
pub mod kernel;
mod lanes;

use core::fmt::Debug;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

pub use dual::Dual;
pub use lanes::{LaneMask, Lanes};

use crate::block::Block;

/// The result of a comparison: one truth value, or one per lane.
pub trait Mask<T>: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// `yes` where the mask is true, `no` elsewhere. Both are computed.
    fn select(self, yes: T, no: T) -> T;

    /// Whether the mask may be true for any number: if not, the caller may skip what it selects.
    #[inline(always)]
    fn anywhere(self) -> bool {
        true
    }
}

/// A number of the signal path.
///
/// No method may fuse a multiplication with an addition, and the simulated path uses no other library function.
pub trait Scalar:
    Copy
    + Debug
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + 'static
{
    /// Result of a comparison.
    type Mask: Mask<Self>;

    /// Whether a function call is cheap compared with the computation in it: true for plain floats.
    const CALLS_ARE_CHEAP: bool = false;

    /// Whether numbers in an array become vector instructions: true for plain floats on processors with vectors.
    const HAS_VECTORS: bool = false;

    /// A constant; `f32` instances round it.
    fn of(value: f64) -> Self;

    /// A constant that belongs to the precision, such as the split of π/2 in an argument reduction.
    fn by_precision(double: f64, single: f64) -> Self;

    /// `self < other`; false for NaN, like all four comparisons.
    fn lt(self, other: Self) -> Self::Mask;

    /// `self ≤ other`.
    fn le(self, other: Self) -> Self::Mask;

    /// `self > other`.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }

    /// `self ≥ other`.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }

    /// Magnitude; clears the sign, also of −0.
    fn abs(self) -> Self;

    /// 2^k for a whole k within the normal exponents; anything else gives an unspecified value.
    fn power_of_two(self) -> Self;

    /// The whole k with 2^k ≤ |x| < 2^(k+1) for a normal x; anything else gives an unspecified number.
    fn exponent(self) -> Self;

    /// Exponential, within 2 ulp, 0 instead of a subnormal number; the one kernel of all instances.
    #[inline(always)]
    fn exp(self) -> Self {
        kernel::exp(self)
    }

    /// Natural logarithm of a normal positive number, within 2 ulp.
    #[inline(always)]
    fn ln(self) -> Self {
        kernel::ln(self)
    }

    /// Sine, within 2 ulp for |x| ≤ 1e6 rad (`f32`: 1e4 rad).
    #[inline(always)]
    fn sin(self) -> Self {
        kernel::sin(self)
    }

    /// Cosine, as [`sin`](Self::sin).
    #[inline(always)]
    fn cos(self) -> Self {
        kernel::cos(self)
    }

    /// Nearest whole number, ties to even.
    #[inline(always)]
    fn round(self) -> Self {
        kernel::round(self)
    }

    /// Largest whole number not above.
    #[inline(always)]
    fn floor(self) -> Self {
        kernel::floor(self)
    }

    /// The larger; `other` if either is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.gt(other).select(self, other)
    }

    /// The smaller; `other` if either is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.lt(other).select(self, other)
    }

    /// Limited to `low … high`; NaN stays NaN, so that the guard of the actuator detects it.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        high.min(low.max(self))
    }

    /// −1, 0 or 1; 0 for NaN.
    #[inline(always)]
    fn sign(self) -> Self {
        let zero = Self::of(0.0);
        self.gt(zero).select(Self::of(1.0), self.lt(zero).select(Self::of(-1.0), zero))
    }

    /// This number, as a barrier for the compiler at the start of the code of one choice of the configuration.
    ///
    /// Without the barrier the compiler may compute all choices and select one. For plain floats the barrier hides the
    /// origin of the number, so that only the active choice is computed; for all other types it has no effect.
    #[inline(always)]
    fn barrier(self) -> Self {
        self
    }

    /// Runs a block within another. The recorder records a function call; all other numbers call
    /// [`step`](Block::step) directly.
    #[inline(always)]
    fn call<B: Block<Self>>(block: &B, state: &mut B::State, input: B::Input, dt: Self) -> B::Output {
        block.step(state, input, dt)
    }
}

impl<T> Mask<T> for bool {
    #[inline(always)]
    fn anywhere(self) -> bool {
        self
    }

    #[inline(always)]
    fn select(self, yes: T, no: T) -> T {
        if self { yes } else { no }
    }
}

macro_rules! float {
    ($float:ident, $single:literal, $whole:literal, $bias:literal, $mantissa:literal) => {
        impl Scalar for $float {
            type Mask = bool;

            const CALLS_ARE_CHEAP: bool = true;
            const HAS_VECTORS: bool = cfg!(any(target_arch = "x86_64", target_arch = "aarch64"));

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $float
            }

            #[inline(always)]
            fn by_precision(double: f64, single: f64) -> Self {
                (if $single { single } else { double }) as $float
            }

            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }

            #[inline(always)]
            fn le(self, other: Self) -> bool {
                self <= other
            }

            #[inline(always)]
            fn barrier(self) -> Self {
                core::hint::black_box(self)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                $float::abs(self)
            }

            #[inline(always)]
            fn power_of_two(self) -> Self {
                // k + bias lands in the low bits of the mantissa; the shift moves it into the exponent.
                $float::from_bits((self + ($whole + $bias)).to_bits() << $mantissa)
            }

            #[inline(always)]
            fn exponent(self) -> Self {
                // The exponent in the low bits of a mantissa; subtracting its scale leaves the number.
                let whole: $float = $whole;
                $float::from_bits((self.to_bits() >> $mantissa) | whole.to_bits()) - ($whole + $bias)
            }
        }
    };
}

float!(f64, false, 4_503_599_627_370_496.0, 1023.0, 52);
float!(f32, true, 8_388_608.0, 127.0, 23);

#[cfg(test)]
mod tests;
