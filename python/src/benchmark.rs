//! Benchmark of controllers.

use std::path::PathBuf;

use pyo3::prelude::*;
use stickslip::benchmark::{Entrant, FRICTIONS, HOUSE, MANOEUVRES, Plan, run_plan};
use stickslip::fidelity::by_name;

use crate::error::raised;
use crate::outcome::Outcome;
use crate::preset::Preset;
use crate::watched::watched;

/// Run controllers on frictions and manoeuvres. Finished cells are stored in the folder and reused from there.
#[pyfunction]
#[pyo3(signature = (preset, machine, controllers, frictions, manoeuvres, quick, seeds, places, threads, folder, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn benchmark_on(
    py: Python<'_>,
    preset: &Preset,
    machine: String,
    controllers: Option<Vec<String>>,
    frictions: Option<Vec<String>>,
    manoeuvres: Option<Vec<String>>,
    quick: bool,
    seeds: Option<u64>,
    places: Option<u64>,
    threads: Option<usize>,
    folder: PathBuf,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Outcome> {
    let refused = |error| raised(py, &error);
    let names = controllers.unwrap_or_else(|| HOUSE.map(String::from).to_vec());
    let entrants = names.iter().map(|name| Entrant::find(name)).collect::<Result<Vec<_>, _>>().map_err(refused)?;
    let mut plan = Plan::new(machine, *preset.values, entrants);
    if quick {
        plan = plan.quick();
    }
    if let Some(frictions) = frictions {
        plan.frictions = by_name("friction", &frictions, &FRICTIONS, |it| it.name).map_err(refused)?;
    }
    if let Some(manoeuvres) = manoeuvres {
        plan.manoeuvres = by_name("manoeuvre", &manoeuvres, &MANOEUVRES, |it| it.name()).map_err(refused)?;
    }
    plan.seeds = seeds.unwrap_or(plan.seeds);
    plan.places = places.unwrap_or(plan.places);
    plan.threads = threads.unwrap_or(plan.threads);
    Ok(Outcome::of(watched(py, progress, move |watch| run_plan(&plan, &folder, watch))?))
}
