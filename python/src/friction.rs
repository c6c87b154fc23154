//! Friction models over arrays.

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use stickslip::parameters;
use stickslip_core::block::Block as _;
use stickslip_core::friction::{self, Contact, FrictionElement, FrictionElementState, Memory, Model, Static, Stribeck};

use crate::array::{Array, ArrayLike};
use crate::error::{Exception, raised};
use crate::preset::Preset;
use crate::tree::below;
use crate::value::settings;

type Law = friction::Friction<f64>;

/// Friction model: static, Dahl, LuGre, elasto-plastic or Maxwell slip, with its dependences on other quantities.
///
/// `values` uses the names of a friction in a parameter file (`stickslip params describe plant.screw_friction`);
/// missing values have their defaults. Raises InvalidValue or UnknownName.
///
/// >>> import numpy as np, stickslip
/// >>> lugre = stickslip.Friction({"model.kind": "lugre", "model.sliding.kinetic_torque": 0.2})
/// >>> lugre.steady(np.array([-10.0, 10.0])).round(3).tolist()
/// [-0.206, 0.206]
#[pyclass(frozen, module = "stickslip", name = "Friction")]
pub(crate) struct Friction {
    law: Law,
    text: String,
}

impl Friction {
    fn of_text(py: Python<'_>, text: String) -> PyResult<Self> {
        let law = parameters::read(&text, "Friction").map_err(|problems| raised(py, &problems.into()))?;
        Ok(Friction { law, text })
    }

    /// The friction of checked values.
    pub(crate) fn of_law(py: Python<'_>, law: &Law) -> PyResult<Self> {
        Self::of_text(py, parameters::write_commented(law))
    }

    /// The friction at a path of a preset, which is a model or a curve.
    pub(crate) fn of_preset(py: Python<'_>, preset: &Preset, path: &str) -> PyResult<Self> {
        let entries = preset.entries();
        let paths = |rows: Vec<parameters::Description>, group: &str| -> Vec<String> {
            rows.iter().filter_map(|row| below(&row.path, group)).map(String::from).collect()
        };
        let exception = |error| raised(py, &error);
        let rows = paths(parameters::describe::<stickslip::Preset<f64>>(path).map_err(exception)?, path);
        // A group with the parameters of a friction is a friction.
        let changes = || {
            let all = entries.iter().filter_map(|entry| Some((below(&entry.path, path)?.to_string(), entry)));
            all.map(|(path, entry)| {
                let value = match entry.value {
                    parameters::Value::Number(value) => format!("{value:?}"),
                    parameters::Value::Variant(name) => name.into(),
                };
                (path, value)
            })
            .collect::<Vec<_>>()
        };
        if rows == paths(parameters::describe::<Law>("").map_err(exception)?, "") {
            Self::of_text(py, parameters::set_all::<Law>("", path, &changes()).map_err(exception)?)
        } else if rows == paths(parameters::describe::<Stribeck<f64>>("").map_err(exception)?, "") {
            let text = parameters::set_all::<Stribeck<f64>>("", path, &changes()).map_err(exception)?;
            let sliding = parameters::read(&text, path).map_err(|problems| raised(py, &problems.into()))?;
            Self::of_law(py, &Law { model: Model::Static(Static { sliding }), ..Law::default() })
        } else {
            let message = format!(
                "{path} is not a friction. Give the path of a friction, such as plant.screw_friction, or of a curve, \
                 such as model.own."
            );
            Err(Exception::UnknownName.with(py, message))
        }
    }
}

#[pymethods]
impl Friction {
    #[new]
    fn new(py: Python<'_>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut changes = Vec::new();
        settings("", values, &mut changes)?;
        let text = parameters::set_all::<Law>("", "Friction", &changes).map_err(|error| raised(py, &error))?;
        Self::of_text(py, text)
    }

