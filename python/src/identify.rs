//! Identification of an axis from a recording, and validation on another one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use stickslip::identify::servo::{self, ServoIdentification, identify_servo};
use stickslip::identify::{self, Identification, IdentifiedModel, Validation, parameter_lines};
use stickslip::machine::{Axis, Machine};
use stickslip::recording::Recording;
use stickslip::report::Report;
use stickslip::table::Column;
use stickslip::{Error, Summary};

use crate::array::Array;
use crate::error::raised;
use crate::outcome::{Arrays, Outcome, WorkResult};
use crate::table::{MachineFile, Table};
use crate::watched::watched;

/// A result with its recording and machine, which its report needs.
#[derive(Clone)]
struct Of<T> {
    recording: Arc<Recording>,
    machine: Machine,
    found: T,
}

/// Name and unit of what moves an axis.
fn force(axis: Axis) -> (&'static str, &'static str) {
    match axis {
        Axis::Linear => ("force", "N"),
        Axis::Rotary => ("torque", "N m"),
    }
}

fn column(name: &str, unit: &str, values: impl Iterator<Item = f64>) -> Column {
    Column { name: name.into(), unit: unit.into(), values: values.collect() }
}

impl WorkResult for Of<Identification> {
    fn summary(&self) -> Summary {
        identify::summary(&self.found)
    }
    fn columns(&self) -> Vec<Column> {
        let (name, unit) = force(self.machine.axis);
        let points = || self.found.curve.points.iter();
        vec![
            column("velocity", self.machine.axis.velocity().si_unit(), points().map(|point| point.velocity)),
            column(name, unit, points().map(|point| point.torque)),
            column("standard_error", unit, points().map(|point| point.standard_error)),
        ]
    }
    fn lines(&self) -> Vec<String> {
        let [directions, _] = parameter_lines(&self.summary(), &self.machine);
        let best = format!("{:36} {}", "best model", self.found.best().kind.title());
        directions.into_iter().map(|line| format!("{:36} {}", line.name, line.identified)).chain([best]).collect()
    }
    fn remarks(&self) -> Vec<String> {
        let done = self.found.signals.findings.iter().cloned();
        done.chain(self.found.findings.sentences(self.found.axis)).chain(self.found.limits()).collect()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(identify::report(&self.found, &self.machine, &self.recording, &self.summary(), command))
    }
    fn write(&self, folder: &Path, command: &str) -> Result<Summary, Error> {
        identify::write(&self.found, &self.machine, &self.recording, command, folder)
    }
}

impl WorkResult for Of<ServoIdentification> {
    fn summary(&self) -> Summary {
        servo::summary(&self.found)
    }
    fn lines(&self) -> Vec<String> {
        let (summary, best) = (self.summary(), self.found.best().fitted.kind);
        let named = servo::fields().iter().filter(|field| best.has(field.name));
        let estimates = named.filter_map(|field| Some((field.name, summary.estimate(&servo::result_name(field))?)));
        estimates.map(|(name, estimate)| format!("{:28} {estimate}", name.replace('_', " "))).collect()
    }
    fn remarks(&self) -> Vec<String> {
        self.found.limits(&self.machine)
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(servo::report(&self.found, &self.machine, &self.recording, command))
    }
    fn write(&self, folder: &Path, command: &str) -> Result<Summary, Error> {
        servo::write(&self.found, &self.machine, &self.recording, command, folder)
    }
}

