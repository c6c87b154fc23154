//! Stribeck curves through measured friction.

use std::path::PathBuf;

use numpy::ndarray::arr2;
use pyo3::prelude::*;
use stickslip::curve_file::{CurveColumns, read_curves};
use stickslip::fit::{CurvePoint, PARAMETERS, Side, StribeckFit};
use stickslip::machine::Axis;
use stickslip::table::Column;
use stickslip::workflow::fit::{Fitted, FrictionFits};

use crate::array::{Array, ArrayLike};
use crate::error::{Exception, raised};
use crate::outcome::{Arrays, Outcome, arrays};
use crate::value::Named;

/// A Stribeck curve through points.
#[pyclass(frozen, module = "stickslip._stickslip", name = "StribeckFit")]
pub(crate) struct Fit {
    fits: FrictionFits,
}

/// Fits points: velocities, torques or forces, and their standard errors where they are known.
#[pyfunction]
#[pyo3(signature = (velocity, torque, standard_error, side, linear, preload, source))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn fit_points<'py>(
    py: Python<'py>,
    velocity: ArrayLike<'py>,
    torque: ArrayLike<'py>,
    standard_error: Option<ArrayLike<'py>>,
    side: &str,
    linear: bool,
    preload: Option<f64>,
    source: String,
) -> PyResult<Fit> {
    let side = match side {
        "both" => Side::Both,
        "positive" => Side::Positive,
        "negative" => Side::Negative,
        _ => {
            let words = format!("side = \"{side}\" is none. Choose one of: both, positive, negative.");
            return Err(Exception::InvalidValue.with(py, words));
        }
    };
    let (velocity, torque) = (velocity.row(py, "velocity")?, torque.row(py, "torque")?);
    let errors = standard_error.as_ref().map(|errors| errors.row(py, "standard_error")).transpose()?;
    for (name, length) in [("torque", torque.len()), ("standard_error", errors.map_or(velocity.len(), |e| e.len()))] {
        if length != velocity.len() {
            let words = format!("{name} has {length} values, velocity {}. Give one for each point.", velocity.len());
            return Err(Exception::InvalidValue.with(py, words));
        }
    }
    let point = |index: usize| CurvePoint {
        velocity: velocity[index],
        torque: torque[index],
        standard_error: errors.map_or(1.0, |errors| errors[index]),
    };
    let points: Vec<_> = (0..velocity.len()).map(point).collect();
    let name = if side == Side::Both { String::new() } else { format!("{side:?}").to_lowercase() };
    let weighted = errors.is_some();
    let fitted = py.detach(|| Fitted::of(name, &points, side, weighted)).map_err(|error| raised(py, &error))?;
    let axis = if linear { Axis::Linear } else { Axis::Rotary };
    Ok(Fit { fits: FrictionFits { file: source.into(), axis, preload, fits: vec![fitted] } })
}

/// Reads friction curves of a file: name and columns of each.
#[pyfunction]
#[pyo3(signature = (path, velocity, torque, standard_error, group))]
pub(crate) fn curves_of(
    py: Python<'_>,
    path: PathBuf,
    velocity: Option<String>,
    torque: Option<String>,
    standard_error: Option<String>,
    group: Option<String>,
) -> PyResult<Vec<(String, Arrays)>> {
    let columns = CurveColumns { velocity, torque, standard_error, group };
    let read = py.detach(|| read_curves(&path, &columns)).map_err(|error| raised(py, &error))?;
    let [speed, torque] = if read.axis == Axis::Linear { ["m/s", "N"] } else { ["rad/s", "N m"] };
    let curves = read.curves.into_iter().map(|curve| {
        let column = |name: &str, unit: &str, value: fn(&CurvePoint) -> f64| Column {
            name: name.into(),
            unit: unit.into(),
            values: curve.points.iter().map(value).collect(),
        };
        let mut columns =
            vec![column("velocity", speed, |point| point.velocity), column("torque", torque, |point| point.torque)];
        if read.weighted {
            columns.push(column("standard_error", torque, |point| point.standard_error));
        }
        (curve.name.clone(), arrays(columns))
    });
    Ok(curves.collect())
}

impl Fit {
    fn fitted(&self) -> &Fitted {
        &self.fits.fits[0]
    }

    fn fit(&self) -> &StribeckFit {
        &self.fitted().fit
    }
}

/// Values of the four parameters under their names.
fn named<T>(values: [T; 4]) -> Named<T> {
    Named(PARAMETERS.iter().map(|(name, ..)| *name).zip(values).collect())
}

#[pymethods]
impl Fit {
    /// Values of the parameters.
    #[getter]
    fn parameters(&self) -> Named<f64> {
        named(self.fit().parameters)
    }

    /// Their standard errors; infinite where the points do not tell a parameter.
    #[getter]
    fn standard_errors(&self) -> Named<f64> {
        named(self.fit().standard_errors)
    }

    /// Ends of their 95 % intervals.
    #[getter]
    fn intervals(&self) -> Named<(f64, f64)> {
        named(self.fit().ci95.map(|[low, high]| (low, high)))
    }

    /// Whether the points tell each of them.
    #[getter]
    fn known(&self) -> Named<bool> {
        named([0, 1, 2, 3].map(|parameter| self.fit().knows(parameter)))
    }

    /// Covariance of the parameters, in the order of `parameters`.
    #[getter]
    fn covariance(&self) -> Array {
        arr2(&self.fit().covariance).into_dyn().into()
    }

    /// Measured less fitted, positive away from zero, in the order of the points that count.
    #[getter]
    fn residuals(&self) -> Array {
        self.fit().residuals.clone().into()
    }

    /// Root mean square of the residuals.
    #[getter]
    fn rms(&self) -> f64 {
        self.fit().rms
    }

    /// Weighted sum of their squares.
    #[getter]
    fn chi_square(&self) -> f64 {
        self.fit().chi_square
    }

    /// Points less parameters.
    #[getter]
    fn degrees_of_freedom(&self) -> usize {
        self.fit().degrees_of_freedom
    }

    /// How far the form of the curve is from the friction that was measured, as a standard deviation.
    #[getter]
    fn lack_of_fit(&self) -> f64 {
        self.fit().lack_of_fit
    }

    /// The curve at velocities, and half the width of its 95 % band there.
    fn at(&self, py: Python<'_>, velocity: ArrayLike<'_>) -> PyResult<(Array, Array)> {
        let (fit, curve) = (self.fit(), self.fit().curve());
        let velocity = velocity.row(py, "velocity")?;
        let torque: Vec<f64> = velocity.iter().map(|&velocity| curve.torque(velocity)).collect();
        let band: Vec<f64> = velocity.iter().map(|velocity| fit.band95(velocity.abs())).collect();
        Ok((torque.into(), band.into()))
    }

    /// The own friction as a part of a parameter file.
    fn fragment(&self, py: Python<'_>) -> PyResult<String> {
        match self.fits.fragment().map_err(|error| raised(py, &error))? {
            Ok(text) => Ok(text),
            Err(reason) => Err(Exception::InvalidValue.with(py, format!("no parameters for a preset: {reason}."))),
        }
    }

    /// Numbers, remarks and report.
    fn outcome(&self) -> Outcome {
        Outcome::of(self.fits.clone())
    }
}
