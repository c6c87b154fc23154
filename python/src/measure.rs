//! Measurements on the virtual bench.

use pyo3::prelude::*;
use stickslip::experiment::{BreakawayPlan, FrictionPlan, LearningPlan, PreslidingPlan, ResponsePlan, TrackingPlan};
use stickslip::parameters;
use stickslip::workflow::measure::{self, Plan};

use crate::error::{Exception, raised};
use crate::outcome::Outcome;
use crate::parameter::Parameter;
use crate::preset::Preset;
use crate::value::settings;
use crate::watched::watched;

/// Calls a function with the plan of a kind of measurement as its type.
macro_rules! with_plan {
    ($py:expr, $kind:expr, $call:ident $arguments:tt) => {{
        macro_rules! choose {
                                                ($plan:ty) => {
                                                    return $call::<$plan> $arguments
                                                };
                                            }
        let kinds = [
            FrictionPlan::<f64>::KIND,
            BreakawayPlan::<f64>::KIND,
            PreslidingPlan::<f64>::KIND,
            ResponsePlan::<f64>::KIND,
            LearningPlan::<f64>::KIND,
            TrackingPlan::<f64>::KIND,
        ];
        match kinds.iter().position(|kind| *kind == $kind) {
            Some(0) => choose!(FrictionPlan<f64>),
            Some(1) => choose!(BreakawayPlan<f64>),
            Some(2) => choose!(PreslidingPlan<f64>),
            Some(3) => choose!(ResponsePlan<f64>),
            Some(4) => choose!(LearningPlan<f64>),
            Some(5) => choose!(TrackingPlan<f64>),
            _ => {
                let words = format!("{} is no measurement. There are: {}.", $kind, kinds.join(", "));
                Err(Exception::UnknownName.with($py, words))
            }
        }
    }};
}

/// How a measurement is run.
struct How<'a, 'py> {
    preset: &'a Preset,
    plan: Option<&'a Bound<'py, PyAny>>,
    thorough: bool,
    preload: Option<f64>,
    seed: u64,
    progress: Option<&'a Bound<'py, PyAny>>,
}

/// Runs a measurement on the virtual bench of a preset.
#[pyfunction]
#[pyo3(signature = (preset, kind, plan, thorough, preload, seed, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn measure_on_preset(
    py: Python<'_>,
    preset: &Preset,
    kind: &str,
    plan: Option<&Bound<'_, PyAny>>,
    thorough: bool,
    preload: Option<f64>,
    seed: u64,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Outcome> {
    let how = How { preset, plan, thorough, preload, seed, progress };
    with_plan!(py, kind, run(py, &how))
}

/// What can be said of the plan of a measurement: its parameters.
#[pyfunction]
pub(crate) fn plan_of(py: Python<'_>, kind: &str) -> PyResult<Vec<Parameter>> {
    with_plan!(py, kind, describe(py))
}

fn describe<P: Plan>(py: Python<'_>) -> PyResult<Vec<Parameter>> {
    let rows = parameters::describe::<P>("").map_err(|error| raised(py, &error))?;
    Ok(rows.into_iter().map(|description| Parameter { description }).collect())
}

fn run<P: Plan + Send + Sync + 'static>(py: Python<'_>, how: &How<'_, '_>) -> PyResult<Outcome>
where
    P::Outcome: Send + Sync + 'static,
{
    let mut plan = if how.thorough { P::thorough() } else { P::default() };
    if let Some(values) = how.plan {
        let mut changes = Vec::new();
        settings("", values, &mut changes)?;
        let text = parameters::write_commented(&plan);
        let text = parameters::set_all::<P>(&text, "plan", &changes).map_err(|error| raised(py, &error))?;
        plan = parameters::read(&text, "plan").map_err(|problems| raised(py, &problems.into()))?;
    }
    let (preset, preload, seed) = (&how.preset.values, how.preload, how.seed);
    let measured = watched(py, how.progress, move |watch| measure::measure(plan, preset, preload, seed, None, watch))?;
    Ok(Outcome::of(measured))
}
