//! Calibration of the bench.

use std::path::Path;

use pyo3::prelude::*;
use stickslip::calibrate::CalibrationPlan;
use stickslip::report::Report;
use stickslip::table::Column;
use stickslip::workflow::calibrate::{CalibrationRun, calibrate_run};
use stickslip::workflow::measure;
use stickslip::{Error, Summary, parameters};

use crate::error::raised;
use crate::outcome::{Outcome, WorkResult};
use crate::preset::Preset;
use crate::value::settings;
use crate::watched::watched;

impl WorkResult for CalibrationRun {
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn columns(&self) -> Vec<Column> {
        measure::Outcome::columns(&self.calibration.curve)
    }
    fn lines(&self) -> Vec<String> {
        self.table().lines()
    }
    fn remarks(&self) -> Vec<String> {
        self.calibration.warnings.clone()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.report(command))
    }
    fn write(&self, folder: &Path, command: &str) -> Result<Summary, Error> {
        self.write(folder, command)
    }
}

/// Calibrate the virtual bench of a preset. Returns the calibrated preset as text and the result.
#[pyfunction]
#[pyo3(signature = (preset, plan, seed, progress))]
pub(crate) fn calibrate_bench(
    py: Python<'_>,
    preset: &Preset,
    plan: Option<&Bound<'_, PyAny>>,
    seed: u64,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Preset, Outcome)> {
    let mut changes = Vec::new();
    if let Some(values) = plan {
        settings("", values, &mut changes)?;
    }
    let plan =
        parameters::changed(&CalibrationPlan::default(), "plan", &changes).map_err(|error| raised(py, &error))?;
    let values = &preset.values;
    let run = watched(py, progress, move |watch| calibrate_run(&plan, values, seed, watch))?;
    let calibrated = Preset::computed(py, &run.calibrated())?;
    Ok((calibrated, Outcome::of(run)))
}
