//! Parameter studies, part by part: run here, or by whoever is sent what it takes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use stickslip::study::{Parts, Work, read, read_text};

use crate::array::Array;
use crate::error::raised;
use crate::outcome::{Arrays, Outcome, arrays};
use crate::preset::Preset;
use crate::watched::watched;

/// A study in its folder.
#[pyclass(frozen, module = "stickslip._stickslip", name = "StudyParts")]
pub(crate) struct StudyParts(Parts);

/// What it takes to run the parts of a study, wherever.
#[pyclass(frozen, module = "stickslip._stickslip", name = "StudyWork")]
pub(crate) struct StudyWork(Work);

/// Opens the study of a file, or of a text that a program made, on a preset instead of the one that the text names.
#[pyfunction]
#[pyo3(signature = (file, text, preset, folder, progress))]
pub(crate) fn open_study(
    py: Python<'_>,
    file: Option<PathBuf>,
    text: &str,
    preset: Option<&Preset>,
    folder: PathBuf,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<StudyParts> {
    let plan = match file {
        Some(file) => read(Path::new(&file)),
        None => read_text(text, preset.map(Preset::source)),
    };
    let plan = plan.map_err(|error| raised(py, &error))?;
    Ok(StudyParts(watched(py, progress, move |watch| Parts::open(&plan, &folder, watch))?))
}

/// What a study came to: outcome, columns, failures by their cases, axes, their values if it is a grid, and how many cases
/// were there before.
type Studied = (Outcome, Arrays, BTreeMap<u64, String>, Vec<String>, Option<Vec<Array>>, u64);

#[pymethods]
impl StudyParts {
    /// The parts that were missing when it was opened, and the cases of each.
    fn missing(&self) -> Vec<(usize, u64)> {
        let cases = |index: usize| self.0.work().part(index).count() as u64;
        self.0.missing().iter().map(|&index| (index, cases(index))).collect()
    }

    /// What it takes to run them, as a text.
    fn work(&self) -> String {
        self.0.work().to_json()
    }

    /// Runs them here, on as many threads as there are processors unless it is said how many.
    #[pyo3(signature = (threads, progress))]
    fn run(&self, py: Python<'_>, threads: Option<usize>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let all = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = threads.unwrap_or_else(all);
        watched(py, progress, |watch| self.0.run(threads, watch))
    }

    /// Takes the bytes of a part that was run elsewhere.
    fn put(&self, py: Python<'_>, index: usize, bytes: &[u8]) -> PyResult<()> {
        py.detach(|| self.0.put(index, bytes)).map_err(|error| raised(py, &error))
    }

    /// Makes the file of the study, and what it tells.
    fn finish(&self, py: Python<'_>) -> PyResult<Studied> {
        let studied = py.detach(|| {
            let outcome = self.0.finish()?;
            Ok((outcome.columns()?, outcome.failures()?, outcome.findings()?, outcome))
        });
        let (columns, failures, findings, outcome) = studied.map_err(|error| raised(py, &error))?;
        let plan = &outcome.plan;
        let axes = plan.axes.iter().map(|axis| axis.name.clone()).collect();
        let grid = plan.grid().map(|grid| grid.into_iter().map(|values| values.to_vec().into()).collect());
        let failures = failures.into_iter().collect();
        Ok((Outcome::of(findings), arrays(columns), failures, axes, grid, outcome.kept))
    }
}

#[pymethods]
impl StudyWork {
    /// From its text, if it is of this version.
    #[new]
    fn new(py: Python<'_>, text: &str) -> PyResult<Self> {
        Ok(StudyWork(Work::from_json(text).map_err(|error| raised(py, &error))?))
    }

    /// The bytes of a part, run on one thread.
    fn part<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &watched(py, None, |watch| self.0.part_bytes(index, watch))?))
    }
}
