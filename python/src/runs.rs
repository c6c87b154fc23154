//! Runs of a project: the catalogue, and replay of their records.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use stickslip::catalogue::{Catalogue, Found};
use stickslip::run::Stored;

use crate::error::{Exception, raised};
use crate::watched::watched;

/// Runs as JSON with their folders, and hints.
type FoundRuns = (Vec<(String, Option<PathBuf>)>, Vec<String>);

/// Find runs. Returns each as JSON with its folder, None where its files are missing, and hints on ignored terms of the
/// query.
#[pyfunction]
pub(crate) fn runs_of(py: Python<'_>, query: &str, project: Option<PathBuf>, limit: u64) -> PyResult<FoundRuns> {
    let here = Path::new(".");
    let catalogue = match &project {
        Some(project) => Catalogue::of_project(project, here),
        None => Catalogue::in_folder(here),
    };
    let found = py.detach(|| catalogue.runs(query, limit));
    let Found { runs, hints, .. } = found.map_err(|error| raised(py, &error))?;
    let run = |run: &stickslip::catalogue::Run| {
        let text = serde_json::to_string(run).map_err(|error| Exception::Error.with(py, error.to_string()))?;
        Ok((text, catalogue.folder(run.number).ok()))
    };
    Ok((runs.iter().map(run).collect::<PyResult<_>>()?, hints))
}

/// Folder of a run by its number.
#[pyfunction]
pub(crate) fn folder_of_run(py: Python<'_>, number: i64) -> PyResult<PathBuf> {
    Catalogue::in_folder(Path::new(".")).folder(number).map_err(|error| raised(py, &error))
}

/// Result of a replay: cycles, recorded cycles, whether the machine was simulated too, lost cycles, the first
/// difference (cycle, block, signal, recorded and replayed value), the result in a sentence.
type Replayed = (u64, u64, bool, u64, Option<(u64, String, String, f64, f64)>, String);

/// Replay a record.
#[pyfunction]
pub(crate) fn replay_record(py: Python<'_>, path: PathBuf, progress: Option<&Bound<'_, PyAny>>) -> PyResult<Replayed> {
    let replayed = watched(py, progress, move |watch| Stored::open(&path)?.replay(watch))?;
    let text = replayed.to_string();
    let first = replayed.first.map(|it| (it.cycle, it.block.to_owned(), it.signal, it.recorded, it.replayed));
    Ok((replayed.cycles, replayed.of, replayed.machine, replayed.lost, first, text))
}
