//! Fidelity: comparison of rendered and true friction.

use pyo3::prelude::*;
use stickslip::fidelity::{Selection, run_plan};

use crate::error::raised;
use crate::outcome::Outcome;
use crate::watched::watched;

/// Compare rendered with true friction.
#[pyfunction]
#[pyo3(signature = (presets, laws, rates, wheel, mismatches, observers, scenarios, quick, seeds, threads, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn fidelity_of(
    py: Python<'_>,
    presets: Vec<String>,
    laws: Vec<String>,
    rates: Vec<f64>,
    wheel: Option<bool>,
    mismatches: Vec<String>,
    observers: Vec<String>,
    scenarios: Vec<String>,
    quick: bool,
    seeds: Option<u64>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Outcome> {
    let threads = threads.unwrap_or(0);
    let selection = Selection { quick, seeds, presets, laws, rates, wheel, mismatches, observers, scenarios, threads };
    let plan = selection.plan().map_err(|error| raised(py, &error))?;
    Ok(Outcome::of(watched(py, progress, move |watch| run_plan(&plan, watch))?))
}
