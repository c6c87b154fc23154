//! Errors of the library as exceptions, in its own words.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use stickslip::Error;
use stickslip::SimulateError;

/// The exceptions, as `stickslip/_errors.py` defines them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exception {
    /// A value that cannot be.
    InvalidValue,
    /// A parameter, preset or part that there is not.
    UnknownName,
    /// The system refused a file.
    FileError,
    /// Supervision has taken the torque away.
    BenchFault,
    /// The work was cancelled.
    Cancelled,
    /// What is no controller that can be recorded.
    NotRecordable,
    /// Anything else.
    Error,
}

impl Exception {
    /// Which exception an error is.
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

    /// The exception with these words.
    pub(crate) fn with(self, py: Python<'_>, words: String) -> PyErr {
        static CLASSES: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
        let class = CLASSES
            .get_or_try_init(py, || py.import("stickslip._errors").map(Bound::unbind))
            .and_then(|classes| classes.bind(py).getattr(format!("{self:?}").as_str()))
            .and_then(|class| Ok(class.cast_into::<PyType>()?));
        match class {
            Ok(class) => PyErr::from_type(class, words),
            Err(error) => error,
        }
    }
}

/// An error of the library as an exception.
pub(crate) fn raised(py: Python<'_>, error: &Error) -> PyErr {
    Exception::of(error).with(py, error.to_string())
}
