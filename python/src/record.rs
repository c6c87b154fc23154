//! Numbers of a controller written in Python: floats while it runs, nodes of a graph while it is recorded. One
//! expression over any [`Scalar`] serves both, so that the results are bit-identical.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

use pyo3::basic::CompareOp;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::type_hint_identifier;
use stickslip_codegen::record::Recorded;
use stickslip_core::scalar::Scalar;

use crate::error::Exception;

const ENDED: &str = "this number belongs to a recording that has ended. Store lasting values in the state.";
const NO_TRUTH: &str = "the value of this condition is unknown: the controller is recorded once, for all samples. \
                        Use stickslip.where(condition, a, b) in place of if, while, and, or, not, min and max; & | ~ \
                        join conditions.";
const NO_VALUE: &str = "a recorded number has no value: it represents the numbers of all samples. Use stickslip.sin, \
                        cos, exp, log, sqrt, floor, sign, where, minimum, maximum or clip in place of float() and \
                        the functions of math.";
const NO_ORDER: &str = "conditions cannot be compared. Join them with & | ~.";
const DIGITS: &str = "numbers of a controller round to whole numbers only. Use round(x).";

thread_local! {
    /// The active recording of this thread; 0 if there is none.
    static ACTIVE: Cell<u64> = const { Cell::new(0) };
}

/// The active recording of this thread.
pub(crate) fn active() -> u64 {
    ACTIVE.get()
}

/// Runs `work` as a separate recording, to which its numbers belong.
pub(crate) fn apart<R>(work: impl FnOnce() -> R) -> R {
    static COUNT: AtomicU64 = AtomicU64::new(1);
    let outer = ACTIVE.replace(COUNT.fetch_add(1, Ordering::Relaxed));
    let result = work();
    ACTIVE.set(outer);
    result
}

/// A float, or a recorded value with its recording.
#[derive(Clone, Copy)]
pub(crate) enum Either<P, R> {
    Plain(P),
    Recorded(R, u64),
}

impl<P, R> Either<P, R> {
    /// Whether the active recording contains the value. An error for a value of another recording.
    pub(crate) fn is_recorded(&self, py: Python<'_>) -> PyResult<bool> {
        match self {
            Either::Plain(_) => Ok(false),
            Either::Recorded(_, recording) if *recording == active() => Ok(true),
            Either::Recorded(..) => Err(Exception::NotRecordable.with(py, ENDED.into())),
        }
    }
}

pub(crate) type Real = Either<f64, Recorded>;
pub(crate) type Condition = Either<bool, <Recorded as Scalar>::Mask>;

impl Real {
    pub(crate) fn recorded(self) -> Recorded {
        match self {
            Either::Plain(value) => Scalar::of(value),
            Either::Recorded(number, _) => number,
        }
    }

    pub(crate) fn plain(self) -> f64 {
        if let Either::Plain(value) = self { value } else { f64::NAN }
    }
}

/// One expression over numbers, floats or recorded; `$make` converts the result.
macro_rules! compute {
    ($py:ident, $make:ident, [$($number:ident),+], $expression:expr) => {{
        $(let $number: $crate::record::Real = $number;)+
        let mut any = false;
        $(any |= $number.is_recorded($py)?;)+
        Ok($make(if any {
            $(let $number = $number.recorded();)+
            $crate::record::Either::Recorded($expression, $crate::record::active())
        } else {
            $(let $number = $number.plain();)+
            $crate::record::Either::Plain($expression)
        }))
    }};
}
pub(crate) use compute;

/// Number of a controller: a float while it runs, a node of the graph while it is recorded.
///
/// It supports `+ - * /`, `abs`, `round`, comparisons and the functions of stickslip. While the controller runs,
/// `float` returns the value.
#[pyclass(frozen, module = "stickslip", name = "Number")]
pub(crate) struct Number(pub(crate) Real);

/// Condition of a controller: `True` or `False` while it runs, without a value while it is recorded.
///
/// Join conditions with `& | ~`; select by them with `stickslip.where`.
#[pyclass(frozen, module = "stickslip", name = "Truth")]
pub(crate) struct Truth(Condition);

