//! Description of the recorded machine: a TOML file for the recording.
//!
//! Columns and their units, the drive from command to force, controller, recipe. Linear axes are identified in kg and
//! N, rotary ones in kg m² and N m; the equations are the same. [`guess`] proposes a file for a recording.

mod columns;
mod drive;
mod effect;
pub mod guess;
mod runs;
mod signals;
mod understood;

use crate::IdentifyError;
use std::collections::BTreeMap;
use std::path::Path;

pub use drive::Drive;
pub use runs::{Pendulum, Run};
use serde::Deserialize;
pub use signals::{Recorded, Signals};

use stickslip_base::units::{Dimension, Quantity};
use stickslip_base::{Error, input};
use stickslip_recording::{Recording, Wanted};

/// A machine file, checked, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Name for reports.
    pub name: String,
    /// How it moves.
    pub axis: Axis,
    /// The only group (raster) of the file that is read; default: the fastest one with the columns.
    pub group: Option<String>,
    /// Sampling period of controller and recording [s].
    pub sampling_period: f64,
    /// Whether uneven samples are interpolated on a grid of the sampling period.
    pub resample: bool,
    /// Travel per turn of the screw [m].
    pub screw_lead: Option<f64>,
    /// Turns of the motor per turn of the screw or of the load.
    pub gear_ratio: f64,
    /// Smallest step of the position [m or rad].
    pub encoder_grid: Option<f64>,
    /// Moving mass or inertia, rotor included, if known [kg or kg m²]; identified otherwise.
    pub inertia: Option<f64>,
    /// Whether the axis lifts: its offset is then a weight, not a difference between two frictions.
    pub vertical: bool,
    /// Lifted mass [kg].
    pub lifted_mass: Option<f64>,
    /// Roles of the columns.
    pub columns: Columns,
    /// Unit of the command in the recording.
    pub drive: Drive,
    /// Force or torque on the axis per command in its SI unit [N/V, N m/A, …].
    pub gain: f64,
    /// The controller.
    pub controller: Controller,
    /// A servo that swings a pendulum, recorded in several runs; it has its own drive and controller.
    pub pendulum: Option<Pendulum>,
    /// Preprocessing of the recording for the least squares.
    pub recipe: Recipe,
    /// Answers that `machine init` guessed from the recording.
    pub guessed: Vec<String>,
    /// Results of others, `[value, standard deviation]` by table and name: shown, but not used.
    pub published: BTreeMap<String, BTreeMap<String, Vec<f64>>>,
    /// Text of the file, for reports.
    pub text: String,
}

/// Kind of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// Position in m, inertia in kg, force in N.
    Linear,
    /// Angle in rad, inertia in kg m², torque in N m.
    Rotary,
}

/// Roles of the columns.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Columns {
    /// Time of the sample; default: the sampling period.
    pub time: Option<Channel>,
    /// Measured position.
    pub position: Channel,
    /// Measured velocity, if it is better than differences of the position.
    pub velocity: Option<Channel>,
    /// Position of the motor, where `position` is that of the load: their difference shows twist and backlash.
    pub motor_position: Option<Channel>,
    /// Reference position; needed to predict the closed loop.
    pub reference: Option<Channel>,
    /// Command of the controller to the drive.
    pub command: Channel,
    /// Known signal that was added to the command after the controller's limit.
    pub injected: Option<Channel>,
    /// Number of the run that a row belongs to.
    pub run: Option<Channel>,
    /// Whether the drive is on: 0 or 1. Of an axis, the longest stretch of enabled rows is used.
    pub enabled: Option<Channel>,
}

/// A column and its unit; the unit may be in the header instead.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Name in the header.
    pub name: String,
    /// A unit of the [table of units](stickslip_base::units).
    pub unit: Option<String>,
    /// For `counts`: counts in a turn.
    pub counts_per_rev: Option<f64>,
    /// Number of values of a counter or register, 65536 for 16 bits, in the unit of the column. A position is continued
    /// over its end; of a velocity or command, values from half of it on are negative.
    pub wraps: Option<f64>,
    /// Side of the gear where an angle is measured.
    #[serde(default)]
    pub at: Place,
}

