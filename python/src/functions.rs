//! Functions on the numbers of a controller: those of [`Scalar`] and functions composed of them.

use pyo3::prelude::*;
use stickslip_core::scalar::{Mask, Scalar};

use crate::record::{Either, Number, RealLike, TruthLike, compute};

/// Return `yes` where the condition holds, `no` elsewhere. Both are always computed.
///
/// >>> import stickslip
/// >>> stickslip.where(2.0 > 1.0, 5.0, 0.0)
/// 5.0
#[pyfunction]
#[pyo3(name = "where")]
pub(crate) fn where_(py: Python<'_>, condition: TruthLike, yes: RealLike, no: RealLike) -> PyResult<Number> {
    let (yes, no) = (yes.0, no.0);
    condition.0.is_recorded(py)?;
    match condition.0 {
        Either::Plain(true) => Ok(Number(yes)),
        Either::Plain(false) => Ok(Number(no)),
        Either::Recorded(mask, recording) => {
            yes.is_recorded(py)?;
            no.is_recorded(py)?;
            Ok(Number(Either::Recorded(mask.select(yes.recorded(), no.recorded()), recording)))
        }
    }
}

/// Return the smaller number; the second one if either is NaN.
///
/// >>> import stickslip
/// >>> stickslip.minimum(2.0, 1.0)
/// 1.0
#[pyfunction]
pub(crate) fn minimum(py: Python<'_>, a: RealLike, b: RealLike) -> PyResult<Number> {
    let (a, b) = (a.0, b.0);
    compute!(py, Number, [a, b], Scalar::min(a, b))
}

/// Return the larger number; the second one if either is NaN.
///
/// >>> import stickslip
/// >>> stickslip.maximum(2.0, 1.0)
/// 2.0
#[pyfunction]
pub(crate) fn maximum(py: Python<'_>, a: RealLike, b: RealLike) -> PyResult<Number> {
    let (a, b) = (a.0, b.0);
    compute!(py, Number, [a, b], Scalar::max(a, b))
}

/// Limit a number to `low` … `high`; NaN remains NaN.
///
/// >>> import stickslip
/// >>> stickslip.clip(5.0, -1.0, 1.0)
/// 1.0
#[pyfunction]
pub(crate) fn clip(py: Python<'_>, x: RealLike, low: RealLike, high: RealLike) -> PyResult<Number> {
    let (x, low, high) = (x.0, low.0, high.0);
    compute!(py, Number, [x, low, high], Scalar::clamp(x, low, high))
}

/// √x by Newton's iteration on x = 4^k·m with m in 1 … 4. From (1 + m)/2, at most a quarter off, five steps are below
/// the last place: 1/4, 1/40, 3e-4, 5e-8, 1e-15, 1e-30.
fn root<T: Scalar>(x: T) -> T {
    let (zero, half) = (T::of(0.0), T::of(0.5));
    let normal = x.ge(T::of(f64::MIN_POSITIVE)) & x.lt(T::of(f64::INFINITY));
    let size = normal.select(x, T::of(1.0));
    let scale = (size.exponent() * half).floor().power_of_two();
    let m = size / scale / scale;
    let mut root = half + half * m;
    for _ in 0..5 {
        root = half * (root + m / root);
    }
    // √∞ is ∞, √0 is 0; a negative number gives NaN, NaN remains NaN.
    let other = (x.ge(T::of(f64::INFINITY)) | x.abs().le(zero)).select(x, T::of(f64::NAN));
    let small = x.gt(zero) & x.lt(T::of(f64::MIN_POSITIVE));
    normal.select(root * scale, small.select(zero, other))
}

/// Return the square root, within 1 unit in the last place; NaN below 0, 0 for a subnormal number.
///
/// >>> import stickslip
/// >>> stickslip.sqrt(9.0)
/// 3.0
#[pyfunction]
pub(crate) fn sqrt(py: Python<'_>, x: RealLike) -> PyResult<Number> {
    let x = x.0;
    compute!(py, Number, [x], root(x))
}

/// Functions of one number, each with the kernel of the generated code.
macro_rules! functions {
    ($($(#[$about:meta])+ $name:ident = $method:ident;)+) => {$(
        $(#[$about])+
        #[pyfunction]
        pub(crate) fn $name(py: Python<'_>, x: RealLike) -> PyResult<Number> {
            let x = x.0;
            compute!(py, Number, [x], Scalar::$method(x))
        }
    )+};
}

functions! {
    /// Return the exponential, within 2 units in the last place; 0 instead of a subnormal number.
    ///
    /// >>> import stickslip
    /// >>> stickslip.exp(0.0)
    /// 1.0
    exp = exp;
    /// Return the natural logarithm, within 2 units in the last place; defined for normal positive numbers only.
    ///
    /// >>> import stickslip
    /// >>> stickslip.log(1.0)
    /// 0.0
    log = ln;
    /// Return the sine of an angle [rad], within 2 units in the last place up to 1e6 rad.
    ///
    /// >>> import stickslip
    /// >>> stickslip.sin(0.0)
    /// 0.0
    sin = sin;
    /// Return the cosine of an angle [rad], within 2 units in the last place up to 1e6 rad.
    ///
    /// >>> import stickslip
    /// >>> stickslip.cos(0.0)
    /// 1.0
    cos = cos;
    /// Return the largest whole number that is not above `x`.
    ///
    /// >>> import stickslip
    /// >>> stickslip.floor(-0.5)
    /// -1.0
    floor = floor;
    /// Return the sign: -1, 0 or 1; 0 for NaN.
    ///
    /// >>> import stickslip
    /// >>> stickslip.sign(-3.0)
    /// -1.0
    sign = sign;
}