/// A [`Number`] or a Python number.
pub(crate) struct RealLike(pub(crate) Real);

impl<'py> FromPyObject<'_, 'py> for RealLike {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("typing", "SupportsFloat");

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(number) = object.cast::<Number>() {
            return Ok(RealLike(number.get().0));
        }
        object.extract().map(|value| RealLike(Either::Plain(value)))
    }
}

/// A [`Truth`] or a Python bool.
pub(crate) struct TruthLike(pub(crate) Condition);

impl<'py> FromPyObject<'_, 'py> for TruthLike {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("typing", "Any");

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(truth) = object.cast::<Truth>() {
            return Ok(TruthLike(truth.get().0));
        }
        object.extract().map(|truth| TruthLike(Either::Plain(truth)))
    }
}

impl RealLike {
    /// The number within the active recording.
    pub(crate) fn recorded(&self, py: Python<'_>) -> PyResult<Recorded> {
        self.0.is_recorded(py)?;
        Ok(self.0.recorded())
    }
}

impl From<Recorded> for Number {
    fn from(number: Recorded) -> Self {
        Number(Either::Recorded(number, active()))
    }
}

#[pymethods]
impl Number {
    /// None: NumPy leaves arithmetic with its numbers to this class, and its functions reject it.
    #[classattr]
    #[pyo3(name = "__array_ufunc__")]
    fn array_ufunc() -> Option<bool> {
        None
    }

    fn __add__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (self.0, other.0);
        compute!(py, Number, [a, b], a + b)
    }

    fn __radd__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (other.0, self.0);
        compute!(py, Number, [a, b], a + b)
    }

    fn __sub__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (self.0, other.0);
        compute!(py, Number, [a, b], a - b)
    }

    fn __rsub__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (other.0, self.0);
        compute!(py, Number, [a, b], a - b)
    }

    fn __mul__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (self.0, other.0);
        compute!(py, Number, [a, b], a * b)
    }

    fn __rmul__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (other.0, self.0);
        compute!(py, Number, [a, b], a * b)
    }

    fn __truediv__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (self.0, other.0);
        compute!(py, Number, [a, b], a / b)
    }

    fn __rtruediv__(&self, py: Python<'_>, other: RealLike) -> PyResult<Number> {
        let (a, b) = (other.0, self.0);
        compute!(py, Number, [a, b], a / b)
    }

    fn __neg__(&self, py: Python<'_>) -> PyResult<Number> {
        let a = self.0;
        compute!(py, Number, [a], -a)
    }

    fn __pos__(&self) -> Number {
        Number(self.0)
    }

    fn __abs__(&self, py: Python<'_>) -> PyResult<Number> {
        let a = self.0;
        compute!(py, Number, [a], Scalar::abs(a))
    }

    #[pyo3(signature = (digits = None))]
    fn __round__(&self, py: Python<'_>, digits: Option<i64>) -> PyResult<Number> {
        if digits.is_some() {
            return Err(Exception::NotRecordable.with(py, DIGITS.into()));
        }
        let a = self.0;
        compute!(py, Number, [a], Scalar::round(a))
    }

    fn __richcmp__<'py>(&self, py: Python<'py>, other: RealLike, op: CompareOp) -> PyResult<Bound<'py, PyAny>> {
        let (a, b) = (self.0, other.0);
        let truth: PyResult<Truth> = match op {
            CompareOp::Lt => compute!(py, Truth, [a, b], Scalar::lt(a, b)),
            CompareOp::Le => compute!(py, Truth, [a, b], Scalar::le(a, b)),
            CompareOp::Gt => compute!(py, Truth, [a, b], Scalar::gt(a, b)),
            CompareOp::Ge => compute!(py, Truth, [a, b], Scalar::ge(a, b)),
            CompareOp::Eq => compute!(py, Truth, [a, b], Scalar::le(a, b) & Scalar::ge(a, b)),
            CompareOp::Ne => compute!(py, Truth, [a, b], !(Scalar::le(a, b) & Scalar::ge(a, b))),
        };
        // `object` promises a `bool` for ==; here it is a condition.
        Ok(Bound::new(py, truth?)?.into_any())
    }

    fn __bool__(&self, py: Python<'_>) -> PyResult<bool> {
        match self.0 {
            Either::Plain(value) => Ok(value != 0.0),
            Either::Recorded(..) => Err(Exception::NotRecordable.with(py, NO_TRUTH.into())),
        }
    }

    fn __float__(&self, py: Python<'_>) -> PyResult<f64> {
        match self.0 {
            Either::Plain(value) => Ok(value),
            Either::Recorded(..) => Err(Exception::NotRecordable.with(py, NO_VALUE.into())),
        }
    }

    fn __format__(&self, py: Python<'_>, format: &str) -> PyResult<String> {
        match self.0 {
            Either::Plain(value) => value.into_pyobject(py)?.call_method1("__format__", (format,))?.extract(),
            Either::Recorded(..) => Ok(self.__repr__()),
        }
    }

    fn __repr__(&self) -> String {
        match self.0 {
            Either::Plain(value) => format!("{value:?}"),
            Either::Recorded(..) => "a recorded number".into(),
        }
    }
}

