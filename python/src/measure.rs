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

/// Settings of a measurement.
struct Settings<'a, 'py> {
    preset: &'a Preset,
    plan: Option<&'a Bound<'py, PyAny>>,
    thorough: bool,
    preload: Option<f64>,
    seed: u64,
    progress: Option<&'a Bound<'py, PyAny>>,
}

/// A kind of measurement with its functions.
struct Kind {
    name: &'static str,
    run: fn(Python<'_>, &Settings<'_, '_>) -> PyResult<Outcome>,
    describe: fn(Python<'_>) -> PyResult<Vec<Parameter>>,
}

const KINDS: [Kind; 6] = [
    Kind::of::<FrictionPlan<f64>>(),
    Kind::of::<BreakawayPlan<f64>>(),
    Kind::of::<PreslidingPlan<f64>>(),
    Kind::of::<ResponsePlan<f64>>(),
    Kind::of::<LearningPlan<f64>>(),
    Kind::of::<TrackingPlan<f64>>(),
];

impl Kind {
    const fn of<P: Plan + Send + Sync + 'static>() -> Self
    where
        P::Outcome: Send + Sync + 'static,
    {
        Kind { name: P::KIND, run: run::<P>, describe: describe::<P> }
    }

    fn find(py: Python<'_>, name: &str) -> PyResult<&'static Self> {
        KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| {
            let names: Vec<_> = KINDS.iter().map(|kind| kind.name).collect();
            let message = format!("Unknown measurement {name}. Choose one of: {}.", names.join(", "));
            Exception::UnknownName.with(py, message)
        })
    }
}

/// Run a measurement on the virtual bench of a preset.
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
    let settings = Settings { preset, plan, thorough, preload, seed, progress };
    (Kind::find(py, kind)?.run)(py, &settings)
}

/// List the parameters of a measurement plan.
#[pyfunction]
pub(crate) fn plan_of(py: Python<'_>, kind: &str) -> PyResult<Vec<Parameter>> {
    (Kind::find(py, kind)?.describe)(py)
}

fn describe<P: Plan>(py: Python<'_>) -> PyResult<Vec<Parameter>> {
    let rows = parameters::describe::<P>("").map_err(|error| raised(py, &error))?;
    Ok(rows.into_iter().map(|description| Parameter { description }).collect())
}

fn run<P: Plan + Send + Sync + 'static>(py: Python<'_>, how: &Settings<'_, '_>) -> PyResult<Outcome>
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
