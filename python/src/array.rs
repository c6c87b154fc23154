//! NumPy arrays and array-like arguments, with their types for the stubs.

use std::convert::Infallible;

use numpy::ndarray::{ArrayD, ArrayView1, ArrayViewD, Ix1};
use numpy::{AllowTypeChange, IntoPyArray, PyArrayLikeDyn};
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::{type_hint_identifier, type_hint_subscript};

use crate::error::Exception;

/// Array-like argument: an array, a number or nested sequences of numbers.
pub(crate) struct ArrayLike<'py>(PyArrayLikeDyn<'py, f64, AllowTypeChange>);

impl<'py> FromPyObject<'_, 'py> for ArrayLike<'py> {
    type Error = PyErr;

    const INPUT_TYPE: PyStaticExpr = type_hint_identifier!("numpy.typing", "ArrayLike");

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        object.extract().map(ArrayLike)
    }
}

impl ArrayLike<'_> {
    /// The numbers in their shape.
    pub(crate) fn of_any_shape(&self) -> ArrayViewD<'_, f64> {
        self.0.as_array()
    }

    /// The numbers as a row; `name` is the argument in the error message.
    pub(crate) fn row(&self, py: Python<'_>, name: &str) -> PyResult<ArrayView1<'_, f64>> {
        let array = self.0.as_array();
        let shape = array.shape().to_vec();
        array.into_dimensionality::<Ix1>().map_err(|_| {
            let message = format!("{name} has the shape {shape:?}. Give a one-dimensional array.");
            Exception::InvalidValue.with(py, message)
        })
    }
}

/// Array for Python, created without a copy.
pub(crate) struct Array(ArrayD<f64>);

impl From<Vec<f64>> for Array {
    fn from(values: Vec<f64>) -> Self {
        Array(numpy::ndarray::Array1::from_vec(values).into_dyn())
    }
}

impl From<ArrayD<f64>> for Array {
    fn from(values: ArrayD<f64>) -> Self {
        Array(values)
    }
}

impl<'py> IntoPyObject<'py> for Array {
    type Target = PyAny;
    type Output = Bound<'py, PyAny>;
    type Error = Infallible;

    const OUTPUT_TYPE: PyStaticExpr = type_hint_subscript!(
        type_hint_identifier!("numpy.typing", "NDArray"),
        type_hint_identifier!("numpy", "float64")
    );

    fn into_pyobject(self, py: Python<'py>) -> Result<Bound<'py, PyAny>, Infallible> {
        Ok(self.0.into_pyarray(py).into_any())
    }
}
