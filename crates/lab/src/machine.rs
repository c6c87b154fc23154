//! What is known of the machine that was recorded: a TOML file beside the recording.
//!
//! Columns and their units, gain of the drive, controller, recipe. Linear axes are identified in kg and N, rotary ones
//! in kg m² and N m; the equations are the same.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::Error;
use crate::recording::Recording;
use crate::units::{Dimension, Quantity, si_factor};

/// A machine file, checked, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// For people.
    pub name: String,
    /// How it moves.
    pub axis: Axis,
    /// Sampling period of controller and recording [s].
    pub sampling_period: f64,
    /// Travel per turn of the screw [m].
    pub screw_lead: Option<f64>,
    /// Smallest step of the position [m or rad].
    pub encoder_grid: Option<f64>,
    /// Which column is what.
    pub columns: Columns,
    /// Force or torque per command [N/V or N m/V].
    pub gain: f64,
    /// What closes the loop.
    pub controller: Controller,
    /// How the recording is treated before the least squares.
    pub recipe: Recipe,
    /// Results of others, `[value, standard deviation]` by table and name: shown, never used.
    pub published: BTreeMap<String, BTreeMap<String, Vec<f64>>>,
    /// The file as it was read, for reports.
    pub text: String,
}

/// How the machine moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// Position in m, inertia in kg, force in N.
    Linear,
    /// Angle in rad, inertia in kg m², torque in N m.
    Rotary,
}

/// Which column is what.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Columns {
    /// Time of the sample; without it the sampling period counts.
    pub time: Option<Channel>,
    /// Measured position.
    pub position: Channel,
    /// Reference position; needed to predict the closed loop.
    pub reference: Option<Channel>,
    /// Command of the controller to the drive.
    pub command: Channel,
    /// Known signal that was added to the command after the controller's limit.
    pub injected: Option<Channel>,
}

/// A column and its unit; the unit may stand in the header instead.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// As in the header.
    pub name: String,
    /// As in the [table of units](crate::units).
    pub unit: Option<String>,
}

/// The position controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Controller {
    /// Not known: the closed loop is not predicted.
    #[default]
    Unknown,
    /// Position and velocity loop, both proportional.
    #[serde(rename = "p-p")]
    Cascade(Cascade),
}

/// u = limited(k_v·(k_p·(r − q) − v)), v the difference of the mean of the last two positions per sampling period.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cascade {
    /// k_p [1/s].
    pub position_gain: f64,
    /// k_v [V/(m/s) or V/(rad/s)].
    pub velocity_gain: f64,
    /// Magnitude of the largest command [V].
    pub limit: f64,
}

/// How the recording is treated before the least squares.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Recipe {
    /// Cut-off of the low-pass of the position, forward and backward [Hz].
    pub low_pass: f64,
    /// Its order.
    pub order: usize,
    /// One row of so many is kept, after a low-pass of all columns.
    pub decimation: usize,
    /// Samples dropped at the start.
    pub skip: usize,
}

impl Default for Recipe {
    fn default() -> Self {
        Recipe { low_pass: 100.0, order: 4, decimation: 10, skip: 50 }
    }
}

/// The file as written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    axis: Axis,
    sampling_period: Quantity,
    screw_lead: Option<Quantity>,
    encoder_grid: Option<Quantity>,
    columns: Columns,
    drive: Drive,
    #[serde(default)]
    controller: Controller,
    #[serde(default)]
    recipe: Recipe,
    #[serde(default)]
    published: BTreeMap<String, BTreeMap<String, Vec<f64>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Drive {
    gain: Quantity,
}

