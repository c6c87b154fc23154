//! Presets: complete parameter sets.

use std::sync::OnceLock;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use stickslip::parameters::presets::Source;
use stickslip::parameters::{self, Difference, Entry};

use crate::error::{Exception, raised};
use crate::friction::Friction;
use crate::group::Group;
use crate::parameter::Parameter;
use crate::tree::{self, Node};
use crate::value::{self, Named, settings};

/// Parameters of a bench: virtual machine (`plant`), model used by the software (`model`), settings (`bench`).
///
/// Read values by attribute or by path, all in SI units. A preset is immutable: `set` returns a new one.
///
/// >>> import stickslip
/// >>> p = stickslip.preset("prototype")
/// >>> p["model.own.breakaway_torque"] == p.model.own.breakaway_torque
/// True
/// >>> stiff = p.set({"bench.tick_rate": 8000})
/// >>> stiff.bench.tick_rate, p.bench.tick_rate
/// (8000.0, 4000.0)
#[pyclass(frozen, module = "stickslip", name = "Preset")]
pub(crate) struct Preset {
    pub(crate) values: Box<stickslip::Preset<f64>>,
    file: String,
    text: String,
    entries: OnceLock<Vec<Entry>>,
}

/// Load a preset by name, from a parameter file or from text.
///
/// - `source`: a name from `presets()`, or the path of a file.
/// - `text`: the text of a parameter file (TOML), instead of `source`.
///
/// Raises UnknownName for an unknown name, FileError where the file cannot be read, InvalidValue for errors in it.
///
/// >>> import stickslip
/// >>> stickslip.preset("clm-bench").bench.tick_rate
/// 4000.0
/// >>> stickslip.preset(text="[model.own]\nkinetic_torque = 0.2").model.own.kinetic_torque
/// 0.2
#[pyfunction]
#[pyo3(signature = (source = None, *, text = None))]
pub(crate) fn preset(py: Python<'_>, source: Option<String>, text: Option<String>) -> PyResult<Preset> {
    match (source, text) {
        (Some(source), None) => {
            let source = parameters::presets::find(&source).map_err(|error| raised(py, &error))?;
            Preset::of_text(py, source.text, source.file)
        }
        (None, Some(text)) => Preset::of_text(py, text, "text".into()),
        _ => Err(Exception::InvalidValue.with(py, "Give either the name of a preset or file, or text=.".into())),
    }
}

/// List the built-in presets: names and descriptions.
///
/// >>> import stickslip
/// >>> "prototype" in stickslip.presets()
/// True
#[pyfunction]
pub(crate) fn presets() -> Named<&'static str> {
    Named(parameters::presets::list().collect())
}

impl Preset {
    /// The preset of a text; `file` is its name in messages.
    pub(crate) fn of_text(py: Python<'_>, text: String, file: String) -> PyResult<Self> {
        let values = parameters::read(&text, &file).map_err(|problems| raised(py, &problems.into()))?;
        Ok(Preset { values: Box::new(values), file, text, entries: OnceLock::new() })
    }

    /// The preset of computed values.
    pub(crate) fn computed(py: Python<'_>, values: &stickslip::Preset<f64>) -> PyResult<Self> {
        Self::of_text(py, parameters::write_commented(values), "computed".into())
    }

    /// The text, and its name in messages.
    pub(crate) fn source(&self) -> Source {
        Source { file: self.file.clone(), text: self.text.clone() }
    }

    /// All values.
    pub(crate) fn entries(&self) -> &[Entry] {
        self.entries.get_or_init(|| parameters::flatten(&*self.values))
    }