/// A side of the gear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Behind it: screw or load.
    #[default]
    Load,
    /// Before it.
    Motor,
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
    /// k_v [command per m/s or rad/s: V/(m/s), A/(rad/s), …].
    pub velocity_gain: f64,
    /// Magnitude of the largest command, in its SI unit.
    pub limit: f64,
}

/// Preprocessing of the recording for the least squares.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Recipe {
    /// Cut-off of the low-pass of the position, forward and backward [Hz].
    pub low_pass: f64,
    /// Its order.
    pub order: usize,
    /// Decimation: one row of this number is used, after a low-pass of all columns.
    pub decimation: usize,
    /// Samples dropped at the start.
    pub skip: usize,
}

impl Default for Recipe {
    fn default() -> Self {
        Recipe { low_pass: 100.0, order: 4, decimation: 10, skip: 50 }
    }
}

/// Contents of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    name: String,
    axis: Axis,
    group: Option<String>,
    sampling_period: Quantity,
    #[serde(default)]
    resample: bool,
    screw_lead: Option<Quantity>,
    gear_ratio: Option<f64>,
    encoder_grid: Option<Quantity>,
    inertia: Option<Quantity>,
    #[serde(default)]
    vertical: bool,
    lifted_mass: Option<Quantity>,
    columns: Columns,
    #[serde(default)]
    drive: drive::Table,
    #[serde(default)]
    controller: Controller,
    pendulum: Option<Pendulum>,
    #[serde(default)]
    recipe: Recipe,
    #[serde(default)]
    guessed: Vec<String>,
    #[serde(default)]
    published: BTreeMap<String, BTreeMap<String, Vec<f64>>>,
}

