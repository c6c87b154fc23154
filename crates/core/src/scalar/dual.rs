//! A number with its first derivatives, for gradients, linearisation and fits.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use super::Scalar;

/// A value and its derivatives with respect to N variables. The value has the bits of the `f64` instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// ∂value/∂variable, one for each variable.
    pub gradient: [f64; N],
}

/// Zero.
impl<const N: usize> Default for Dual<N> {
    #[inline]
    fn default() -> Self {
        Self::of(0.0)
    }
}

impl<const N: usize> Dual<N> {
    /// The variable number `index` at `value`. Panics if there are fewer variables.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut gradient = [0.0; N];
        gradient[index] = 1.0;
        Dual { value, gradient }
    }

    /// A function of this number, given its value and its slope at this number.
    #[inline]
    fn chain(self, value: f64, slope: f64) -> Self {
        Dual { value, gradient: self.gradient.map(|g| slope * g) }
    }

    #[inline]
    fn join(self, other: Self, value: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut gradient = [0.0; N];
        for i in 0..N {
            gradient[i] = f(self.gradient[i], other.gradient[i]);
        }
        Dual { value, gradient }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        self.join(b, self.value + b.value, |da, db| da + db)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        self.join(b, self.value - b.value, |da, db| da - db)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule has a sum")]
    fn mul(self, b: Self) -> Self {
        self.join(b, self.value * b.value, |da, db| da * b.value + self.value * db)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the quotient rule has a difference and a product")]
    fn div(self, b: Self) -> Self {
        let quotient = self.value / b.value;
        self.join(b, quotient, |da, db| (da - quotient * db) / b.value)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline]
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline]
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}

impl<const N: usize> MulAssign for Dual<N> {
    #[inline]
    fn mul_assign(&mut self, b: Self) {
        *self = *self * b;
    }
}

impl<const N: usize> Scalar for Dual<N> {
    type Mask = bool;

    #[inline]
    fn of(value: f64) -> Self {
        Dual { value, gradient: [0.0; N] }
    }

    #[inline]
    fn by_precision(double: f64, _single: f64) -> Self {
        Self::of(double)
    }

    #[inline]
    fn lt(self, other: Self) -> bool {
        self.value < other.value
    }

    #[inline]
    fn le(self, other: Self) -> bool {
        self.value <= other.value
    }

    #[inline]
    fn abs(self) -> Self {
        self.chain(self.value.abs(), self.value.sign())
    }

    #[inline]
    fn power_of_two(self) -> Self {
        Self::of(self.value.power_of_two())
    }

    #[inline]
    fn exponent(self) -> Self {
        Self::of(self.value.exponent())
    }

    #[inline]
    fn ln(self) -> Self {
        self.chain(Scalar::ln(self.value), 1.0 / self.value)
    }

    #[inline]
    fn exp(self) -> Self {
        let value = Scalar::exp(self.value);
        self.chain(value, value)
    }

    #[inline]
    fn sin(self) -> Self {
        self.chain(Scalar::sin(self.value), Scalar::cos(self.value))
    }

    #[inline]
    fn cos(self) -> Self {
        self.chain(Scalar::cos(self.value), -Scalar::sin(self.value))
    }

    // The derivative of a step function is 0 wherever it exists.
    #[inline]
    fn round(self) -> Self {
        Self::of(Scalar::round(self.value))
    }

    #[inline]
    fn floor(self) -> Self {
        Self::of(Scalar::floor(self.value))
    }
}