    /// The value, list or group at a path.
    pub(crate) fn get<'py>(this: &Bound<'py, Self>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        let (py, preset) = (this.py(), this.get());
        match tree::find(preset.entries(), path) {
            Node::Value(entry) => value::object(py, entry),
            Node::List(list) => Ok(value::list(py, list)?.into_any()),
            Node::Group => Ok(Bound::new(py, Group::new(this.clone().unbind(), path.into()))?.into_any()),
            Node::Nothing => Err(preset.unknown(py, path)),
        }
    }

    /// The error for a path without a value.
    fn unknown(&self, py: Python<'_>, path: &str) -> PyErr {
        match parameters::describe::<stickslip::Preset<f64>>(path) {
            Err(error) => raised(py, &error),
            Ok(rows) => {
                let with = rows[0].only_with.clone().unwrap_or_default();
                Exception::UnknownName.with(py, format!("{path} exists only with {with}. Set that first."))
            }
        }
    }

    /// Whether the choice that `only_with` of a description requires is made: `friction.model = "lugre"`.
    fn chooses(&self, only_with: Option<&str>) -> bool {
        only_with.and_then(|with| with.split_once(" = ")).is_none_or(|(tag, variant)| {
            let chosen = self.entries().iter().find(|entry| entry.path == tag);
            chosen.is_some_and(|entry| entry.to_string() == variant.trim_matches('"'))
        })
    }
}

