//! A part of a preset.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use stickslip::parameters::Entry;
use stickslip_core::fields::Kind;

use crate::parameter::Parameter;
use crate::preset::{Preset, lines};
use crate::tree::{self, Found, below, join};
use crate::value;

/// Parameters that belong together, as `p.model.own`: read by attribute or by path, like the preset that they are of.
///
/// >>> import stickslip
/// >>> own = stickslip.preset("prototype").model.own
/// >>> print(own.describe("kinetic_torque").unit)
/// N m
#[pyclass(frozen, module = "stickslip", name = "Group")]
pub(crate) struct Group {
    preset: Py<Preset>,
    path: String,
}

impl Group {
    pub(crate) fn new(preset: Py<Preset>, path: String) -> Self {
        Group { preset, path }
    }

    fn entries(&self) -> &[Entry] {
        self.preset.get().entries()
    }

    /// Its values with their paths under another group, as in a file.
    pub(crate) fn settings(&self, path: &str) -> Vec<(String, String)> {
        let value = |entry: &Entry| match entry.value {
            stickslip::parameters::Value::Number(value) if entry.field.kind == Kind::Flag => (value > 0.5).to_string(),
            stickslip::parameters::Value::Number(value) => format!("{value:?}"),
            stickslip::parameters::Value::Variant(name) => name.into(),
        };
        let mut found: Vec<(String, String)> = Vec::new();
        for name in tree::names(self.entries(), &self.path) {
            let (from, to) = (join(&self.path, &name), join(path, &name));
            match tree::find(self.entries(), &from) {
                Found::Value(entry) => found.push((to, value(entry))),
                // A list is set as a whole: its elements may not stand in the file.
                Found::List(list) => {
                    found.push((to, format!("[{}]", list.iter().map(value).collect::<Vec<_>>().join(", "))));
                }
                Found::Group | Found::Nothing => {
                    let preset = Python::attach(|py| self.preset.clone_ref(py));
                    found.extend(Group::new(preset, from).settings(&to));
                }
            }
        }
        found
    }
}

#[pymethods]
impl Group {
    /// What lies at a dotted path below: a value, a list, or a group.
    fn __getitem__<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        Preset::get(self.preset.bind(py), &join(&self.path, path))
    }

    fn __getattr__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        if name.starts_with('_') {
            return Err(pyo3::exceptions::PyAttributeError::new_err(name.to_owned()));
        }
        Preset::get(self.preset.bind(py), &join(&self.path, name))
    }

    fn __contains__(&self, path: &str) -> bool {
        !matches!(tree::find(self.entries(), &join(&self.path, path)), Found::Nothing)
    }

    fn __len__(&self) -> usize {
        tree::all_below(self.entries(), &self.path).len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyList::new(py, self.keys())?.try_iter()?.into_any())
    }

    fn __dir__(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let mut names: Vec<String> = py.get_type::<Self>().dir()?.extract()?;
        names.extend(tree::names(self.entries(), &self.path));
        Ok(names)
    }

    /// The paths of all values below, from here.
    fn keys(&self) -> Vec<String> {
        let all = tree::all_below(self.entries(), &self.path).iter();
        all.filter_map(|entry| below(&entry.path, &self.path)).map(String::from).collect()
    }

    /// All values under their paths from here.
    #[pyo3(signature = () -> "dict[str, float | int | bool | str]")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        value::plain(py, tree::all_below(self.entries(), &self.path), &self.path)
    }

    /// What is known of the parameter at a path from here: unit, range, default, meaning.
    fn describe(&self, py: Python<'_>, path: &str) -> PyResult<Parameter> {
        self.preset.get().describe(py, &join(&self.path, path))
    }

    fn __eq__(&self, other: &Self) -> bool {
        let of = |group: &Self| -> Vec<_> {
            let all = tree::all_below(group.entries(), &group.path).iter();
            all.map(|entry| (below(&entry.path, &group.path).map(String::from), entry.value)).collect()
        };
        of(self) == of(other)
    }

    #[pyo3(signature = () -> "tuple[object, ...]")]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let part = py.import("operator")?.getattr("getitem")?;
        (part, (self.preset.clone_ref(py), self.path.as_str())).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        format!("{}\n{}", self.path, lines(self.entries(), &self.path).replace('\n', "\n    "))
            .replacen('\n', "\n    ", 1)
    }
}
