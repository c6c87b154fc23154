//! Controllers written in Python as C, as library and as FMU.

use std::path::PathBuf;
use stickslip::GenerateError;

use pyo3::prelude::*;
use pyo3::types::PyList;
use stickslip::generate::{self, Version};
use stickslip::output;
use stickslip_codegen::module;
use stickslip_codegen::record::{Computed, Declared, Given, Program, Recorded, record_declared};

use crate::error::{Exception, raised};
use crate::preset::Preset;
use crate::record::{Number, RealLike, apart};

/// Name, unit, help, minimum, maximum, value.
type Row = (String, String, String, f64, f64, f64);

/// Recorded graph of a controller.
#[pyclass(frozen, module = "stickslip", name = "Recording")]
pub(crate) struct Recording {
    name: String,
    program: Program,
}

/// C code of a controller.
#[pyclass(frozen, module = "stickslip", name = "Code")]
pub(crate) struct Code {
    module: generate::Module,
}

fn declared((name, unit, help, minimum, maximum, value): Row) -> Declared {
    Declared { name, unit, help, minimum, maximum, value }
}

/// Record a controller. Calls `step(parameters, state, sample, dt)` once with lists of numbers; it returns the new
/// state and the torque.
#[pyfunction]
pub(crate) fn record_controller(
    py: Python<'_>,
    name: &str,
    help: &str,
    parameters: Vec<Row>,
    state: Vec<Row>,
    step: &Bound<'_, PyAny>,
) -> PyResult<Recording> {
    let rows = |all: Vec<Row>| all.into_iter().map(declared).collect();
    let signature = module::signature(name, help, rows(parameters), rows(state));
    let program = apart(|| {
        record_declared::<f64, PyErr>(&signature, |Given { parameters, state, input, dt }| {
            let list = |numbers: Vec<Recorded>| PyList::new(py, numbers.into_iter().map(Number::from));
            let computed = step.call1((list(parameters)?, list(state)?, list(input)?, Number::from(dt)))?;
            let (state, torque): (Vec<RealLike>, RealLike) = computed.extract()?;
            let state = state.iter().map(|number| number.recorded(py)).collect::<PyResult<_>>()?;
            Ok(Computed { state, output: vec![torque.recorded(py)?] })
        })
    })?;
    Ok(Recording { name: name.into(), program })
}

#[pymethods]
impl Recording {
    /// Number of operations.
    #[getter]
    fn operations(&self) -> usize {
        self.program.steps.iter().map(|step| step.graph.nodes.len()).sum()
    }

    /// Generate C code, with self-test and example for samples of `sample_time` [s].
    fn write(&self, py: Python<'_>, sample_time: f64) -> PyResult<Code> {
        match generate::module(self.program.clone(), &self.name, sample_time) {
            Ok(module) => Ok(Code { module }),
            Err(error) => Err(match error.of() {
                Some(GenerateError::NoIdentifier(name)) => {
                    Exception::InvalidValue.with(py, format!("{name}. Give the function another name."))
                }
                _ => raised(py, &error),
            }),
        }
    }
}

#[pymethods]
impl Code {
    /// Names and texts of the source files of the library.
    #[getter]
    fn sources(&self) -> Vec<(String, String)> {
        self.module.files.clone()
    }

    /// Write the project into a folder.
    fn generate(&self, py: Python<'_>, folder: PathBuf, diagram: bool) -> PyResult<()> {
        py.detach(|| self.module.generated(diagram).write(&folder)).map(drop).map_err(|error| raised(py, &error))
    }

    /// Compile the library and replace the file at `path` in one step.
    fn compile(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let built = py.detach(|| self.module.library().and_then(|library| output::write(&path, library)));
        built.map_err(|error| raised(py, &error))
    }

    /// Write an FMU of FMI version 2 or 3.
    fn fmu(&self, py: Python<'_>, path: PathBuf, version: u32) -> PyResult<()> {
        let version = if version == 2 { Version::Two } else { Version::Three };
        let built = py.detach(|| self.module.fmu(version).and_then(|fmu| output::write(&path, fmu.bytes)));
        built.map_err(|error| raised(py, &error))
    }
}

/// Return the sample time of the controllers of a preset [s] and the torque limit of its drive [N m].
#[pyfunction]
pub(crate) fn sampling_of(preset: &Preset) -> (f64, f64) {
    let scaling = preset.values.model.scaling;
    (preset.values.bench.control_period(), scaling.servo_limit * scaling.torque_per_volt)
}
