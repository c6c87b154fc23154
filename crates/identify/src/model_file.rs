//! `model.toml`: the identified model, and the same as a preset of the virtual bench.
//!
//! The table `[identified]` is the model itself, in the units of the axis, for [`read_model`]. The rest is an ordinary
//! preset, with all values referred to the screw, so that each command that accepts a preset accepts this file.

use crate::IdentifyError;
use std::fmt::Write;
use std::path::Path;

use serde::Deserialize;
use stickslip_core::friction::{Decay, Stribeck};

use super::axis::{AxisModel, Bristles};
use super::preset::preset;
use super::{Identification, results};
use crate::machine::{Axis, Machine};
use stickslip_base::parameters::{self, Value};
use stickslip_base::{Error, Preset, input};

use stickslip_base::parameters::IDENTIFIED as TABLE;

/// The text of `model.toml`: the best model.
pub fn model_toml(result: &Identification, machine: &Machine) -> String {
    let AxisModel { inertia, positive, negative, offset, lag, bristles } = &result.best().model;
    let unit = |name| results::unit(result.axis, name);
    let mut text = format!(
        "# {}, identified by stickslip {}. SI units.\n#\n# The same on the screw, as a preset of the virtual bench.\n# \
         There both directions share one shape of the curve, and inertia is split 1 : 2 between motor and load.\n",
        machine.name.replace(['\n', '\r'], " "),
        env!("CARGO_PKG_VERSION")
    );
    let mut line = |arguments: std::fmt::Arguments<'_>| writeln!(text, "{arguments}").expect("a string takes all");
    for difference in parameters::diff(&Preset::default(), &preset(result, machine)) {
        let Some(entry) = difference.after else { continue };
        match entry.value {
            Value::Number(value) if entry.field.unit == "1" => line(format_args!("{} = {value:?}", entry.path)),
            Value::Number(value) => line(format_args!("{} = {value:?} # {}", entry.path, entry.field.unit)),
            Value::Variant(name) => line(format_args!("{} = {name:?}", entry.path)),
        }
    }
    line(format_args!("\n# Model for `stickslip validate`.\n[{TABLE}]"));
    line(format_args!("machine = {:?}", machine.name));
    line(format_args!("axis = \"{}\"", if result.axis == Axis::Linear { "linear" } else { "rotary" }));
    line(format_args!("kind = {:?}", result.best().kind.name()));
    line(format_args!("inertia = {inertia:?} # {}", unit("mass")));
    line(format_args!("offset = {offset:?} # {}, against positive motion", unit("offset")));
    line(format_args!("lag = {lag:?} # s, of the drive"));
    for (name, side) in [("positive", positive), ("negative", negative)] {
        let Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, .. } = side;
        line(format_args!("\n[{TABLE}.{name}]"));
        line(format_args!("breakaway = {breakaway_torque:?} # {}", unit("breakaway")));
        line(format_args!("coulomb = {kinetic_torque:?} # {}", unit("coulomb")));
        line(format_args!("stribeck_velocity = {stribeck_velocity:?} # {}", unit("velocity")));
        line(format_args!("viscous = {viscous_friction:?} # {}", unit("viscous")));
    }
    if let Some(bristles) = bristles {
        line(format_args!("\n[{TABLE}.bristles]"));
        line(format_args!("stiffness = {:?} # {}", bristles.stiffness, unit("stiffness")));
        line(format_args!("damping = {:?} # {}", bristles.damping, unit("damping")));
        line(format_args!("damping_velocity = {:?} # {}", bristles.damping_velocity, unit("velocity")));
    }
    text
}

/// A model from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifiedModel {
    /// Name of the machine.
    pub machine: String,
    /// Kind of axis, which determines the units.
    pub axis: Axis,
    /// The model.
    pub model: AxisModel<f64>,
}

#[derive(Deserialize)]
struct File {
    identified: Option<Identified>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Identified {
    machine: String,
    axis: Axis,
    #[serde(rename = "kind")]
    _kind: String,
    inertia: f64,
    offset: f64,
    lag: f64,
    positive: Side,
    negative: Side,
    bristles: Option<FileBristles>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Side {
    breakaway: f64,
    coulomb: f64,
    stribeck_velocity: f64,
    viscous: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileBristles {
    stiffness: f64,
    damping: f64,
    damping_velocity: f64,
}

impl Side {
    fn curve(&self) -> Stribeck<f64> {
        Stribeck {
            breakaway_torque: self.breakaway,
            kinetic_torque: self.coulomb,
            stribeck_velocity: self.stribeck_velocity,
            viscous_friction: self.viscous,
            decay: Decay::Exponential,
        }
    }
}

/// Reads the table `[identified]` of a `model.toml`.
///
/// # Errors
/// A file that cannot be read or has no such table, or an invalid number in it.
pub fn read_model(path: &Path) -> Result<IdentifiedModel, Error> {
    let text = input::text(path, input::TEXT)?;
    let wrong = |message: String| IdentifyError::MachineFile { path: path.to_owned(), message };
    let file: File = toml::from_str(&text).map_err(|error| IdentifyError::of_toml(path, &text, &error))?;
    let Some(table) = file.identified else {
        return Err(
            wrong(format!("missing table [{TABLE}]. Give the model.toml that `stickslip identify` wrote.")).into()
        );
    };
    let bristles = table.bristles.as_ref();
    let mut positive =
        vec![("inertia", table.inertia), ("positive.stribeck_velocity", table.positive.stribeck_velocity)];
    positive.push(("negative.stribeck_velocity", table.negative.stribeck_velocity));
    positive.extend(bristles.map(|b| ("bristles.stiffness", b.stiffness)));
    positive.extend(bristles.map(|b| ("bristles.damping_velocity", b.damping_velocity)));
    let finite = [table.offset, table.positive.breakaway, table.positive.coulomb, table.positive.viscous];
    let finite = finite.into_iter().chain([table.negative.breakaway, table.negative.coulomb, table.negative.viscous]);
    if let Some((name, value)) = positive.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
        return Err(wrong(format!("{TABLE}.{name} = {value} must be positive.")).into());
    }
    if let Some(value) = finite.into_iter().find(|value| !value.is_finite()) {
        return Err(wrong(format!("[{TABLE}] contains {value}. Identify again, or correct the number.")).into());
    }
    if !(table.lag.is_finite() && table.lag >= 0.0) {
        return Err(wrong(format!("{TABLE}.lag = {} must be 0 or positive.", table.lag)).into());
    }
    let model = AxisModel {
        inertia: table.inertia,
        positive: table.positive.curve(),
        negative: table.negative.curve(),
        offset: table.offset,
        lag: table.lag,
        bristles: bristles.map(|b| Bristles {
            stiffness: b.stiffness,
            damping: b.damping,
            damping_velocity: b.damping_velocity,
        }),
    };
    Ok(IdentifiedModel { machine: table.machine, axis: table.axis, model })
}
