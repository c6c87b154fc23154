//! Simulation of the closed loop, with the controller of the preset or one written in Python.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use stickslip::Watch;
use stickslip::benchmark::{MANOEUVRES, Manoeuvre};
use stickslip::fidelity::by_name;
use stickslip::parameters;
use stickslip::simulation::{Sample, Simulation, simulate};
use stickslip_core::control::reference::{Generator, Reference};

use crate::array::ArrayLike;
use crate::error::raised;
use crate::outcome::{Arrays, arrays};
use crate::preset::Preset;
use crate::value::settings;
use crate::watched::watched;

/// Samples of a Python controller between two checks of signals.
const LOOK: u32 = 256;

/// Set-point of a controller at a sample.
#[pyclass(frozen, get_all, module = "stickslip", name = "Setpoint")]
pub(crate) struct Setpoint {
    /// Screw angle [rad].
    position: f64,
    /// First derivative of the screw angle [rad/s].
    velocity: f64,
    /// Second derivative of the screw angle [rad/s²].
    acceleration: f64,
}

/// Measurement of a controller at a sample.
#[pyclass(frozen, get_all, module = "stickslip", name = "Measured")]
pub(crate) struct Measured {
    /// Time since the start of the run [s].
    time: f64,
    /// Screw angle from the encoder, unwrapped [rad].
    angle: f64,
    /// Motor velocity from the tacho [rad/s].
    velocity: f64,
}

#[pymethods]
impl Setpoint {
    fn __repr__(&self) -> String {
        let Setpoint { position, velocity, acceleration } = self;
        format!(
            "Setpoint(position={position:?} rad, velocity={velocity:?} rad/s, acceleration={acceleration:?} rad/s²)"
        )
    }
}

#[pymethods]
impl Measured {
    fn __repr__(&self) -> String {
        let Measured { time, angle, velocity } = self;
        format!("Measured(time={time:?} s, angle={angle:?} rad, velocity={velocity:?} rad/s)")
    }
}

/// Cause of an early end: an error of the library, or an exception of the controller.
enum Ended {
    Refused(stickslip::Error),
    Raised(PyErr),
}

impl From<stickslip::Error> for Ended {
    fn from(error: stickslip::Error) -> Self {
        Ended::Refused(error)
    }
}

/// Source of the set-points: samples of the position at a rate, or a reference.
enum Course {
    Samples(Vec<f64>, f64),
    Reference(Reference<f64>),
}

impl Course {
    /// Converts the argument of Python. Returns the duration as well [s].
    fn of(py: Python<'_>, preset: &Preset, reference: &Bound<'_, PyAny>, chance: f64) -> PyResult<(Self, f64)> {
        let refused = |error| raised(py, &error);
        if let Ok(name) = reference.extract::<String>() {
            let manoeuvre: Manoeuvre = by_name("manoeuvre", &[name], &MANOEUVRES, |it| it.name()).map_err(refused)?[0];
            let (reference, duration) = manoeuvre.reference(&preset.values, chance);
            return Ok((Course::Reference(reference), duration));
        }
        let mut changes = Vec::new();
        if settings("", reference, &mut changes).is_ok() && !changes.iter().any(|(path, _)| path.is_empty()) {
            let text = parameters::set_all::<Reference<f64>>("", "reference", &changes).map_err(refused)?;
            let reference: Reference<f64> =
                parameters::read(&text, "reference").map_err(|problems| raised(py, &problems.into()))?;
            let duration = reference.duration();
            return Ok((Course::Reference(reference), duration));
        }
        if let Ok(samples) = reference.extract::<ArrayLike<'_>>() {
            let samples = samples.row(py, "reference")?.to_vec();
            let rate = 1.0 / preset.values.bench.control_period();
            let duration = samples.len() as f64 / rate;
            return Ok((Course::Samples(samples, rate), duration));
        }
        let message = "Invalid reference. Give the name of a manoeuvre, a mapping such as {\"reference\": \"sine\", \
                       \"amplitude\": 2}, or an array of positions, one for each sample of the controller.";
        Err(PyTypeError::new_err(message))
    }

    fn generator(&self, rate: f64) -> Generator<'_> {
        match self {
            Course::Samples(samples, sample_rate) => Generator::from_samples(samples, *sample_rate, rate),
            Course::Reference(reference) => Generator::new(*reference, rate),
        }
    }
}

/// Simulate the closed loop of a preset. Returns the signals, and the reason for an early end.
#[pyfunction]
#[pyo3(signature = (preset, reference, duration, controller, render, rest, place, seed, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn simulate_on<'py>(
    py: Python<'py>,
    preset: &Preset,
    reference: &Bound<'py, PyAny>,
    duration: Option<f64>,
    controller: Option<&Bound<'py, PyAny>>,
    render: bool,
    rest: f64,
    place: f64,
    seed: u64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Arrays, Option<String>)> {
    let (course, whole) = Course::of(py, preset, reference, place)?;
    let setpoints = course.generator(preset.values.bench.tick_rate);
    let duration = duration.unwrap_or(whole);
    let simulation = Simulation { preset: &preset.values, setpoints, duration, rest, render, seed };
    let simulated = match controller {
        None => watched(py, progress, |watch| simulate::<stickslip::Error>(&simulation, None, watch))?,
        Some(controller) => {
            let mut calls = 0u32;
            let mut step = |sample: &Sample| {
                calls = calls.wrapping_add(1);
                if calls.is_multiple_of(LOOK) {
                    py.check_signals().map_err(Ended::Raised)?;
                    let done = sample.time / (rest + duration);
                    let reported = progress.map_or(Ok(()), |call| call.call1(("simulate", done)).map(drop));
                    reported.map_err(Ended::Raised)?;
                }
                torque(py, controller, sample).map_err(Ended::Raised)
            };
            simulate(&simulation, Some(&mut step), &Watch::silent()).map_err(|ended| match ended {
                Ended::Refused(error) => raised(py, &error),
                Ended::Raised(error) => error,
            })?
        }
    };
    Ok((arrays(simulated.columns), simulated.stopped))
}

/// Calls a Python controller. Returns its torque [N m].
fn torque(py: Python<'_>, controller: &Bound<'_, PyAny>, sample: &Sample) -> PyResult<f64> {
    let Sample { time, reference, measured_angle, measured_velocity } = *sample;
    let setpoint =
        Setpoint { position: reference.position, velocity: reference.velocity, acceleration: reference.acceleration };
    let measured = Measured { time, angle: measured_angle, velocity: measured_velocity };
    let torque = controller.call1((Bound::new(py, setpoint)?, Bound::new(py, measured)?))?;
    torque.extract().map_err(|_| {
        let kind = torque.get_type().name().map_or_else(|_| "something else".into(), |name| name.to_string());
        PyTypeError::new_err(format!("The controller returned a {kind}, not a torque. Return a number in N m."))
    })
}
