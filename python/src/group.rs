//! Group of parameters of a preset.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use stickslip::parameters::Entry;
use stickslip_core::fields::Kind;

use crate::parameter::Parameter;
use crate::preset::{Preset, lines};
use crate::tree::{self, Node, below, join};
use crate::value;

/// Group of parameters, such as `p.model.own`. Read values by attribute or by path, as of a Preset.
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

    /// Values with their paths below another group, as in a file.
    pub(crate) fn settings(&self, path: &str) -> Vec<(String, String)> {
        let value = |entry: &Entry| match entry.value {
            stickslip::parameters::Value::Number(value) if entry.field.kind == Kind::Flag => (value > 0.5).to_string(),
            stickslip::parameters::Value::Number(value) => format!("{value:?}"),
            stickslip::parameters::Value::Variant(name) => name.into(),
        };
        let mut pairs: Vec<(String, String)> = Vec::new();
        for name in tree::names(self.entries(), &self.path) {
            let (from, to) = (join(&self.path, &name), join(path, &name));
            match tree::find(self.entries(), &from) {
                Node::Value(entry) => pairs.push((to, value(entry))),
                // A list is set as a whole: a file does not contain single elements.
                Node::List(list) => {
                    pairs.push((to, format!("[{}]", list.iter().map(value).collect::<Vec<_>>().join(", "))));
                }
                Node::Group | Node::Nothing => {
                    let preset = Python::attach(|py| self.preset.clone_ref(py));
                    pairs.extend(Group::new(preset, from).settings(&to));
                }
            }
        }
        pairs
    }
}

#[pymethods]
impl Group {
    /// Return the value, list or group at a dotted path below. Raises UnknownName.
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
        !matches!(tree::find(self.entries(), &join(&self.path, path)), Node::Nothing)
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

    /// Return the paths of all values, relative to this group.
    fn keys(&self) -> Vec<String> {
        let all = tree::all_below(self.entries(), &self.path).iter();
        all.filter_map(|entry| below(&entry.path, &self.path)).map(String::from).collect()
    }

    /// Return all values by their paths, relative to this group.
    #[pyo3(signature = () -> "dict[str, float | int | bool | str]")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        value::plain(py, tree::all_below(self.entries(), &self.path), &self.path)
    }

    /// Return unit, range, default and meaning of the parameter at a path relative to this group. Raises UnknownName.
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
