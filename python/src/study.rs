//! Parameter studies, part by part: run in this process or on other machines.

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

/// Study in a folder.
#[pyclass(frozen, module = "stickslip._stickslip", name = "StudyParts")]
pub(crate) struct StudyParts(Parts);

/// Description of a study, for running its parts on another machine.
#[pyclass(frozen, module = "stickslip._stickslip", name = "StudyWork")]
pub(crate) struct StudyWork(Work);

/// Open a study from a file or from text; `preset` replaces the preset that the text names.
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

/// Results of a study: outcome, columns, failures by case, axes, values of the axes of a grid, number of reused cases.
type Studied = (Outcome, Arrays, BTreeMap<u64, String>, Vec<String>, Option<Vec<Array>>, u64);

#[pymethods]
impl StudyParts {
    /// Return the parts that were missing at opening, and the number of cases of each.
    fn missing(&self) -> Vec<(usize, u64)> {
        let cases = |index: usize| self.0.work().part(index).count() as u64;
        self.0.missing().iter().map(|&index| (index, cases(index))).collect()
    }

    /// Return the description of the study as text, for StudyWork.
    fn work(&self) -> String {
        self.0.work().to_json()
    }

    /// Run the missing parts in this process. Default of `threads`: one per processor.
    #[pyo3(signature = (threads, progress))]
    fn run(&self, py: Python<'_>, threads: Option<usize>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let processors = || std::thread::available_parallelism().map_or(1, usize::from);
        let threads = threads.unwrap_or_else(processors);
        watched(py, progress, |watch| self.0.run(threads, watch))
    }

    /// Store the bytes of a part that another machine ran.
    fn put(&self, py: Python<'_>, index: usize, bytes: &[u8]) -> PyResult<()> {
        py.detach(|| self.0.put(index, bytes)).map_err(|error| raised(py, &error))
    }

    /// Write the file of the study and return the results.
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
        Ok((Outcome::of(findings), arrays(columns), failures, axes, grid, outcome.reused))
    }
}

#[pymethods]
impl StudyWork {
    /// Parse the text of `StudyParts.work`. Raises Error for another version.
    #[new]
    fn new(py: Python<'_>, text: &str) -> PyResult<Self> {
        Ok(StudyWork(Work::from_json(text).map_err(|error| raised(py, &error))?))
    }

    /// Run a part on one thread and return its bytes.
    fn part<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &watched(py, None, |watch| self.0.part_bytes(index, watch))?))
    }
}
