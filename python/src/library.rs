//! Friction that was identified on real machines, by name.

use pyo3::prelude::*;
use stickslip::library::{self, Entry, Role};
use stickslip::parameters::flatten;

use crate::array::{Array, ArrayLike};
use crate::error::{Exception, raised};
use crate::friction::Friction;
use crate::preset::Preset;

/// The frictions of the library: name, and what each is.
///
/// >>> import stickslip
/// >>> "emps" in stickslip.friction_library()
/// True
#[pyfunction]
#[pyo3(signature = () -> "dict[str, str]")]
pub(crate) fn friction_library(py: Python<'_>) -> PyResult<Bound<'_, pyo3::types::PyDict>> {
    let all = pyo3::types::PyDict::new(py);
    for name in library::names() {
        all.set_item(name, library::find(name).map_err(|error| raised(py, &error))?.about.title)?;
    }
    Ok(all)
}

/// The friction of the library of that name, or of a file like those of `data/friction`.
///
/// >>> import stickslip
/// >>> servo = stickslip.identified_friction("dc-servo")
/// >>> servo.friction.steady(1.0) > 0.0
/// True
#[pyfunction]
pub(crate) fn identified_friction(py: Python<'_>, source: &str) -> PyResult<IdentifiedFriction> {
    Ok(IdentifiedFriction(library::find(source).map_err(|error| raised(py, &error))?))
}

/// Friction that was identified on a real machine: where it comes from, its numbers, and how far they go.
#[pyclass(frozen, module = "stickslip", name = "IdentifiedFriction")]
pub(crate) struct IdentifiedFriction(Entry);

#[pymethods]
impl IdentifiedFriction {
    /// Its name, or the file that it comes from.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// What it is, in a line.
    #[getter]
    fn title(&self) -> &str {
        &self.0.about.title
    }

    /// Who measured and identified it, and how.
    #[getter]
    fn source(&self) -> &str {
        &self.0.about.source
    }

    /// On what terms it may be used.
    #[getter]
    fn licence(&self) -> &str {
        &self.0.about.licence
    }

    /// The friction model.
    #[getter]
    fn friction(&self, py: Python<'_>) -> PyResult<Friction> {
        Friction::of_law(py, &self.0.identified.friction)
    }

    /// Lowest and highest speed at which something was measured [rad/s]; None where that is not known.
    #[getter]
    fn speeds(&self) -> Option<(f64, f64)> {
        let range = &self.0.identified.range;
        (range.fastest > 0.0).then_some((range.slowest, range.fastest))
    }

    /// Inertia that it was identified with [kg m²]; None where that is not known.
    #[getter]
    fn inertia(&self) -> Option<f64> {
        Some(self.0.identified.range.inertia).filter(|inertia| *inertia > 0.0)
    }

    /// Standard deviations of its parameters by their paths, in their units; those that the source tells.
    #[getter]
    fn standard_deviations(&self) -> std::collections::BTreeMap<String, f64> {
        self.0.about.deviations.clone()
    }

    /// What it cannot represent, what its source does not tell, and the step that follows it.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.0.remarks()
    }

    /// Friction torque [N m] at constant velocities [rad/s] and its standard deviation [N m], as far as the source tells
    /// deviations; as if they were independent.
    ///
    /// >>> import stickslip
    /// >>> torque, deviation = stickslip.identified_friction("emps").torque([1.0, 10.0])
    /// >>> torque.shape, bool((deviation > 0).all())
    /// ((2,), True)
    fn torque(&self, py: Python<'_>, velocity: ArrayLike<'_>) -> PyResult<(Array, Array)> {
        let velocity = velocity.row(py, "velocity")?;
        let (torque, deviation): (Vec<f64>, Vec<f64>) =
            velocity.iter().map(|&velocity| self.0.torque(velocity)).unzip();
        Ok((torque.into(), deviation.into()))
    }

    /// The same motion on a machine of another size: all torques and the inertia multiplied.
    fn scaled(&self, py: Python<'_>, factor: f64) -> PyResult<Self> {
        if factor.is_finite() && factor > 0.0 {
            return Ok(IdentifiedFriction(self.0.scaled(factor)));
        }
        Err(Exception::InvalidValue.with(py, format!("factor = {factor} multiplies torques: choose one above 0.")))
    }

    /// A bench of which this is the friction: as `role` "desired" what the load motor shall render, as "own" what the
    /// machine has and believes that it has, the friction wheel lifted off.
    ///
    /// >>> import stickslip
    /// >>> p = stickslip.preset("prototype")
    /// >>> q = stickslip.identified_friction("dc-servo").on(p)
    /// >>> q.bench.desired == p.bench.desired
    /// False
    #[pyo3(signature = (bench, role = "desired"))]
    fn on(&self, py: Python<'_>, bench: &Preset, role: &str) -> PyResult<Preset> {
        let role = match role {
            "desired" => Role::Desired,
            "own" => Role::Own,
            _ => {
                let words = format!("role = {role:?} is none. There are: desired, own.");
                return Err(Exception::UnknownName.with(py, words));
            }
        };
        let preset = self.0.on(&bench.values, role).map_err(|error| raised(py, &error))?;
        Preset::computed(py, &preset)
    }

    fn __repr__(&self) -> String {
        let values = flatten(&self.0.identified).into_iter().map(|entry| {
            let deviation = self.0.about.deviations.get(&entry.path);
            let deviation = deviation.map_or(String::new(), |deviation| format!(", standard deviation {deviation:e}"));
            format!("    {} = {entry}{deviation}", entry.path)
        });
        std::iter::once(self.0.about.title.clone()).chain(values).collect::<Vec<_>>().join("\n")
    }
}
