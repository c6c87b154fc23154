//! Recordings of machines: files, and arrays as their columns.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use stickslip::machine::{Machine, Signals};
use stickslip::recording::{Column, Recording};
use stickslip::table;

use crate::array::ArrayLike;
use crate::error::{Exception, raised};
use crate::outcome::{Arrays, arrays};

/// Recording: columns of equal length, as in the file.
#[pyclass(frozen, module = "stickslip._stickslip", name = "Table")]
pub(crate) struct Table(pub(crate) Arc<Recording>);

/// Read a recording from a file.
#[pyfunction]
pub(crate) fn read_table(py: Python<'_>, path: PathBuf) -> PyResult<Table> {
    let recording = py.detach(|| Recording::read(&path)).map_err(|error| raised(py, &error))?;
    Ok(Table(Arc::new(recording)))
}

/// Make a recording of columns: name, unit and values of each; `name` is that of the recording in messages.
#[pyfunction]
pub(crate) fn table_of<'py>(
    py: Python<'py>,
    name: &str,
    columns: Vec<(String, Option<String>, ArrayLike<'py>)>,
) -> PyResult<Table> {
    let refuse = |message: String| Err(Exception::InvalidValue.with(py, message));
    let mut rows = None;
    let mut all = Vec::new();
    for (title, unit, values) in &columns {
        let values = values.row(py, title)?;
        let (first, length) = rows.get_or_insert((title, values.len()));
        if values.len() != *length {
            let found = values.len();
            return refuse(format!(
                "{title} has {found} values, {first} {length}. Give one value for each row, NaN for a missing one."
            ));
        }
        all.push(Column::new(title, values.to_vec()).with_unit(unit.clone()));
    }
    if rows.is_none_or(|(_, rows)| rows == 0) {
        return refuse(format!("{name} has no rows. Give at least one column with numbers."));
    }
    Ok(Table(Arc::new(Recording::from_columns(name, all))))
}

#[pymethods]
impl Table {
    /// Return name, unit and values of each column; the unit is "" where the file states none.
    pub(crate) fn columns(&self) -> Arrays {
        let column = |column: &Column| table::Column {
            name: column.name.clone(),
            unit: column.unit.clone().unwrap_or_default(),
            values: column.values.clone(),
        };
        arrays(self.0.columns().iter().map(column).collect())
    }

    /// Return the signals of a machine in SI units, and the notes on them.
    fn signals(&self, py: Python<'_>, machine: &MachineFile) -> PyResult<(Arrays, Vec<String>)> {
        let signals = py.detach(|| machine.0.signals(&self.0)).map_err(|error| raised(py, &error))?;
        let notes = signals.findings.iter().chain(&signals.notes).cloned().collect();
        Ok((arrays(columns(signals, &machine.0)), notes))
    }
}

/// The signals as columns over time.
fn columns(signals: Signals, machine: &Machine) -> Vec<table::Column> {
    let position = machine.axis.position().si_unit();
    let velocity = machine.axis.velocity().si_unit();
    let command = machine.drive.command.si_unit();
    let time = (0..signals.position.len()).map(|row| row as f64 * signals.period).collect();
    let all = [
        ("time", "s", Some(time)),
        ("position", position, Some(signals.position)),
        ("velocity", velocity, signals.velocity),
        ("reference", position, signals.reference),
        ("command", command, Some(signals.command)),
        ("injected", command, signals.injected),
    ];
    all.into_iter()
        .filter_map(|(name, unit, values)| {
            Some(table::Column { name: name.into(), unit: unit.into(), values: values? })
        })
        .collect()
}

/// Machine file, checked.
#[pyclass(frozen, module = "stickslip._stickslip", name = "MachineFile")]
pub(crate) struct MachineFile(pub(crate) Machine);

/// Read a machine file, or its text where `text` is given; `path` then is its name in messages.
#[pyfunction]
pub(crate) fn machine_file(py: Python<'_>, path: PathBuf, text: Option<&str>) -> PyResult<MachineFile> {
    let machine = match text {
        Some(text) => Machine::parse(&path, text),
        None => Machine::read(&path),
    };
    Ok(MachineFile(machine.map_err(|error| raised(py, &error))?))
}

#[pymethods]
impl MachineFile {
    /// Text of the file.
    #[getter]
    fn text(&self) -> &str {
        &self.0.text
    }
}
