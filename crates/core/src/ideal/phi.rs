//! e^(−x) and what goes with it, by one division.

use crate::scalar::Scalar;

/// φ₀ = e^(−x), φ₁ = (1 − φ₀)/x, φ₂ = (1 − φ₁)/x, φ₃ = (½ − φ₂)/x for x ≥ 0, where e^x is its Taylor polynomial of
/// degree 4.
///
/// The relations between them hold exactly, for any x: nothing cancels, nothing overflows below x of 1e9 in `f32`, and a
/// long step ends on the steady value. As a method it has order 4, as the parabola that it serves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phi<T> {
    pub(super) exp: T,
    pub(super) one: T,
    pub(super) two: T,
    pub(super) three: T,
}

impl<T: Scalar> Phi<T> {
    #[inline(always)]
    pub(super) fn of(x: T) -> Self {
        let one = cubic(x, [1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0]);
        let two = cubic(x, [1.0 / 2.0, 1.0 / 3.0, 1.0 / 8.0, 1.0 / 24.0]);
        let three = cubic(x, [1.0 / 6.0, 1.0 / 8.0, 1.0 / 24.0, 1.0 / 48.0]);
        let exp = T::of(1.0) / (T::of(1.0) + x * one);
        Phi { exp, one: one * exp, two: two * exp, three: three * exp }
    }

    /// The same at 2·x.
    #[inline(always)]
    pub(super) fn doubled(self) -> Self {
        let Phi { exp, one, two, three } = self;
        Phi {
            exp: exp * exp,
            one: T::of(0.5) * (one + exp * one),
            two: T::of(0.25) * (one * one + two + two),
            three: T::of(0.125) * (one * two + two + three + three),
        }
    }
}

#[inline(always)]
fn cubic<T: Scalar>(x: T, [a, b, c, d]: [f64; 4]) -> T {
    T::of(a) + x * (T::of(b) + x * (T::of(c) + x * T::of(d)))
}
