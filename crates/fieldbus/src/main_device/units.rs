//! Units of a drive, from its objects or from the profile, and their comparison with the preset.

use std::f64::consts::TAU;

use ethercrab::{SubDevice, SubDeviceRef};

use super::error::MainDeviceError;
use super::profile::{Profile, TorqueUnit};

/// Range of the counter 0x6064.
const COUNTER: f64 = 4_294_967_296.0;
/// Tolerance of the largest torque: the rated torque is a whole number of mN m.
const TOLERANCE: f64 = 0.01;
/// Bit of the cyclic synchronous torque mode in 0x6502.
const TORQUE_MODE: u32 = 1 << 9;

/// Values per unit of the objects, in the positive direction of the screw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Units {
    /// Torque per unit of 0x6071 and 0x6077 [N m].
    pub(crate) torque: f64,
    /// Position units per revolution.
    pub(crate) revolution: f64,
    /// Velocity per unit of 0x606C [rad/s].
    pub(crate) velocity: f64,
    /// −1 for a drive that is mounted in the other direction.
    pub(crate) sign: i32,
    /// Largest torque by 0x6072, if the drive has it [N m].
    pub(crate) largest_torque: Option<f64>,
}

/// What the preset expects of a drive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expected {
    /// Torque constant of the motor [N m/A].
    pub(crate) torque_constant: f64,
    /// Largest torque [N m], and its parameter.
    pub(crate) torque: f64,
    pub(crate) parameter: &'static str,
    /// Counts per revolution and range of the counter, for the drive on the screw.
    pub(crate) encoder: Option<(f64, f64)>,
}

/// A device in PRE-OP.
pub(crate) type Device<'a, 'b> = SubDeviceRef<'a, &'b SubDevice>;

/// An object, if the device has it.
pub(crate) async fn object(device: &Device<'_, '_>, index: u16, subindex: u8) -> Option<u32> {
    device.sdo_read::<u32>(index, subindex).await.ok()
}

impl Units {
    /// Reads the units of a drive.
    pub(crate) async fn read(
        device: &Device<'_, '_>,
        profile: &Profile,
        torque_constant: f64,
    ) -> Result<Self, MainDeviceError> {
        let position = profile.position;
        let missing = |object, key| MainDeviceError::Unit { position, object, key };
        let modes = object(device, 0x6502, 0).await;
        if let Some(modes) = modes.filter(|modes| modes & TORQUE_MODE == 0) {
            return Err(MainDeviceError::Mode { position, modes });
        }
        let torque = match profile.torque {
            TorqueUnit::Fixed(unit) => unit,
            TorqueUnit::RatedTorque => {
                let rated = object(device, 0x6076, 0).await.filter(|rated| *rated > 0);
                1e-6 * f64::from(rated.ok_or_else(|| missing(0x6076, "torque_unit"))?)
            }
            TorqueUnit::RatedCurrent(own) => {
                let rated = object(device, 0x6075, 0).await.filter(|rated| *rated > 0);
                let rated = f64::from(rated.ok_or_else(|| missing(0x6075, "torque_unit"))?);
                1e-6 * rated * own.unwrap_or(torque_constant)
            }
        };
        let revolution = match profile.units_per_revolution {
            Some(units) => units,
            None => revolution(device).await.ok_or_else(|| missing(0x608F, "units_per_revolution"))?,
        };
        let largest = device.sdo_read::<u16>(0x6072, 0).await.ok();
        Ok(Units {
            torque,
            revolution,
            velocity: profile.velocity_unit.unwrap_or(TAU / revolution),
            sign: if profile.reversed { -1 } else { 1 },
            largest_torque: largest.map(|units| f64::from(units) * torque),
        })
    }

    /// Compares the units with the preset.
    pub(crate) fn check(&self, position: u8, expected: &Expected) -> Result<(), MainDeviceError> {
        if let Some((own, range)) = expected.encoder.filter(|encoder| *encoder != (self.revolution, COUNTER)) {
            return Err(MainDeviceError::Resolution { position, found: self.revolution, own, range });
        }
        match self.largest_torque {
            Some(found) if found * (1.0 + TOLERANCE) < expected.torque => {
                Err(MainDeviceError::Torque { position, found, own: expected.torque, parameter: expected.parameter })
            }
            _ => Ok(()),
        }
    }
}

/// Position units per revolution of the motor: 0x6092 over the gear 0x6091, otherwise 0x608F.
async fn revolution(device: &Device<'_, '_>) -> Option<f64> {
    let ratio = async |index: u16| -> Option<f64> {
        let above = object(device, index, 1).await.filter(|above| *above > 0)?;
        let below = object(device, index, 2).await.filter(|below| *below > 0)?;
        Some(f64::from(above) / f64::from(below))
    };
    let gear = ratio(0x6091).await.unwrap_or(1.0);
    match ratio(0x6092).await {
        Some(feed) => Some(feed / gear),
        None => ratio(0x608F).await,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNITS: Units =
        Units { torque: 5e-4, revolution: 65_536.0, velocity: TAU / 65_536.0, sign: 1, largest_torque: Some(1.5) };

    fn expected(torque: f64, encoder: Option<(f64, f64)>) -> Expected {
        Expected { torque_constant: 0.1, torque, parameter: "model.scaling.servo_limit", encoder }
    }

    #[test]
    fn another_resolution_is_refused_with_both_values_and_the_settings() {
        UNITS.check(1, &expected(1.5, Some((65_536.0, COUNTER)))).unwrap();
        let refusal = UNITS.check(1, &expected(1.5, Some((10_000.0, 65_536.0)))).unwrap_err().to_string();
        for part in ["65536 counts", "10000", "--set model.encoder.counts_per_revolution=65536"] {
            assert!(refusal.contains(part), "{refusal}");
        }
    }

    #[test]
    fn a_drive_that_is_too_weak_is_refused_with_both_torques() {
        UNITS.check(0, &expected(1.51, None)).unwrap();
        let refusal = UNITS.check(0, &expected(2.0, None)).unwrap_err().to_string();
        assert!(refusal.contains("1.500 N m") && refusal.contains("2.000 N m") && refusal.contains("servo_limit"));
    }
}
