//! A recording of several runs of a servo with a pendulum, and the properties of each run.
//!
//! ```text
//! duty = limited(k_p·n/(divisor·full_duty)),   n = (reference − position)/encoder_grid,   limited to ±1
//! ```
//!
//! Differences between runs are in a separate table, one row for each run; the recording stays unchanged.

use crate::IdentifyError;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::signals::values;
use super::{Axis, Channel, Machine};
use stickslip_base::Error;
use stickslip_base::units::Dimension::{self, Length, Mass, Share, Time, Voltage};
use stickslip_recording::Recording;

/// Servo and pendulum in a machine file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pendulum {
    /// Table of the runs, relative to the machine file. It has a column with the name of `columns.run`.
    pub runs: PathBuf,
    /// Runs that no fit uses.
    pub held_out: Vec<f64>,
    /// Divisor of the servo's position gain.
    pub gain_divisor: f64,
    /// Full duty, in the servo's counts of it.
    pub full_duty: f64,
    /// Column of the table: position gain k_p.
    pub position_gain: Channel,
    /// Column of the table: voltage of the supply without load.
    pub supply: Channel,
    /// Column of the table: mass of the pendulum.
    pub mass: Channel,
    /// Column of the table: distance of the mass from the shaft.
    pub length: Channel,
}

/// One run in SI units, at its sampling times.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Number in the recording.
    pub number: f64,
    /// Whether no fit uses it.
    pub held_out: bool,
    /// Time of each sample [s].
    pub time: Vec<f64>,
    /// Reference angle [rad].
    pub reference: Vec<f64>,
    /// Measured angle [rad], 0 hanging down.
    pub position: Vec<f64>,
    /// Duty that the servo reports, −1 … 1.
    pub duty: Vec<f64>,
    /// 1 where the servo drives, 0 where it is off.
    pub enabled: Vec<f64>,
    /// Duty per angle of error [1/rad].
    pub gain: f64,
    /// Voltage of the supply without load [V].
    pub supply: f64,
    /// Largest torque of the weight, m·g·l [N m].
    pub weight: f64,
    /// Moment of inertia of the pendulum, m·l² [kg m²].
    pub inertia: f64,
}

/// Standard acceleration of free fall [m/s²].
const GRAVITY: f64 = 9.80665;

impl Pendulum {
    /// With the table in the folder of the machine file.
    pub(super) fn beside(self, file: &Path) -> Self {
        Pendulum { runs: file.with_file_name(&self.runs), ..self }
    }

    pub(super) fn numbers(&self) -> [(&'static str, f64); 2] {
        [("pendulum.gain_divisor", self.gain_divisor), ("pendulum.full_duty", self.full_duty)]
    }
}

impl Machine {
    /// The runs of a recording, each with its row of the table.
    ///
    /// # Errors
    /// A machine file without the keys of a servo, a missing column, a bad cell, a unit that does not match, time that
    /// does not advance, a run without a row or pendulum in the table, or none to fit or to hold out.
    pub fn runs(&self, recording: &Recording) -> Result<Vec<Run>, Error> {
        let Some(pendulum) = &self.pendulum else { return Err(self.lacks("the table [pendulum]")) };
        let columns = &self.columns;
        let run = columns.run.as_ref().ok_or_else(|| self.lacks("columns.run"))?;
        let time = columns.time.as_ref().ok_or_else(|| self.lacks("columns.time"))?;
        let reference = columns.reference.as_ref().ok_or_else(|| self.lacks("columns.reference"))?;
        let grid = self.encoder_grid.ok_or_else(|| self.lacks("encoder_grid"))?;
        if self.axis != Axis::Rotary {
            return Err(self.lacks("axis = \"rotary\""));
        }
        let table = Recording::read(&pendulum.runs)?;
        let numbers = &table.column(&run.name)?.values;
        let positive = |channel: &Channel, dimension: Dimension| {
            let values = values(channel, &table, dimension)?;
            let remedy = "Enter the true value; all torques are referred to the pendulum.";
            if values.iter().any(|v| *v <= 0.0) {
                return Err(table.doubtful(&channel.name, "holds a value that is not positive", remedy));
            }
            Ok(values)
        };
        let [mass, length] = [positive(&pendulum.mass, Mass)?, positive(&pendulum.length, Length)?];
        let [gain, supply] = [positive(&pendulum.position_gain, Share)?, positive(&pendulum.supply, Voltage)?];
        let mut runs = Vec::new();
        let mut first = 0;
        for chunk in recording.column(&run.name)?.values.chunk_by(|a, b| a == b) {
            let (number, rows) = (chunk[0], recording.rows_of(first..first + chunk.len()));
            first += chunk.len();
            let Some(row) = numbers.iter().position(|n| *n == number) else {
                let remedy = "Add a row for it, or remove it from the recording.";
                return Err(table.doubtful(&run.name, &format!("has no row for run {number}"), remedy));
            };
            let time = values(time, &rows, Time)?;
            rows.order(&time)?;
            let read = |channel: &Channel| Ok::<_, Error>(rows.column(&channel.name)?.values.clone());
            let enabled = columns.enabled.as_ref().map_or_else(|| Ok(vec![1.0; time.len()]), read)?;
            runs.push(Run {
                number,
                held_out: pendulum.held_out.contains(&number),
                reference: self.position(reference, &rows)?,
                position: self.position(&columns.position, &rows)?,
                duty: read(&columns.command)?
                    .into_iter()
                    .map(|duty| signed(duty, columns.command.wraps) / pendulum.full_duty)
                    .collect(),
                enabled: enabled.iter().map(|e| f64::from(u8::from(*e > 0.5))).collect(),
                time,
                gain: gain[row] / (grid * pendulum.gain_divisor * pendulum.full_duty),
                supply: supply[row],
                weight: mass[row] * GRAVITY * length[row],
                inertia: mass[row] * length[row] * length[row],
            });
        }
        for (held_out, needed) in [(false, 2), (true, 1)] {
            let count = runs.iter().filter(|run| run.held_out == held_out).count();
            let what = if held_out { "runs held out" } else { "runs to fit" };
            if count < needed {
                let remedy = "See pendulum.held_out in the machine file: some runs are fitted, the others validate.";
                return Err(Error::TooFew { what, found: count, needed, remedy });
            }
        }
        Ok(runs)
    }

    fn lacks(&self, what: &str) -> Error {
        let message = format!("{what} is missing: runs of a servo with a pendulum require it.");
        IdentifyError::MachineFile { path: self.name.clone().into(), message }.into()
    }
}

/// A signed number from an unsigned register.
fn signed(value: f64, wraps: Option<f64>) -> f64 {
    match wraps {
        Some(wraps) if value >= 0.5 * wraps => value - wraps,
        _ => value,
    }
}

impl Run {
    /// Slope of the recorded duty over the duty of the known controller where neither is limited: 1 if the machine file
    /// describes the controller correctly. None if the servo was always off or limited.
    pub fn controller_slope(&self) -> Option<f64> {
        let expected = |i: usize| self.gain * (self.reference[i] - self.position[i]);
        let free = |i: &usize| self.enabled[*i] > 0.5 && self.duty[*i].abs() < 0.99 && expected(*i).abs() < 0.99;
        let samples: Vec<usize> = (0..self.time.len()).filter(free).collect();
        let [product, square] = samples.iter().fold([0.0; 2], |[product, square], i| {
            [product + self.duty[*i] * expected(*i), square + expected(*i) * expected(*i)]
        });
        (square > 0.0).then(|| product / square)
    }
}
