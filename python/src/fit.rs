//! Fits of Stribeck curves to measured friction.

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

/// Stribeck curve fitted to points.
#[pyclass(frozen, module = "stickslip._stickslip", name = "StribeckFit")]
pub(crate) struct Fit {
    fits: FrictionFits,
}

/// Fit a Stribeck curve to velocities, torques or forces, and optional standard errors.
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
            let message = format!("Unknown side \"{side}\". Choose one of: both, positive, negative.");
            return Err(Exception::InvalidValue.with(py, message));
        }
    };
    let (velocity, torque) = (velocity.row(py, "velocity")?, torque.row(py, "torque")?);
    let errors = standard_error.as_ref().map(|errors| errors.row(py, "standard_error")).transpose()?;
    for (name, length) in [("torque", torque.len()), ("standard_error", errors.map_or(velocity.len(), |e| e.len()))] {
        if length != velocity.len() {
            let message = format!("{name} has {length} values, velocity {}. Give one for each point.", velocity.len());
            return Err(Exception::InvalidValue.with(py, message));
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

/// Read friction curves from a file. Returns name and columns of each curve.
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

/// Values of the four parameters by name.
fn named<T>(values: [T; 4]) -> Named<T> {
    Named(PARAMETERS.iter().map(|(name, ..)| *name).zip(values).collect())
}

#[pymethods]
impl Fit {
    /// Values of the parameters by name.
    #[getter]
    fn parameters(&self) -> Named<f64> {
        named(self.fit().parameters)
    }

    /// Standard errors of the parameters; infinite for a parameter that the points do not determine.
    #[getter]
    fn standard_errors(&self) -> Named<f64> {
        named(self.fit().standard_errors)
    }

    /// Ends of the 95 % intervals of the parameters.
    #[getter]
    fn intervals(&self) -> Named<(f64, f64)> {
        named(self.fit().ci95.map(|[low, high]| (low, high)))
    }

    /// Whether the points determine each parameter.
    #[getter]
    fn known(&self) -> Named<bool> {
        named([0, 1, 2, 3].map(|parameter| self.fit().knows(parameter)))
    }

    /// Covariance of the parameters, in the order of `parameters`.
    #[getter]
    fn covariance(&self) -> Array {
        arr2(&self.fit().covariance).into_dyn().into()
    }

    /// Measured minus fitted torque, positive where the measured magnitude is larger, in the order of the points.
    #[getter]
    fn residuals(&self) -> Array {
        self.fit().residuals.clone().into()
    }

    /// Root mean square of the residuals.
    #[getter]
    fn rms(&self) -> f64 {
        self.fit().rms
    }

    /// Weighted sum of squared residuals.
    #[getter]
    fn chi_square(&self) -> f64 {
        self.fit().chi_square
    }

    /// Number of points minus number of parameters.
    #[getter]
    fn degrees_of_freedom(&self) -> usize {
        self.fit().degrees_of_freedom
    }

    /// Deviation of the measured friction from a Stribeck curve, as a standard deviation.
    #[getter]
    fn lack_of_fit(&self) -> f64 {
        self.fit().lack_of_fit
    }

    /// Return the curve at velocities and half the width of its 95 % band.
    fn at(&self, py: Python<'_>, velocity: ArrayLike<'_>) -> PyResult<(Array, Array)> {
        let (fit, curve) = (self.fit(), self.fit().curve());
        let velocity = velocity.row(py, "velocity")?;
        let torque: Vec<f64> = velocity.iter().map(|&velocity| curve.torque(velocity)).collect();
        let band: Vec<f64> = velocity.iter().map(|velocity| fit.band95(velocity.abs())).collect();
        Ok((torque.into(), band.into()))
    }

    /// Return the own friction as part of a parameter file. Raises InvalidValue where the fit has no such parameters.
    fn fragment(&self, py: Python<'_>) -> PyResult<String> {
        match self.fits.fragment().map_err(|error| raised(py, &error))? {
            Ok(text) => Ok(text),
            Err(reason) => Err(Exception::InvalidValue.with(py, format!("No parameters for a preset: {reason}."))),
        }
    }

    /// Return numbers, remarks and report.
    fn outcome(&self) -> Outcome {
        Outcome::of(self.fits.clone())
    }
}
