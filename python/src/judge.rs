//! Design, rendering, and predictions for controllers.

use pyo3::prelude::*;
use stickslip::demo::Demo;
use stickslip::design::{HuntingPlan, Passage, Region};
use stickslip::experiment::FrictionPlan;
use stickslip::workflow::design::{Design, Weighted, through_points};
use stickslip::workflow::hunting::HuntingRun;
use stickslip::workflow::position_loop::LoopRun;
use stickslip::workflow::render::render_run;

use crate::error::raised;
use crate::outcome::Outcome;
use crate::preset::Preset;
use crate::watched::watched;

/// Design the desired friction through points. Returns the preset with it, the outcome, and whether it is renderable.
#[pyfunction]
pub(crate) fn design_for(
    py: Python<'_>,
    preset: &Preset,
    points: Vec<[f64; 2]>,
    acceleration: Option<f64>,
) -> PyResult<(Preset, Outcome, bool)> {
    let mut values = *preset.values;
    let points: Vec<Weighted> = points.into_iter().map(|[speed, torque]| [speed, torque, 1.0]).collect();
    if !points.is_empty() {
        let through = through_points(&points, &values.bench.desired, None).map_err(|error| raised(py, &error))?;
        values.bench.desired = through;
    }
    let preset = Preset::computed(py, &values)?;
    let standard = Passage::default();
    let passage = Passage { acceleration: acceleration.unwrap_or(standard.acceleration), ..standard };
    let region = Region::of(&values.model, &values.bench, passage).map_err(|error| raised(py, &error))?;
    let design = Design { own: values.model.own, desired: values.bench.desired, points, region };
    let renderable = design.verdict().renderable();
    Ok((preset, Outcome::of(design), renderable))
}

/// Render the desired friction of a preset on its virtual bench, and measure the result.
#[pyfunction]
pub(crate) fn render_on(
    py: Python<'_>,
    preset: &Preset,
    corrections: usize,
    seed: u64,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Outcome> {
    let values = &preset.values;
    let run = watched(py, progress, |watch| render_run(&FrictionPlan::quick(), values, corrections, seed, watch))?;
    Ok(Outcome::of(run))
}

/// Run the whole experiment: measure, fit, design, render, measure again.
#[pyfunction]
pub(crate) fn demo_on(
    py: Python<'_>,
    preset: &Preset,
    seed: u64,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Outcome> {
    let values = &preset.values;
    Ok(Outcome::of(watched(py, progress, |watch| Demo::run(values, seed, None, watch))?))
}

/// Analyse the position loop of a preset at a sliding speed [rad/s], with its own or with tuned gains. Returns the
/// preset with that controller, and the outcome.
#[pyfunction]
pub(crate) fn loop_of(
    py: Python<'_>,
    preset: &Preset,
    speed: f64,
    tune: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Preset, Outcome)> {
    let values = &preset.values;
    let run =
        watched(
            py,
            progress,
            |watch| {
                if tune { LoopRun::tuned(values, speed, watch) } else { LoopRun::new(values, speed) }
            },
        )?;
    Ok((Preset::computed(py, &run.preset)?, Outcome::of(run)))
}

/// Predict whether the controller of a preset hunts within a duration [s]. Returns amplitude [rad] and interval [s], or
/// None, and the outcome.
#[pyfunction]
pub(crate) fn hunting_of(
    py: Python<'_>,
    preset: &Preset,
    desired: bool,
    duration: Option<f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Option<(f64, f64)>, Outcome)> {
    let mut values = *preset.values;
    if desired {
        values.model.own = values.bench.desired;
        values.model.own_bristles = values.bench.desired_bristles;
    }
    let plan = duration.map_or_else(HuntingPlan::default, HuntingPlan::lasting);
    let run = watched(py, progress, |watch| HuntingRun::new(&values, &plan, watch))?;
    let hunts = run.prediction.hunting.as_ref().map(|hunting| (hunting.amplitude, hunting.interval));
    Ok((hunts, Outcome::of(run)))
}
