//! Results of all functions: numbers, data, remarks and report.

use std::path::PathBuf;

use pyo3::prelude::*;
use stickslip::benchmark;
use stickslip::demo::Demo;
use stickslip::fidelity;
use stickslip::report::Report;
use stickslip::study;
use stickslip::table::Column;
use stickslip::workflow::design::Design;
use stickslip::workflow::fit::FrictionFits;
use stickslip::workflow::hunting::HuntingRun;
use stickslip::workflow::measure::{self, Measurement};
use stickslip::workflow::position_loop::LoopRun;
use stickslip::workflow::render::RenderRun;
use stickslip::{Error, Summary};

use crate::array::Array;
use crate::error::raised;

/// Common interface of all results.
pub(crate) trait WorkResult: Send + Sync {
    /// The numbers by their names in `summary.json`.
    fn summary(&self) -> Summary;
    /// The table of data; empty if there is none.
    fn columns(&self) -> Vec<Column> {
        Vec::new()
    }
    /// Lines for the terminal.
    fn lines(&self) -> Vec<String>;
    /// Remarks, each with a remedy.
    fn remarks(&self) -> Vec<String>;
    /// The report.
    fn report(&self, command: &str) -> Result<Report, Error>;
    /// Writes report, data and `summary.json` into a folder.
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error>;
}

impl<P: measure::Plan + Send + Sync> WorkResult for Measurement<P>
where
    P::Outcome: Send + Sync,
{
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn columns(&self) -> Vec<Column> {
        measure::Outcome::columns(&self.outcome)
    }
    fn lines(&self) -> Vec<String> {
        measure::Outcome::table(&self.outcome).lines()
    }
    fn remarks(&self) -> Vec<String> {
        self.warnings()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.report(command))
    }
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
        self.write(folder, command)
    }
}

impl WorkResult for FrictionFits {
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn lines(&self) -> Vec<String> {
        let parameters = self.fits.iter().flat_map(|fitted| self.parameters(fitted));
        parameters.map(|(_, name, estimate)| format!("{name:<26} {estimate}")).collect()
    }
    fn remarks(&self) -> Vec<String> {
        self.fits.iter().flat_map(|fitted| self.advice(fitted)).collect()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.report(command))
    }
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
        Ok(self.write(folder, command)?.0)
    }
}

impl WorkResult for RenderRun {
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn columns(&self) -> Vec<Column> {
        measure::Outcome::columns(&self.rendering().curve)
    }
    fn lines(&self) -> Vec<String> {
        self.rendering().lines().into_iter().chain(self.lines()).collect()
    }
    fn remarks(&self) -> Vec<String> {
        measure::Outcome::warnings(&self.rendering().curve)
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.report(command))
    }
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
        self.write(folder, command)
    }
}

impl WorkResult for Demo {
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn columns(&self) -> Vec<Column> {
        measure::Outcome::columns(&self.rendering.curve)
    }
    fn lines(&self) -> Vec<String> {
        self.rendering.lines()
    }
    fn remarks(&self) -> Vec<String> {
        measure::Outcome::warnings(&self.rendering.curve)
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.report(command))
    }
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
        self.write(folder, command)
    }
}

/// Results with a table and remarks, without data.
macro_rules! work_results {
    ($($kind:ty),*) => { $(
        impl WorkResult for $kind {
            fn summary(&self) -> Summary {
                self.summary()
            }
            fn lines(&self) -> Vec<String> {
                self.table().lines()
            }
            fn remarks(&self) -> Vec<String> {
                self.remarks()
            }
            fn report(&self, command: &str) -> Result<Report, Error> {
                Ok(self.report(command))
            }
            fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
                self.write(folder, command)
            }
        }
    )* };
}

work_results!(Design, LoopRun, HuntingRun);

impl WorkResult for benchmark::Outcome {
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn lines(&self) -> Vec<String> {
        let tables = self.tables().into_iter().chain(self.robustness());
        tables.flat_map(|(title, table)| std::iter::once(title).chain(table.lines())).collect()
    }
    fn remarks(&self) -> Vec<String> {
        self.remarks()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        self.report(command)
    }
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
        self.write(folder, command)
    }
}

impl WorkResult for fidelity::Outcome {
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn lines(&self) -> Vec<String> {
        self.tables().into_iter().flat_map(|(title, table)| std::iter::once(title).chain(table.lines())).collect()
    }
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.report(command))
    }
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
        self.write(folder, command)
    }
}

impl WorkResult for study::Findings {
    fn summary(&self) -> Summary {
        self.summary()
    }
    fn lines(&self) -> Vec<String> {
        vec![self.sentences()]
    }
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.report(command))
    }
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error> {
        self.write(folder, command)
    }
}

/// Columns for Python: name, unit, values.
pub(crate) type Arrays = Vec<(String, String, Array)>;

/// Columns as arrays, without a copy.
pub(crate) fn arrays(columns: Vec<Column>) -> Arrays {
    columns.into_iter().map(|column| (column.name, column.unit, column.values.into())).collect()
}

/// Result of a function.
#[pyclass(frozen, module = "stickslip._stickslip", name = "Outcome")]
pub(crate) struct Outcome(Box<dyn WorkResult>);

impl Outcome {
    pub(crate) fn of(result: impl WorkResult + 'static) -> Self {
        Outcome(Box::new(result))
    }
}

#[pymethods]
impl Outcome {
    /// Return the text of `summary.json`.
    fn summary(&self) -> String {
        self.0.summary().to_json()
    }

    /// Return name, unit and values of each column of the data.
    fn columns(&self) -> Arrays {
        arrays(self.0.columns())
    }

    /// Return the lines for the terminal.
    fn lines(&self) -> Vec<String> {
        self.0.lines()
    }

    /// Return the remarks, each with a remedy.
    fn remarks(&self) -> Vec<String> {
        self.0.remarks()
    }

    /// Return the report as one HTML page; `command` is the call that produced the result.
    fn html(&self, py: Python<'_>, command: &str) -> PyResult<String> {
        Ok(self.0.report(command).map_err(|error| raised(py, &error))?.html())
    }

    /// Write report, data and `summary.json` into a folder. Returns the text of the summary.
    fn write(&self, py: Python<'_>, folder: PathBuf, command: &str) -> PyResult<String> {
        let written = py.detach(|| self.0.write(&folder, command));
        Ok(written.map_err(|error| raised(py, &error))?.to_json())
    }
}
