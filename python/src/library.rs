//! Library of frictions identified on physical machines.

use pyo3::prelude::*;
use stickslip::library::{self, Entry, Role};
use stickslip::parameters::flatten;

use crate::array::{Array, ArrayLike};
use crate::error::{Exception, raised};
use crate::friction::Friction;
use crate::preset::Preset;

/// List the frictions of the library: names and titles.
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

/// Return a friction of the library by name, or of a file in the format of `data/friction`. Raises UnknownName.
///
/// >>> import stickslip
/// >>> servo = stickslip.identified_friction("dc-servo")
/// >>> servo.friction.steady(1.0) > 0.0
/// True
#[pyfunction]
pub(crate) fn identified_friction(py: Python<'_>, source: &str) -> PyResult<IdentifiedFriction> {
    Ok(IdentifiedFriction(library::find(source).map_err(|error| raised(py, &error))?))
}

/// Friction identified on a physical machine: source, parameters, and range of validity.
#[pyclass(frozen, module = "stickslip", name = "IdentifiedFriction")]
pub(crate) struct IdentifiedFriction(Entry);

#[pymethods]
impl IdentifiedFriction {
    /// Name in the library, or file.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Short description.
    #[getter]
    fn title(&self) -> &str {
        &self.0.about.title
    }

    /// Source of the data and method of identification.
    #[getter]
    fn source(&self) -> &str {
        &self.0.about.source
    }

    /// Licence terms.
    #[getter]
    fn licence(&self) -> &str {
        &self.0.about.licence
    }

    /// Friction model.
    #[getter]
    fn friction(&self, py: Python<'_>) -> PyResult<Friction> {
        Friction::of_law(py, &self.0.identified.friction)
    }

    /// Lowest and highest speed of the measurement [rad/s]; None if unknown.
    #[getter]
    fn speeds(&self) -> Option<(f64, f64)> {
        let range = &self.0.identified.range;
        (range.fastest > 0.0).then_some((range.slowest, range.fastest))
    }

    /// Inertia used in the identification [kg m²]; None if unknown.
    #[getter]
    fn inertia(&self) -> Option<f64> {
        Some(self.0.identified.range.inertia).filter(|inertia| *inertia > 0.0)
    }

    /// Standard deviations of the parameters by path, in their units, as far as the source states them.
    #[getter]
    fn standard_deviations(&self) -> std::collections::BTreeMap<String, f64> {
        self.0.about.deviations.clone()
    }

    /// Limits of the model, data missing in the source, and the recommended next step.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.0.remarks()
    }

    /// Return friction torque and standard deviation [N m] at constant velocities [rad/s].
    ///
    /// The deviation combines the parameter deviations that the source states, assumed independent.
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

    /// Scale to a machine of another size: multiply all torques and the inertia by `factor`. The motion is the same.
    /// Raises InvalidValue for a factor that is not positive and finite.
    fn scaled(&self, py: Python<'_>, factor: f64) -> PyResult<Self> {
        if factor.is_finite() && factor > 0.0 {
            return Ok(IdentifiedFriction(self.0.scaled(factor)));
        }
        let message = format!("factor = {factor} is not positive and finite. Give a number above 0.");
        Err(Exception::InvalidValue.with(py, message))
    }

    /// Return a preset with this friction.
    ///
    /// - `role`: "desired", the friction to render; or "own", the friction of the virtual machine and of its model,
    ///   with the friction wheel released.
    ///
    /// Raises UnknownName for another role.
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
                let message = format!("Unknown role {role:?}. Choose one of: desired, own.");
                return Err(Exception::UnknownName.with(py, message));
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
