//! Conversion of parameter values between Python and parameter files.

use pyo3::exceptions::PyTypeError;
use pyo3::inspect::PyStaticExpr;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyMapping, PyString};
use pyo3::{type_hint_identifier, type_hint_subscript};
use stickslip::parameters::{Entry, Value};
use stickslip_core::fields::Kind;

use crate::group::Group;
use crate::tree::join;

/// Named values, in order.
pub(crate) struct Named<T>(pub(crate) Vec<(&'static str, T)>);

impl<'py, T: IntoPyObject<'py>> IntoPyObject<'py> for Named<T> {
    type Target = PyDict;
    type Output = Bound<'py, PyDict>;
    type Error = PyErr;

    const OUTPUT_TYPE: PyStaticExpr = type_hint_subscript!(
        type_hint_identifier!("builtins", "dict"),
        type_hint_identifier!("builtins", "str"),
        T::OUTPUT_TYPE
    );

    fn into_pyobject(self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        self.0.into_iter().try_for_each(|(name, value)| all.set_item(name, value))?;
        Ok(all)
    }
}

/// The value of an entry: `float`, `int` for whole numbers, `bool`, or the name of a variant.
pub(crate) fn object<'py>(py: Python<'py>, entry: &Entry) -> PyResult<Bound<'py, PyAny>> {
    Ok(match (entry.value, entry.field.kind) {
        (Value::Variant(name), _) => name.into_pyobject(py)?.into_any(),
        (Value::Number(value), Kind::Flag) => PyBool::new(py, value > 0.5).to_owned().into_any(),
        (Value::Number(value), Kind::Whole) => (value as i64).into_pyobject(py)?.into_any(),
        (Value::Number(value), Kind::Real) => value.into_pyobject(py)?.into_any(),
    })
}

/// Converts a Python value for `path` (one value, a list, or a mapping of paths below) to paths and texts of a file.
pub(crate) fn settings(path: &str, value: &Bound<'_, PyAny>, pairs: &mut Vec<(String, String)>) -> PyResult<()> {
    if let Ok(group) = value.cast::<Group>() {
        pairs.extend(group.get().settings(path));
    } else if let Ok(mapping) = value.cast::<PyMapping>() {
        for item in mapping.items()?.iter() {
            let (name, value): (String, Bound<'_, PyAny>) = item.extract()?;
            settings(&join(path, &name), &value, pairs)?;
        }
    } else {
        pairs.push((path.into(), text(path, value)?));
    }
    Ok(())
}

/// A single value as text of a file.
fn text(path: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    if value.cast::<PyString>().is_ok() {
        return value.extract();
    }
    // Check bool before numbers: in Python a bool is an int.
    if let Ok(flag) = value.extract::<bool>() {
        return Ok(flag.to_string());
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(format!("{number:?}"));
    }
    if let Ok(elements) = value.try_iter() {
        let elements = elements.map(|element| text(path, &element?)).collect::<PyResult<Vec<_>>>()?;
        return Ok(format!("[{}]", elements.join(", ")));
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!("{path} is a {kind}. Give a number, True or False, a name, or a list of them.")))
}

/// Entries by their paths relative to a group.
pub(crate) fn plain<'py>(py: Python<'py>, entries: &[Entry], path: &str) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    for entry in entries {
        values.set_item(crate::tree::below(&entry.path, path).unwrap_or(&entry.path), object(py, entry)?)?;
    }
    Ok(values)
}

/// The values of entries, in their order.
pub(crate) fn list<'py>(py: Python<'py>, entries: &[Entry]) -> PyResult<Bound<'py, PyList>> {
    let values = entries.iter().map(|entry| object(py, entry)).collect::<PyResult<Vec<_>>>()?;
    PyList::new(py, values)
}
