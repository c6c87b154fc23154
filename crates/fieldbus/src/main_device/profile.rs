//! Description of the drives: positions, process data, start-up list, units. Without a file, the drive motor is at
//! position 0, the load motor at position 1, and both have the profile `generic`.

use std::path::Path;

use serde::Deserialize;

use super::error::MainDeviceError;

/// A file that describes drives and an accelerometer.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DriveFile {
    /// Time without set-points after which a device leaves OP [s]; default: as set in the device, usually 0.1 s.
    pub(crate) watchdog: Option<f64>,
    #[serde(default)]
    motor: DriveSection,
    #[serde(default)]
    load: DriveSection,
    pub(crate) accelerometer: Option<Accelerometer>,
}

/// A drive in the file; what is missing comes from the profile.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveSection {
    position: Option<u8>,
    profile: Option<String>,
    #[serde(default)]
    reversed: bool,
    torque_unit: Option<f64>,
    torque_constant: Option<f64>,
    units_per_revolution: Option<f64>,
    velocity_unit: Option<f64>,
    outputs: Option<Vec<Pdo>>,
    inputs: Option<Vec<Pdo>>,
    #[serde(default)]
    start: Vec<StartUp>,
}

/// An analogue input with the accelerometer.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Accelerometer {
    /// Position of the device.
    pub(crate) position: u8,
    /// First byte of the signed 16-bit signal in the inputs of the device.
    #[serde(default)]
    pub(crate) byte: usize,
    /// Voltage of the accelerometer at 32767 [V].
    pub(crate) volts: f64,
}

/// A process data object.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Pdo {
    pub(crate) index: u16,
    /// Entries as in the mapping: index, subindex and number of bits (0x6040_0010).
    pub(crate) entries: Vec<u32>,
    /// The device has this mapping already, and it cannot be written.
    #[serde(default)]
    pub(crate) fixed: bool,
}

/// An entry of the start-up list.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StartUp {
    pub(crate) index: u16,
    #[serde(default)]
    pub(crate) subindex: u8,
    pub(crate) value: i64,
    /// Length of the object: 1, 2 or 4.
    pub(crate) bytes: u8,
}

/// Unit of the torque objects 0x6071 and 0x6077.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TorqueUnit {
    /// 0.1 % of the rated torque 0x6076 [mN m], as of CiA 402.
    RatedTorque,
    /// 0.1 % of the rated current 0x6075 [mA], times a torque constant [N m/A]; default: that of the preset.
    RatedCurrent(Option<f64>),
    /// This torque [N m].
    Fixed(f64),
}

/// A drive.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    pub(crate) position: u8,
    pub(crate) outputs: Vec<Pdo>,
    pub(crate) inputs: Vec<Pdo>,
    pub(crate) start: Vec<StartUp>,
    pub(crate) torque: TorqueUnit,
    /// Units of the position per revolution; otherwise from the drive.
    pub(crate) units_per_revolution: Option<f64>,
    /// Velocity per unit of 0x606C [rad/s]; otherwise position units per second.
    pub(crate) velocity_unit: Option<f64>,
    pub(crate) reversed: bool,
}

/// Controlword, torque, mode, touch probe.
const OUTPUTS: [u32; 4] = [0x6040_0010, 0x6071_0010, 0x6060_0008, 0x60B8_0010];
/// Statusword, position, velocity, torque, error code, mode, state and position of the touch probe.
const INPUTS: [u32; 8] =
    [0x6041_0010, 0x6064_0020, 0x606C_0020, 0x6077_0010, 0x603F_0010, 0x6061_0008, 0x60B9_0010, 0x60BA_0020];
/// Names of the built-in profiles.
const PROFILES: [&str; 2] = ["generic", "rated-current"];

impl DriveFile {
    /// Reads a file; without one, the defaults.
    pub(crate) fn read(path: Option<&Path>) -> Result<Self, MainDeviceError> {
        let Some(path) = path else { return Ok(DriveFile::default()) };
        let problem = |reason: String| MainDeviceError::File { path: path.to_owned(), reason };
        let text = std::fs::read_to_string(path).map_err(|error| problem(error.to_string()))?;
        let file: DriveFile = toml::from_str(&text).map_err(|error| problem(error.to_string()))?;
        file.profiles().map_err(problem)?;
        if file.watchdog.is_some_and(|time| !(1e-3..=6.5).contains(&time)) {
            return Err(problem("watchdog is outside 0.001 … 6.5 s".into()));
        }
        Ok(file)
    }