impl WorkResult for Of<Validation> {
    fn summary(&self) -> Summary {
        self.found.summary()
    }
    fn columns(&self) -> Vec<Column> {
        let Validation { signals, motion, model, closed_loop, command_unit, .. } = &self.found;
        let time = |rows: std::ops::Range<usize>| column("time", "s", rows.map(|row| row as f64 * signals.period));
        let position = self.machine.axis.position().si_unit();
        let Some((run, _)) = closed_loop else {
            let (name, unit) = force(self.machine.axis);
            let rows = 0..motion.samples();
            let predicted =
                |row: usize| model.inertia * motion.acceleration[row] + model.steady_force(motion.velocity[row]);
            return vec![
                time(rows.clone()),
                column(&format!("measured_{name}"), unit, motion.smooth_force[rows.clone()].iter().copied()),
                column(&format!("predicted_{name}"), unit, rows.map(predicted)),
            ];
        };
        let rows = run.range.clone();
        vec![
            time(rows.clone()),
            column("measured_command", command_unit, signals.command[rows.clone()].iter().copied()),
            column("predicted_command", command_unit, run.command.iter().copied()),
            column("measured_position", position, signals.position[rows].iter().copied()),
            column("predicted_position", position, run.position.iter().copied()),
        ]
    }
    fn lines(&self) -> Vec<String> {
        vec![self.found.verdict().replace('\u{a0}', " ")]
    }
    fn remarks(&self) -> Vec<String> {
        self.found.signals.findings.iter().chain(&self.found.signals.notes).cloned().collect()
    }
    fn report(&self, command: &str) -> Result<Report, Error> {
        Ok(self.found.report(&self.machine, &self.recording, command))
    }
    fn write(&self, folder: &Path, command: &str) -> Result<Summary, Error> {
        self.found.write(&self.machine, &self.recording, command, folder)
    }
}

/// Identified axis: outcome, text of `model.toml`, columns of the feedforward table, steady friction of the best model
/// (velocities and forces).
type Identified = (Outcome, String, Arrays, (Array, Array));

/// Identify an axis from a recording.
#[pyfunction]
#[pyo3(signature = (recording, machine, progress))]
pub(crate) fn identify_axis(
    py: Python<'_>,
    recording: &Table,
    machine: &MachineFile,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Identified> {
    let (recording, machine) = (recording.0.clone(), machine.0.clone());
    if machine.pendulum.is_some() {
        let found = watched(py, progress, |watch| identify_servo(&recording, &machine, watch))?;
        let outcome = Outcome::of(Of { recording, machine, found });
        return Ok((outcome, String::new(), Vec::new(), (Vec::new().into(), Vec::new().into())));
    }
    let found = watched(py, progress, |watch| identify::identify(&recording, &machine, watch))?;
    let model = identify::model_toml(&found, &machine);
    let feedforward = identify::feedforward_csv(&found, &machine);
    let feedforward = Recording::parse(Path::new("feedforward.csv"), feedforward.as_bytes());
    let feedforward = Table(Arc::new(feedforward.map_err(|error| raised(py, &error))?)).columns();
    let curve = steady(&found);
    Ok((Outcome::of(Of { recording, machine, found }), model, feedforward, curve))
}

/// Steady friction of the best model up to the largest speed of the curve, finer towards rest: velocities and forces.
fn steady(found: &Identification) -> (Array, Array) {
    const STEPS: i32 = 200;
    let fastest = found.curve.points.iter().fold(0.0f64, |fastest, point| fastest.max(point.velocity.abs()));
    let shares = (-STEPS..=STEPS).filter(|step| *step != 0).map(|step| f64::from(step) / f64::from(STEPS));
    let velocities: Vec<f64> = shares.map(|share| fastest * share * share.abs()).collect();
    let forces: Vec<f64> = velocities.iter().map(|velocity| found.best().model.steady_force(*velocity)).collect();
    (velocities.into(), forces.into())
}

/// Validate a model, from the file `model.toml` of an identification, on a recording.
#[pyfunction]
#[pyo3(signature = (recording, model, machine, progress))]
pub(crate) fn validate_model(
    py: Python<'_>,
    recording: &Table,
    model: PathBuf,
    machine: &MachineFile,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Outcome> {
    let (recording, machine) = (recording.0.clone(), machine.0.clone());
    let model: IdentifiedModel = identify::read_model(&model).map_err(|error| raised(py, &error))?;
    let found = watched(py, progress, |watch| identify::validate(&recording, &model, &machine, watch))?;
    Ok(Outcome::of(Of { recording, machine, found }))
}