    /// Return the friction torque [N m] at constant velocities, positive against positive motion.
    ///
    /// - `velocity`: number or array of any shape [rad/s]; the result has the same shape.
    /// - `angle`: screw angle [rad], for friction that depends on position.
    /// - `load`: load torque [N m], for friction that depends on load.
    ///
    /// >>> import numpy as np, stickslip
    /// >>> wheel = stickslip.preset("prototype").friction("plant.wheel.friction")
    /// >>> wheel.steady(np.linspace(-5, 5, 100)).shape
    /// (100,)
    #[pyo3(signature = (velocity, *, angle = 0.0, load = 0.0))]
    fn steady<'py>(
        &self,
        py: Python<'py>,
        velocity: ArrayLike<'py>,
        angle: f64,
        load: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let velocity = velocity.of_any_shape();
        let law = self.law;
        let torque = py.detach(|| velocity.map(|&velocity| law.steady_torque(velocity, angle, load)));
        match torque.shape() {
            [] => Ok(torque.sum().into_pyobject(py)?.into_any()),
            _ => Ok(Array::from(torque).into_pyobject(py)?),
        }
    }

    /// Compute the friction torque over a velocity trajectory: presliding, breakaway and sliding.
    ///
    /// - `velocity`: one value per step, held during the step [rad/s]. Values at the middle of the steps give second
    ///   order.
    /// - `dt`: length of a step [s].
    /// - `angle` [rad], `load` [N m]: arrays of the same length, for friction that depends on them. Default: 0.
    /// - `arrest`: array of the torques that would stop the load within the step [N m]. Static friction has no
    ///   bristles; at velocity 0 it takes up this torque. Default: 0.
    /// - `deflection`: initial deflection of bristles or elements [rad].
    ///
    /// Returns two arrays: the mean torque of each step [N m], positive against positive motion, and the deflection at
    /// its end [rad]. Raises InvalidValue for an invalid `dt` or arrays of different lengths.
    ///
    /// >>> import numpy as np, stickslip
    /// >>> screw = stickslip.preset("prototype").friction("plant.wheel.friction")
    /// >>> time = np.arange(0, 1, 1e-4)
    /// >>> torque, deflection = screw.course(0.01 * np.cos(2 * np.pi * time), 1e-4)
    /// >>> torque.shape == time.shape
    /// True
    #[pyo3(signature = (velocity, dt, *, angle = None, load = None, arrest = None, deflection = 0.0))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn course<'py>(
        &self,
        py: Python<'py>,
        velocity: ArrayLike<'py>,
        dt: f64,
        angle: Option<ArrayLike<'py>>,
        load: Option<ArrayLike<'py>>,
        arrest: Option<ArrayLike<'py>>,
        deflection: f64,
    ) -> PyResult<(Array, Array)> {
        let invalid = |message: String| Exception::InvalidValue.with(py, message);
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(invalid(format!("dt = {dt} s is not a positive, finite step. Give a time in seconds.")));
        }
        let velocity = velocity.row(py, "velocity")?;
        let count = velocity.len();
        let row = |name: &str, values: &Option<ArrayLike<'py>>| {
            let Some(values) = values else { return Ok(vec![0.0; count]) };
            let values = values.row(py, name)?.to_vec();
            if values.len() == count {
                return Ok(values);
            }
            Err(invalid(format!("{name} has {} values, velocity {count}. Give one for each step.", values.len())))
        };
        let (angle, load, arrest) = (row("angle", &angle)?, row("load", &load)?, row("arrest", &arrest)?);
        let element = FrictionElement { friction: self.law };
        let (torques, deflections) = py.detach(|| {
            let (mut torques, mut deflections) = (Vec::with_capacity(count), Vec::with_capacity(count));
            let mut state = FrictionElementState { memory: Memory::bent(deflection) };
            for step in 0..count {
                let contact =
                    Contact { velocity: velocity[step], angle: angle[step], load: load[step], arrest: arrest[step] };
                torques.push(element.step(&mut state, contact, dt).torque);
                deflections.push(state.memory.deflection);
            }
            (torques, deflections)
        });
        Ok((torques.into(), deflections.into()))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.law == other.law
    }

    #[pyo3(signature = () -> "tuple[object, ...]")]
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let restore = py.import("stickslip._stickslip")?.getattr("_friction")?;
        (restore, (self.text.as_str(),)).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        let lines: Vec<_> = parameters::flatten(&self.law).iter().map(|e| format!("    {} = {e}", e.path)).collect();
        format!("Friction\n{}", lines.join("\n"))
    }
}

/// Restore a friction from its text, for pickle.
#[pyfunction]
pub(crate) fn _friction(py: Python<'_>, text: String) -> PyResult<Friction> {
    Friction::of_text(py, text)
}
