//! The machine for a picture: its parts with a key number each, its travel, and the units of its motion.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use stickslip_base::Preset;
use stickslip_base::quantity::Estimate;

/// The modelled machine, for a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Machine {
    /// The parts, starting with the drive motor.
    pub parts: Vec<Part>,
    /// Ends of the travel by the screw's angle [rad].
    pub ends: [f64; 2],
    /// Units of the angle, with the factor from rad.
    pub angles: Vec<Factor>,
    /// Units of the velocity, with the factor from rad/s.
    pub speeds: Vec<Factor>,
}

/// A part of the machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Part {
    /// Kind of part.
    pub kind: PartKind,
    /// Name.
    pub name: String,
    /// Its key number, as text.
    pub about: String,
    /// Group of its parameters.
    pub group: String,
}

/// Kind of a machine's part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PartKind {
    /// Motor that drives the axis.
    DriveMotor,
    /// Coupling between drive motor and screw.
    Coupling,
    /// Screw, nut and carriage.
    Screw,
    /// Friction wheel: linings on a disc.
    Wheel,
    /// Motor that renders friction.
    LoadMotor,
    /// The encoder.
    Encoder,
}

/// A unit of display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Factor {
    /// Unit as printed.
    pub unit: String,
    /// Factor from the SI unit.
    pub factor: f64,
}

impl Machine {
    /// From the model of a preset, with the preload of the friction wheel.
    pub(super) fn of(preset: &Preset<f64>, preload: f64) -> Self {
        let model = &preset.model;
        let text = |value: f64, unit: &str| Estimate::new(value, unit).to_string();
        let part =
            |kind, name: &str, about: String, group: &str| Part { kind, name: name.into(), about, group: group.into() };
        let drive = &model.drive;
        let resonance = drive.vibration() / TAU;
        let drive_torque = model.scaling.torque_per_volt * model.scaling.servo_limit;
        let load_torque = model.load_motor.torque_constant * model.load_amplifier.current_limit;
        let factor = |unit: &str, factor: f64| Factor { unit: unit.into(), factor };
        let lead = 1e3 * drive.screw_lead / TAU;
        let limits = &preset.bench.safety;
        Machine {
            parts: vec![
                part(PartKind::DriveMotor, "Drive motor", format!("±{}", text(drive_torque, "N m")), "model.motor"),
                part(PartKind::Coupling, "Coupling", text(resonance, "Hz"), "model.drive"),
                part(PartKind::Screw, "Ball screw", format!("{} mm a turn", 1e3 * drive.screw_lead), "model.own"),
                part(
                    PartKind::Wheel,
                    "Friction wheel",
                    if preload > 0.0 { format!("preload {preload}") } else { "released".into() },
                    "plant.wheel",
                ),
                part(PartKind::LoadMotor, "Load motor", format!("±{}", text(load_torque, "N m")), "model.load_motor"),
                part(
                    PartKind::Encoder,
                    "Encoder",
                    format!("{} a turn", stickslip_base::quantity::number(model.encoder.counts_per_revolution, 0)),
                    "model.encoder",
                ),
            ],
            ends: [limits.lower_end, limits.upper_end],
            angles: vec![factor("rad", 1.0), factor("turns", 1.0 / TAU), factor("mm", lead)],
            speeds: vec![factor("rad/s", 1.0), factor("rpm", 60.0 / TAU), factor("mm/s", lead)],
        }
    }
}
