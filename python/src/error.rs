//! Errors of the library as Python exceptions with the same message.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use stickslip::Error;
use stickslip::SimulateError;

/// The exceptions, as `stickslip/_errors.py` defines them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exception {
    /// Invalid value.
    InvalidValue,
    /// Unknown parameter, preset or other name.
    UnknownName,
    /// The operating system cannot read or write a file.
    FileError,
    /// The supervision has stopped the bench.
    BenchFault,
    /// The work was cancelled.
    Cancelled,
    /// A controller that cannot be recorded.
    NotRecordable,
    /// Any other error.
    Error,
}

impl Exception {
    /// The exception for an error.
    fn of(error: &Error) -> Self {
        match error {
            Error::UnknownParameter { .. } | Error::UnknownPreset { .. } | Error::NothingToCompare { .. } => {
                Exception::UnknownName
            }
            Error::File { .. } => Exception::FileError,
            Error::BenchFault { .. } | Error::NotHomed | Error::Refused(_) => Exception::BenchFault,
            Error::Cancelled => Exception::Cancelled,
            Error::Parameters(_)
            | Error::OutOfRange { .. }
            | Error::CurvePoint { .. }
            | Error::TooFew { .. }
            | Error::Dimension { .. }
            | Error::NotFinite { .. } => Exception::InvalidValue,
            other => match other.of() {
                Some(SimulateError::StepTooLarge { .. }) => Exception::InvalidValue,
                _ => Exception::Error,
            },
        }
    }

    /// The exception with this message.
    pub(crate) fn with(self, py: Python<'_>, message: String) -> PyErr {
        static CLASSES: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
        let class = CLASSES
            .get_or_try_init(py, || py.import("stickslip._errors").map(Bound::unbind))
            .and_then(|classes| classes.bind(py).getattr(format!("{self:?}").as_str()))
            .and_then(|class| Ok(class.cast_into::<PyType>()?));
        match class {
            Ok(class) => PyErr::from_type(class, message),
            Err(error) => error,
        }
    }
}

/// An error of the library as an exception.
pub(crate) fn raised(py: Python<'_>, error: &Error) -> PyErr {
    Exception::of(error).with(py, error.to_string())
}