impl Machine {
    /// Reads and checks a machine file.
    ///
    /// # Errors
    /// A file that cannot be read, is no machine file, or holds values that cannot be.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let failed = |source| Error::File { path: path.to_owned(), action: "read", source };
        Self::parse(path, &std::fs::read_to_string(path).map_err(failed)?)
    }

    /// From the text of a machine file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let file: File =
            toml::from_str(text).map_err(|e| Error::MachineFile { path: path.to_owned(), message: e.to_string() })?;
        let place = |field: &str| format!("{}: {field}", path.display());
        let length = file.axis.position();
        let screw_lead = optional(&file.screw_lead, Dimension::Length, &place("screw_lead"))?;
        let machine = Machine {
            sampling_period: file.sampling_period.si(Dimension::Time, &place("sampling_period"))?,
            screw_lead,
            encoder_grid: optional(&file.encoder_grid, length, &place("encoder_grid"))?,
            gain: drive_gain(&file, screw_lead, path)?,
            name: file.name,
            axis: file.axis,
            columns: file.columns,
            controller: file.controller,
            recipe: file.recipe,
            published: file.published,
            text: text.to_owned(),
        };
        machine.check(path)?;
        Ok(machine)
    }

    fn check(&self, path: &Path) -> Result<(), Error> {
        let positive = "must be positive.";
        let mut numbers = vec![("sampling_period", self.sampling_period)];
        numbers.extend(self.screw_lead.map(|v| ("screw_lead", v)));
        numbers.extend(self.encoder_grid.map(|v| ("encoder_grid", v)));
        numbers.extend([("recipe.low_pass", self.recipe.low_pass), ("recipe.order", self.recipe.order as f64)]);
        numbers.push(("recipe.decimation", self.recipe.decimation as f64));
        if let Controller::Cascade(cascade) = self.controller {
            numbers.push(("controller.position_gain", cascade.position_gain));
            numbers.push(("controller.velocity_gain", cascade.velocity_gain));
            numbers.push(("controller.limit", cascade.limit));
        }
        let refuse = |field, value, remedy| Err(Error::MachineValue { path: path.to_owned(), field, value, remedy });
        for (field, value) in numbers {
            if !(value.is_finite() && value > 0.0) {
                return refuse(field, value, positive);
            }
        }
        if !(self.gain.is_finite() && self.gain != 0.0) {
            return refuse("drive.gain", self.gain, "must be a force per volt; its sign is that of the motion.");
        }
        // The filter's continuation is 3·(order + 1) samples, and orders beyond 10 are a slip of the pen.
        if self.recipe.order > 10 {
            return refuse("recipe.order", self.recipe.order as f64, "is more than 10; 4 is usual.");
        }
        Ok(())
    }

    /// The signals of a recording, in SI units, on the grid of the sampling period.
    ///
    /// # Errors
    /// A missing column, a bad cell, a unit that does not fit, uneven time, or another period than the machine's.
    pub fn signals(&self, recording: &Recording) -> Result<Signals, Error> {
        let take = |channel: &Channel, dimension| channel.values(recording, dimension);
        let optional = |channel: &Option<Channel>, dimension| channel.as_ref().map(|c| take(c, dimension)).transpose();
        if let Some(time) = optional(&self.columns.time, Dimension::Time)? {
            let found = recording.spacing(&time)?.period;
            // Clocks differ by 100 ppm at most; 0.1 % is another sampling rate.
            if (found / self.sampling_period - 1.0).abs() > 1e-3 {
                let path: PathBuf = recording.path().to_owned();
                return Err(Error::OtherPeriod { path, found, expected: self.sampling_period });
            }
        }
        Ok(Signals {
            period: self.sampling_period,
            position: take(&self.columns.position, self.axis.position())?,
            reference: optional(&self.columns.reference, self.axis.position())?,
            command: take(&self.columns.command, Dimension::Voltage)?,
            injected: optional(&self.columns.injected, Dimension::Voltage)?,
        })
    }
}

/// What a recording says, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Sampling period [s].
    pub period: f64,
    /// Measured position [m or rad].
    pub position: Vec<f64>,
    /// Reference position [m or rad].
    pub reference: Option<Vec<f64>>,
    /// Command of the controller [V].
    pub command: Vec<f64>,
    /// Known signal added to it [V].
    pub injected: Option<Vec<f64>>,
}

impl Signals {
    /// What reaches the drive: command and injected signal [V].
    pub fn drive_input(&self) -> Vec<f64> {
        match &self.injected {
            Some(injected) => self.command.iter().zip(injected).map(|(u, w)| u + w).collect(),
            None => self.command.clone(),
        }
    }
}

impl Axis {
    fn position(self) -> Dimension {
        match self {
            Axis::Linear => Dimension::Length,
            Axis::Rotary => Dimension::Angle,
        }
    }
}

impl Channel {
    fn values(&self, recording: &Recording, dimension: Dimension) -> Result<Vec<f64>, Error> {
        let column = recording.column(&self.name)?;
        let place = format!("{}: column `{}`", recording.path().display(), self.name);
        let unit = match (&self.unit, &column.unit) {
            (Some(told), Some(header)) if told != header => {
                return Err(Error::TwoUnits { place, told: told.clone(), header: header.clone() });
            }
            (Some(unit), _) | (None, Some(unit)) => unit,
            (None, None) => "",
        };
        let factor = si_factor(unit, dimension, &place)?;
        Ok(column.values.iter().map(|v| v * factor).collect())
    }
}

fn optional(quantity: &Option<Quantity>, dimension: Dimension, place: &str) -> Result<Option<f64>, Error> {
    quantity.as_ref().map(|q| q.si(dimension, place)).transpose()
}

/// On a linear axis a torque per volt at the screw becomes a force per volt by the lead.
fn drive_gain(file: &File, screw_lead: Option<f64>, path: &Path) -> Result<f64, Error> {
    let place = format!("{}: drive.gain", path.display());
    match (file.axis, screw_lead) {
        (Axis::Rotary, _) => file.drive.gain.si(Dimension::TorqueGain, &place),
        (Axis::Linear, Some(lead)) if file.drive.gain.unit.contains("N m") => {
            Ok(file.drive.gain.si(Dimension::TorqueGain, &place)? * TAU / lead)
        }
        (Axis::Linear, _) => file.drive.gain.si(Dimension::ForceGain, &place),
    }
}

#[cfg(test)]
mod tests;
