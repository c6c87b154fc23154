//! N numbers in parallel lanes, for studies.
//!
//! Plain arrays with inlined operators: instantiated inside a function with `#[target_feature]`, the compiler turns
//! them into vector instructions. Each lane has the bits of its scalar.

use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, MulAssign, Neg, Not, Sub, SubAssign};

use super::{Mask, Scalar};

/// N numbers of one type; each operation applies to all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<F, const N: usize>(
    /// The numbers.
    pub [F; N],
);

/// Zeros.
impl<F: Copy + Default, const N: usize> Default for Lanes<F, N> {
    #[inline(always)]
    fn default() -> Self {
        Lanes([F::default(); N])
    }
}

/// One truth value for each lane.
#[derive(Clone, Copy, Debug)]
pub struct LaneMask<const N: usize>(
    /// The truth values.
    pub [bool; N],
);

/// Computes each lane. The loop tests at its end: a step contains thousands of these loops, and with a test at the
/// start compilation takes twice the time. A macro, because a closure would not be inlined.
macro_rules! fill {
    ($start:expr, |$i:ident| $value:expr) => {{
        const { assert!(N > 0, "lanes without a lane") };
        let mut out = $start;
        let mut $i = 0;
        loop {
            out[$i] = $value;
            $i += 1;
            if $i == N {
                break out;
            }
        }
    }};
}

impl<F: Copy, const N: usize> Lanes<F, N> {
    #[inline(always)]
    fn each(self, f: impl Fn(F) -> F) -> Self {
        Lanes(fill!(self.0, |i| f(self.0[i])))
    }

    #[inline(always)]
    fn pair(self, other: Self, f: impl Fn(F, F) -> F) -> Self {
        Lanes(fill!(self.0, |i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn test(self, other: Self, f: impl Fn(F, F) -> bool) -> LaneMask<N> {
        LaneMask(fill!([false; N], |i| f(self.0[i], other.0[i])))
    }
}

impl<F: Copy, const N: usize> Mask<Lanes<F, N>> for LaneMask<N> {
    #[inline(always)]
    fn select(self, yes: Lanes<F, N>, no: Lanes<F, N>) -> Lanes<F, N> {
        Lanes(fill!(no.0, |i| if self.0[i] { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    fn anywhere(self) -> bool {
        self.0 != [false; N]
    }
}

impl<const N: usize> BitAnd for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        LaneMask(fill!(self.0, |i| self.0[i] & other.0[i]))
    }
}

impl<const N: usize> BitOr for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        LaneMask(fill!(self.0, |i| self.0[i] | other.0[i]))
    }
}

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        LaneMask(fill!(self.0, |i| !self.0[i]))
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $assign_trait:ident, $assign:ident, $op:tt) => {
        impl<F: Copy + $trait<Output = F>, const N: usize> $trait for Lanes<F, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.pair(other, |a, b| a $op b)
            }
        }
        operator!(assign $trait, $assign_trait, $assign, $op);
    };
    (assign $trait:ident, none, $assign:ident, $op:tt) => {};
    (assign $trait:ident, $assign_trait:ident, $assign:ident, $op:tt) => {
        impl<F: Copy + $trait<Output = F>, const N: usize> $assign_trait for Lanes<F, N> {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                *self = *self $op other;
            }
        }
    };
}

operator!(Add, add, AddAssign, add_assign, +);
operator!(Sub, sub, SubAssign, sub_assign, -);
operator!(Mul, mul, MulAssign, mul_assign, *);
operator!(Div, div, none, none, /);

impl<F: Copy + Neg<Output = F>, const N: usize> Neg for Lanes<F, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|a| -a)
    }
}

impl<F: Scalar<Mask = bool>, const N: usize> Scalar for Lanes<F, N> {
    type Mask = LaneMask<N>;

    #[inline(always)]
    fn of(value: f64) -> Self {
        Lanes([F::of(value); N])
    }

    #[inline(always)]
    fn by_precision(double: f64, single: f64) -> Self {
        Lanes([F::by_precision(double, single); N])
    }

    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<N> {
        self.test(other, F::lt)
    }

    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<N> {
        self.test(other, F::le)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.each(F::abs)
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.each(F::power_of_two)
    }

    #[inline(always)]
    fn exponent(self) -> Self {
        self.each(F::exponent)
    }

    // The same kernels, lane by lane: the compiler has one loop to vectorise instead of one per operation.
    #[inline(always)]
    fn exp(self) -> Self {
        self.each(F::exp)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        self.each(F::ln)
    }

    #[inline(always)]
    fn sin(self) -> Self {
        self.each(F::sin)
    }

    #[inline(always)]
    fn cos(self) -> Self {
        self.each(F::cos)
    }

    #[inline(always)]
    fn round(self) -> Self {
        self.each(F::round)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        self.each(F::floor)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.pair(other, F::max)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.pair(other, F::min)
    }

    #[inline(always)]
    fn sign(self) -> Self {
        self.each(F::sign)
    }
}