impl Machine {
    /// Reads and checks a machine file.
    ///
    /// # Errors
    /// A file that cannot be read, an invalid machine file, or invalid values.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::parse(path, &input::text(path, input::TEXT)?)
    }

    /// From the text of a machine file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(path: &Path, text: &str) -> Result<Self, Error> {
        let file: File = toml::from_str(text).map_err(|error| IdentifyError::of_toml(path, text, &error))?;
        let si = |quantity: &Option<Quantity>, field: &str, dimension| {
            quantity.as_ref().map(|q| q.si(dimension, &format!("{}: {field}", path.display()))).transpose()
        };
        let screw_lead = si(&file.screw_lead, "screw_lead", Dimension::Length)?;
        let gear_ratio = file.gear_ratio.unwrap_or(1.0);
        let chain = drive::Chain { axis: file.axis, screw_lead, gear_ratio };
        let (drive, gain, motor_side) = match &file.pendulum {
            None => chain.drive(&file.drive, file.columns.command.unit.as_deref(), path)?,
            // The command is a duty cycle, whose torque is identified.
            Some(_) => (Drive { command: Dimension::Share, unit: "1".into(), limit: None }, 1.0, true),
        };
        let machine = Machine {
            sampling_period: si(&Some(file.sampling_period), "sampling_period", Dimension::Time)?.unwrap_or(f64::NAN),
            encoder_grid: si(&file.encoder_grid, "encoder_grid", file.axis.position())?,
            inertia: si(&file.inertia, "inertia", file.axis.inertia())?,
            lifted_mass: si(&file.lifted_mass, "lifted_mass", Dimension::Mass)?,
            resample: file.resample,
            screw_lead,
            gear_ratio,
            vertical: file.vertical,
            drive,
            gain,
            name: file.name,
            axis: file.axis,
            group: file.group,
            columns: file.columns,
            controller: file.controller,
            pendulum: file.pendulum.map(|pendulum| pendulum.beside(path)),
            recipe: file.recipe,
            guessed: file.guessed,
            published: file.published,
            text: text.to_owned(),
        };
        machine.check(path)?;
        if let Some((key, reason)) = machine.without_effect(motor_side) {
            let message = format!("{key} has no effect: it {reason}. Remove or correct it.");
            return Err(IdentifyError::MachineFile { path: path.to_owned(), message }.into());
        }
        Ok(machine)
    }

    /// The recording of a file, with the columns of this machine. `group` replaces the group of the machine file.
    ///
    /// # Errors
    /// Those of [`Recording::read_wanted`].
    pub fn recording(&self, path: &Path, group: Option<&str>) -> Result<Recording, Error> {
        let group = group.map(str::to_owned).or_else(|| self.group.clone());
        Recording::read_wanted(path, &Wanted { group, columns: self.columns.names() })
    }

    fn check(&self, path: &Path) -> Result<(), Error> {
        let positive = "must be positive.";
        let recipe = &self.recipe;
        let mut numbers = vec![("sampling_period", self.sampling_period), ("gear_ratio", self.gear_ratio)];
        numbers.extend([("recipe.low_pass", recipe.low_pass), ("recipe.order", recipe.order as f64)]);
        numbers.push(("recipe.decimation", recipe.decimation as f64));
        let mut optional = |name, value: Option<f64>| numbers.extend(value.map(|v| (name, v)));
        optional("screw_lead", self.screw_lead);
        optional("encoder_grid", self.encoder_grid);
        optional("inertia", self.inertia);
        optional("lifted_mass", self.lifted_mass);
        optional("drive.limit", self.drive.limit);
        for (name, channel) in self.columns.positions() {
            optional(name, channel.counts_per_rev);
        }
        optional("columns.position.wraps", self.columns.position.wraps);
        optional("columns.command.wraps", self.columns.command.wraps);
        if let Some(pendulum) = &self.pendulum {
            numbers.extend(pendulum.numbers());
        }
        if let Controller::Cascade(cascade) = self.controller {
            numbers.push(("controller.position_gain", cascade.position_gain));
            numbers.push(("controller.velocity_gain", cascade.velocity_gain));
            numbers.push(("controller.limit", cascade.limit));
        }
        let refuse = |field, value, remedy| {
            Err(IdentifyError::MachineValue { path: path.to_owned(), field, value, remedy }.into())
        };
        for (field, value) in numbers {
            if !(value.is_finite() && value > 0.0) {
                return refuse(field, value, positive);
            }
        }
        if !(self.gain.is_finite() && self.gain != 0.0) {
            return refuse(
                "drive.gain",
                self.gain,
                "on the axis must be a finite force per command; its sign is that of the motion.",
            );
        }
        // The filter's continuation is 3·(order + 1) samples, and orders above 10 are typing errors.
        if self.recipe.order > 10 {
            return refuse("recipe.order", self.recipe.order as f64, "is more than 10; 4 is usual.");
        }
        Ok(())
    }
}

impl Columns {
    /// Names of all columns.
    fn names(&self) -> Vec<String> {
        let optional = [
            &self.time,
            &self.velocity,
            &self.motor_position,
            &self.reference,
            &self.injected,
            &self.run,
            &self.enabled,
        ];
        let all = [&self.position, &self.command].into_iter().chain(optional.into_iter().flatten());
        all.map(|channel| channel.name.clone()).collect()
    }

    /// Columns of positions.
    fn positions(&self) -> impl Iterator<Item = (&'static str, &Channel)> {
        let all = [
            ("columns.position.counts_per_rev", Some(&self.position)),
            ("columns.motor_position.counts_per_rev", self.motor_position.as_ref()),
            ("columns.reference.counts_per_rev", self.reference.as_ref()),
        ];
        all.into_iter().filter_map(|(name, channel)| Some((name, channel?)))
    }
}

impl Axis {
    /// Dimension of its position.
    pub fn position(self) -> Dimension {
        match self {
            Axis::Linear => Dimension::Length,
            Axis::Rotary => Dimension::Angle,
        }
    }

    /// Dimension of its velocity.
    pub fn velocity(self) -> Dimension {
        match self {
            Axis::Linear => Dimension::Velocity,
            Axis::Rotary => Dimension::AngularVelocity,
        }
    }

    /// Dimension of its inertia.
    pub fn inertia(self) -> Dimension {
        match self {
            Axis::Linear => Dimension::Mass,
            Axis::Rotary => Dimension::Inertia,
        }
    }
}

#[cfg(test)]
mod tests;