/// Joins two conditions.
macro_rules! join {
    ($py:ident, $a:expr, $b:expr, $operator:tt) => {{
        let (a, b): (Condition, Condition) = ($a, $b);
        a.is_recorded($py)?;
        b.is_recorded($py)?;
        Ok(Truth(match (a, b) {
            (Either::Plain(a), Either::Plain(b)) => Either::Plain(a $operator b),
            _ => Either::Recorded(mask(a) $operator mask(b), active()),
        }))
    }};
}

/// A condition within a recording; a plain one becomes a comparison of constants.
fn mask(condition: Condition) -> <Recorded as Scalar>::Mask {
    match condition {
        Either::Plain(truth) => Recorded::of(f64::from(u8::from(truth))).gt(Recorded::of(0.0)),
        Either::Recorded(mask, _) => mask,
    }
}

#[pymethods]
impl Truth {
    fn __and__(&self, py: Python<'_>, other: TruthLike) -> PyResult<Truth> {
        join!(py, self.0, other.0, &)
    }

    fn __rand__(&self, py: Python<'_>, other: TruthLike) -> PyResult<Truth> {
        join!(py, self.0, other.0, &)
    }

    fn __or__(&self, py: Python<'_>, other: TruthLike) -> PyResult<Truth> {
        join!(py, self.0, other.0, |)
    }

    fn __ror__(&self, py: Python<'_>, other: TruthLike) -> PyResult<Truth> {
        join!(py, self.0, other.0, |)
    }

    fn __invert__(&self, py: Python<'_>) -> PyResult<Truth> {
        self.0.is_recorded(py)?;
        Ok(Truth(match self.0 {
            Either::Plain(truth) => Either::Plain(!truth),
            Either::Recorded(mask, recording) => Either::Recorded(!mask, recording),
        }))
    }

    fn __bool__(&self, py: Python<'_>) -> PyResult<bool> {
        match self.0 {
            Either::Plain(truth) => Ok(truth),
            Either::Recorded(..) => Err(Exception::NotRecordable.with(py, NO_TRUTH.into())),
        }
    }

    fn __richcmp__(&self, py: Python<'_>, other: &Bound<'_, PyAny>, op: CompareOp) -> PyResult<bool> {
        let _ = (other, op);
        Err(Exception::NotRecordable.with(py, NO_ORDER.into()))
    }

    fn __repr__(&self) -> &'static str {
        match self.0 {
            Either::Plain(true) => "True",
            Either::Plain(false) => "False",
            Either::Recorded(..) => "a recorded condition",
        }
    }
}

/// Convert to a number of a controller.
#[pyfunction]
pub(crate) fn number(value: RealLike) -> Number {
    Number(value.0)
}
