//! From the command in the recording to the force or torque on the axis.
//!
//! ```text
//! command [V, A]      × gain [N/V, N m/V, N/A, N m/A]
//! command [%, ‰, 1]   × rated current or voltage × gain,  or × rated force or torque
//! command [N, N m]    × gain [1], which may be left out
//! ```
//!
//! A torque is the motor's: multiplied by the gear's ratio it is that on the load or on the screw, and multiplied by
//! 2π/h the force on the carriage. A force is that on the carriage.

use crate::IdentifyError;
use std::f64::consts::TAU;
use std::path::Path;

use serde::Deserialize;

use super::Axis;
use stickslip_base::Error;
use stickslip_base::units::Dimension::{
    self, Current, Force, ForcePerCurrent, ForcePerVoltage, Share, Torque, TorquePerCurrent, TorquePerVoltage, Voltage,
};
use stickslip_base::units::{Quantity, measure, unfit};

/// The recorded command.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Its dimension.
    pub command: Dimension,
    /// Its unit, as used by the drive.
    pub unit: String,
    /// Largest magnitude that the drive follows, SI unit.
    pub limit: Option<f64>,
}

/// The table in the file.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    gain: Option<Quantity>,
    rated: Option<Quantity>,
    limit: Option<Quantity>,
}

/// Transmission between motor and axis.
pub(super) struct Chain {
    pub(super) axis: Axis,
    pub(super) screw_lead: Option<f64>,
    pub(super) gear_ratio: f64,
}

impl Chain {
    /// The command, and force or torque on the axis per SI unit of it. `stated_unit` is the unit of the command in the
    /// machine file, if any; otherwise the drive's own units determine it. The third is whether the effect is a torque of
    /// the motor, which the gear transmits.
    pub(super) fn drive(
        &self,
        table: &Table,
        stated_unit: Option<&str>,
        path: &Path,
    ) -> Result<(Drive, f64, bool), Error> {
        let place = |field: &str| format!("{}: {field}", path.display());
        let command = self.command(table, stated_unit, &place("columns.command"))?;
        let limit = table.limit.as_ref().map(|limit| limit.si(command, &place("drive.limit"))).transpose()?;
        // Quantity that the gain multiplies, and its factor on the command.
        let (input, rated) = match &table.rated {
            None => (command, 1.0),
            Some(rated) if command == Share => among(rated, &[Current, Voltage, Force, Torque], &place("drive.rated"))?,
            Some(_) => {
                let message = "drive.rated is for commands in %, ‰ or 1. Remove it, or correct the command's unit.";
                return Err(IdentifyError::MachineFile { path: path.to_owned(), message: message.to_owned() }.into());
            }
        };
        let allowed = match input {
            Voltage => self.reachable([ForcePerVoltage, TorquePerVoltage]),
            Current => self.reachable([ForcePerCurrent, TorquePerCurrent]),
            Share => self.reachable([Force, Torque]),
            _ => vec![Share],
        };
        let (output, gain) = match (&table.gain, input) {
            (Some(gain), _) => among(gain, &allowed, &place("drive.gain"))?,
            (None, Force | Torque) => (Share, 1.0),
            (None, _) => {
                let unit = stated_unit.unwrap_or(command.si_unit());
                let message = format!(
                    "drive.gain is missing. State the force or torque per command in {unit}, in one of: {}.",
                    allowed.iter().map(|d| d.si_unit()).collect::<Vec<_>>().join(", ")
                );
                return Err(IdentifyError::MachineFile { path: path.to_owned(), message }.into());
            }
        };
        let effect = if output == Share { input } else { output };
        let torque = matches!(effect, Torque | TorquePerVoltage | TorquePerCurrent);
        let transmission = match (torque, self.axis, self.screw_lead) {
            (true, Axis::Rotary, _) => self.gear_ratio,
            (true, Axis::Linear, Some(lead)) => self.gear_ratio * TAU / lead,
            (false, Axis::Linear, _) => 1.0,
            _ => return Err(unfit(effect.si_unit(), &self.reachable([Force, Torque]), &place("drive"))),
        };
        let unit = stated_unit.unwrap_or(command.si_unit()).to_owned();
        Ok((Drive { command, unit, limit }, rated * gain * transmission, torque))
    }

    /// Dimension of the command.
    fn command(&self, table: &Table, stated_unit: Option<&str>, place: &str) -> Result<Dimension, Error> {
        let allowed = [Voltage, Current, Share, Force, Torque];
        if let Some(unit) = stated_unit {
            let measured = measure(unit).map(|(dimension, _)| dimension).filter(|d| allowed.contains(d));
            return measured.ok_or_else(|| unfit(unit, &allowed, place));
        }
        if table.rated.is_some() {
            return Ok(Share);
        }
        let effect = if self.axis == Axis::Linear && self.screw_lead.is_none() { Force } else { Torque };
        Ok(match table.gain.as_ref().and_then(|gain| measure(&gain.unit)) {
            Some((ForcePerVoltage | TorquePerVoltage, _)) => Voltage,
            Some((ForcePerCurrent | TorquePerCurrent, _)) => Current,
            Some((Force | Torque, _)) => Share,
            _ => effect,
        })
    }

    /// The dimensions, of a force and a torque, that act on the axis.
    fn reachable(&self, [force, torque]: [Dimension; 2]) -> Vec<Dimension> {
        match (self.axis, self.screw_lead) {
            (Axis::Rotary, _) => vec![torque],
            (Axis::Linear, None) => vec![force],
            (Axis::Linear, Some(_)) => vec![force, torque],
        }
    }
}

/// Dimension and SI value of a quantity, if its dimension is one of these.
fn among(quantity: &Quantity, dimensions: &[Dimension], place: &str) -> Result<(Dimension, f64), Error> {
    let dimension_and_factor = measure(&quantity.unit).filter(|(dimension, _)| dimensions.contains(dimension));
    let (dimension, factor) = dimension_and_factor.ok_or_else(|| unfit(&quantity.unit, dimensions, place))?;
    Ok((dimension, quantity.value * factor))
}