    /// Drive motor and load motor.
    pub(crate) fn profiles(&self) -> Result<[Profile; 2], String> {
        let profiles = [self.motor.profile("motor", 0)?, self.load.profile("load", 1)?];
        if profiles[0].position == profiles[1].position {
            return Err(format!("motor and load are both at position {}", profiles[0].position));
        }
        Ok(profiles)
    }
}

impl DriveSection {
    fn profile(&self, name: &str, position: u8) -> Result<Profile, String> {
        let torque = match self.profile.as_deref() {
            None | Some("generic") => TorqueUnit::RatedTorque,
            Some("rated-current") => TorqueUnit::RatedCurrent(self.torque_constant),
            Some(other) => {
                return Err(format!("unknown profile \"{other}\" of {name}; available: {}", PROFILES.join(", ")));
            }
        };
        if self.torque_constant.is_some() && torque == TorqueUnit::RatedTorque {
            return Err(format!("torque_constant of {name} requires profile = \"rated-current\""));
        }
        for (what, value) in [
            ("torque_unit", self.torque_unit),
            ("torque_constant", self.torque_constant),
            ("units_per_revolution", self.units_per_revolution),
            ("velocity_unit", self.velocity_unit),
        ] {
            if value.is_some_and(|value| !(value > 0.0 && value.is_finite())) {
                return Err(format!("{what} of {name} is not a positive number; for the other direction use reversed"));
            }
        }
        if let Some(entry) = self.start.iter().find(|entry| ![1, 2, 4].contains(&entry.bytes)) {
            return Err(format!("bytes = {} of the start-up list of {name} is not 1, 2 or 4", entry.bytes));
        }
        let list = |own: &Option<Vec<Pdo>>, index: u16, entries: &[u32]| {
            own.clone().unwrap_or_else(|| vec![Pdo { index, entries: entries.to_vec(), fixed: false }])
        };
        Ok(Profile {
            position: self.position.unwrap_or(position),
            outputs: list(&self.outputs, 0x1600, &OUTPUTS),
            inputs: list(&self.inputs, 0x1A00, &INPUTS),
            start: self.start.clone(),
            torque: self.torque_unit.map_or(torque, TorqueUnit::Fixed),
            units_per_revolution: self.units_per_revolution,
            velocity_unit: self.velocity_unit,
            reversed: self.reversed,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profiles(text: &str) -> Result<[Profile; 2], String> {
        toml::from_str::<DriveFile>(text).map_err(|error| error.to_string())?.profiles()
    }

    #[test]
    fn without_a_file_both_drives_are_generic() {
        let [motor, load] = profiles("").unwrap();
        assert_eq!((motor.position, load.position), (0, 1));
        assert_eq!((motor.torque, &load.outputs[0].entries[..]), (TorqueUnit::RatedTorque, &OUTPUTS[..]));
    }

    #[test]
    fn a_file_changes_what_it_names() {
        let [motor, load] = profiles(
            "[motor]\nposition = 2\nprofile = \"rated-current\"\ntorque_constant = 0.08\n\
             start = [{ index = 0x6072, value = 500, bytes = 2 }]\n[load]\nreversed = true\ntorque_unit = 1e-3\n\
             outputs = [{ index = 0x1601, entries = [0x6040_0010, 0x6071_0010], fixed = true }]",
        )
        .unwrap();
        assert_eq!((motor.position, motor.torque), (2, TorqueUnit::RatedCurrent(Some(0.08))));
        assert_eq!(motor.start, [StartUp { index: 0x6072, subindex: 0, value: 500, bytes: 2 }]);
        assert!(load.reversed && load.outputs[0].fixed && load.inputs[0].entries == INPUTS);
        assert_eq!(load.torque, TorqueUnit::Fixed(1e-3));
    }

    #[test]
    fn an_invalid_file_is_refused_with_the_reason() {
        for (text, reason) in [
            ("[motor]\nprofile = \"beckof\"", "available: generic, rated-current"),
            ("[motor]\nposition = 1", "both at position 1"),
            ("[load]\ntorque_constant = 0.1", "requires profile"),
            ("[load]\nvelocity_unit = -1.0", "reversed"),
            ("[load]\nstart = [{ index = 1, value = 1, bytes = 3 }]", "not 1, 2 or 4"),
            ("[lod]\nposition = 1", "unknown field"),
        ] {
            let refusal = profiles(text).unwrap_err();
            assert!(refusal.contains(reason), "{refusal}");
        }
    }
}
