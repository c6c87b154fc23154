//! What came of a piece of work: numbers, data, remarks and report, whatever the work was.

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

/// What a piece of work has in common with all others.
pub(crate) trait Found: Send + Sync {
    /// The numbers, under the names of `summary.json`.
    fn summary(&self) -> Summary;
    /// The data, if there is a table of them.
    fn columns(&self) -> Vec<Column> {
        Vec::new()
    }
    /// What the terminal shows.
    fn lines(&self) -> Vec<String>;
    /// What a reader should know.
    fn remarks(&self) -> Vec<String>;
    /// The report.
    fn report(&self, command: &str) -> Result<Report, Error>;
    /// Report, data and `summary.json` in a folder.
    fn write(&self, folder: &std::path::Path, command: &str) -> Result<Summary, Error>;
}

impl<P: measure::Plan + Send + Sync> Found for Measurement<P>
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

impl Found for FrictionFits {
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

impl Found for RenderRun {
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

impl Found for Demo {
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

/// What says itself by a table and remarks, without data.
macro_rules! found {
    ($($kind:ty),*) => { $(
        impl Found for $kind {
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

found!(Design, LoopRun, HuntingRun);

impl Found for benchmark::Outcome {
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

impl Found for fidelity::Outcome {
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

impl Found for study::Findings {
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

/// Columns as Python has them: name, unit, values.
pub(crate) type Arrays = Vec<(String, String, Array)>;

/// Columns as arrays, without a copy.
pub(crate) fn arrays(columns: Vec<Column>) -> Arrays {
    columns.into_iter().map(|column| (column.name, column.unit, column.values.into())).collect()
}

/// What came of a piece of work.
#[pyclass(frozen, module = "stickslip._stickslip", name = "Outcome")]
pub(crate) struct Outcome(Box<dyn Found>);

impl Outcome {
    pub(crate) fn of(found: impl Found + 'static) -> Self {
        Outcome(Box::new(found))
    }
}

#[pymethods]
impl Outcome {
    /// The text of `summary.json`.
    fn summary(&self) -> String {
        self.0.summary().to_json()
    }

    /// The data: name, unit and values of each column.
    fn columns(&self) -> Arrays {
        arrays(self.0.columns())
    }

    /// What the terminal shows.
    fn lines(&self) -> Vec<String> {
        self.0.lines()
    }

    /// What a reader should know, each with a remedy.
    fn remarks(&self) -> Vec<String> {
        self.0.remarks()
    }

    /// The report as one page of HTML; `command` is what it was made by.
    fn html(&self, py: Python<'_>, command: &str) -> PyResult<String> {
        Ok(self.0.report(command).map_err(|error| raised(py, &error))?.html())
    }

    /// Writes report, data and `summary.json` into a folder; returns the text of the summary.
    fn write(&self, py: Python<'_>, folder: PathBuf, command: &str) -> PyResult<String> {
        let written = py.detach(|| self.0.write(&folder, command));
        Ok(written.map_err(|error| raised(py, &error))?.to_json())
    }
}