#[pymethods]
impl Preset {
    /// Return the value, list or group at a dotted path. Raises UnknownName.
    fn __getitem__<'py>(this: &Bound<'py, Self>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        Self::get(this, path)
    }

    fn __getattr__<'py>(this: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        if name.starts_with('_') {
            // Python looks up special names on every object; these are not parameters.
            return Err(pyo3::exceptions::PyAttributeError::new_err(name.to_owned()));
        }
        Self::get(this, name)
    }

    fn __contains__(&self, path: &str) -> bool {
        !matches!(tree::find(self.entries(), path), Node::Nothing)
    }

    fn __len__(&self) -> usize {
        self.entries().len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyList::new(py, self.keys())?.try_iter()?.into_any())
    }

    fn __dir__(this: &Bound<'_, Self>) -> PyResult<Vec<String>> {
        let mut names: Vec<String> = this.py().get_type::<Self>().dir()?.extract()?;
        names.extend(tree::names(this.get().entries(), ""));
        Ok(names)
    }

    /// Return the paths of all values, in the order of a parameter file.
    fn keys(&self) -> Vec<String> {
        self.entries().iter().map(|entry| entry.path.clone()).collect()
    }

    /// Return all values by their paths.
    ///
    /// >>> import stickslip
    /// >>> stickslip.preset("prototype").to_dict()["bench.tick_rate"]
    /// 4000.0
    #[pyo3(signature = () -> "dict[str, float | int | bool | str]")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        value::plain(py, self.entries(), "")
    }

    /// Return a copy with other values.
    ///
    /// `values` maps paths to values. A mapping as value sets parameters below its path; a group of a preset replaces
    /// the whole group. All values are checked together. Raises UnknownName for an unknown path, TypeError for a wrong
    /// type, InvalidValue for a value outside its range or inconsistent values.
    ///
    /// >>> import stickslip
    /// >>> p = stickslip.preset("prototype")
    /// >>> q = p.set({"model.own": {"breakaway_torque": 0.4, "kinetic_torque": 0.2}, "bench.desired": p.model.own})
    /// >>> q.model.own.breakaway_torque
    /// 0.4
    /// >>> p.set({"bench.tick_rate": -1})
    /// Traceback (most recent call last):
    /// stickslip.InvalidValue: bench.tick_rate = -1 Hz is outside 500 … 20000 Hz (presets/prototype.toml:...
    fn set(&self, py: Python<'_>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut changes = Vec::new();
        settings("", values, &mut changes)?;
        let text = parameters::set_all::<stickslip::Preset<f64>>(&self.text, &self.file, &changes);
        Self::of_text(py, text.map_err(|error| raised(py, &error))?, self.file.clone())
    }

    /// Return unit, range, default and meaning of the parameter at a path. Raises UnknownName.
    ///
    /// >>> import stickslip
    /// >>> print(stickslip.preset("prototype").describe("bench.tick_rate"))
    /// bench.tick_rate
    ///     f_tick [Hz], 500 … 20000, default 4000
    ///     Rate of sensors, observer, rendering law and load-motor current control.
    pub(crate) fn describe(&self, py: Python<'_>, path: &str) -> PyResult<Parameter> {
        let rows = self.descriptions(py, path)?;
        let one = rows.iter().all(|row| row.description.path == rows[0].description.path);
        if !one {
            let message = format!("{path} is a group of parameters. Use `descriptions` to list them.");
            return Err(Exception::UnknownName.with(py, message));
        }
        let active = rows.iter().position(|row| self.chooses(row.description.only_with.as_deref())).unwrap_or(0);
        Ok(rows.into_iter().nth(active).expect("a known path has a description"))
    }

    /// List the descriptions of all parameters at or below a path. Default: all parameters.
    ///
    /// A parameter of several variants of a choice is listed once for each variant. Raises UnknownName.
    ///
    /// >>> import stickslip
    /// >>> [it.symbol for it in stickslip.preset("prototype").descriptions("model.own")][:2]
    /// ['M_S', 'M_K']
    #[pyo3(signature = (path = ""))]
    fn descriptions(&self, py: Python<'_>, path: &str) -> PyResult<Vec<Parameter>> {
        let rows = parameters::describe::<stickslip::Preset<f64>>(path).map_err(|error| raised(py, &error))?;
        Ok(rows.into_iter().map(|description| Parameter { description }).collect())
    }

    /// List the differences to another preset: path, value here, value in `other`; None for a missing value.
    ///
    /// >>> import stickslip
    /// >>> p = stickslip.preset("prototype")
    /// >>> p.diff(p.set({"bench.tick_rate": 8000}))
    /// [('bench.tick_rate', 4000.0, 8000.0)]
    #[pyo3(signature = (other) -> "list[tuple[str, float | int | bool | str | None, float | int | bool | str | None]]")]
    fn diff<'py>(&self, py: Python<'py>, other: &Self) -> PyResult<Bound<'py, PyList>> {
        let one = |entry: &Option<Entry>| entry.as_ref().map(|entry| value::object(py, entry)).transpose();
        let all = parameters::diff(&*self.values, &*other.values);
        let rows = all.iter().map(|Difference { path, before, after }| Ok((path.as_str(), one(before)?, one(after)?)));
        PyList::new(py, rows.collect::<PyResult<Vec<_>>>()?)
    }

    /// Return the friction at a path: of the virtual machine (`plant.screw_friction`), or a curve (`model.own`).
    /// Raises UnknownName where the path is not a friction.
    ///
    /// >>> import stickslip
    /// >>> p = stickslip.preset("prototype")
    /// >>> p.friction("model.own").steady(1e-6) > 0.9 * p.model.own.breakaway_torque
    /// True
    fn friction(&self, py: Python<'_>, path: &str) -> PyResult<Friction> {
        Friction::of_preset(py, self, path)
    }

    /// Return the text of the parameter file with all changes, comments preserved.
    ///
    /// - `complete`: write every parameter, with unit, range and meaning as comments.
    ///
    /// >>> import stickslip
    /// >>> p = stickslip.preset("prototype")
    /// >>> stickslip.preset(text=p.toml(complete=True)) == p
    /// True
    #[pyo3(signature = (*, complete = false))]
    fn toml(&self, complete: bool) -> String {
        if complete { parameters::write_commented(&*self.values) } else { self.text.clone() }
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.values == other.values
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        for entry in self.entries() {
            entry.to_string().hash(&mut hasher);
        }
        hasher.finish()
    }

    fn __copy__(this: Py<Self>) -> Py<Self> {
        this
    }

    fn __deepcopy__(this: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        this
    }

    #[pyo3(signature = () -> "tuple[object, ...]")]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let restore = py.import("stickslip._stickslip")?.getattr("_restored")?;
        (restore, (self.text.as_str(), self.file.as_str())).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        format!("Preset of {}: {} values", self.file, self.entries().len())
    }

    fn __str__(&self) -> String {
        lines(self.entries(), "")
    }
}

/// Restore a preset from its text, for pickle; `file` is its name in messages.
#[pyfunction]
pub(crate) fn _restored(py: Python<'_>, text: String, file: String) -> PyResult<Preset> {
    Preset::of_text(py, text, file)
}

/// All values below a group with their units, one per line.
pub(crate) fn lines(entries: &[Entry], group: &str) -> String {
    let all = tree::all_below(entries, group);
    let line = |entry: &Entry| format!("{} = {entry}", tree::below(&entry.path, group).unwrap_or(&entry.path));
    all.iter().map(line).collect::<Vec<_>>().join("\n")
}
