//! Process data of a drive: the mapping of the profile, or the one that the drive has and does not allow to be written.

use ethercrab::error::{Error, MailboxError};

use super::bring_up::{OBJECTS, step};
use super::error::MainDeviceError;
use super::profile::{Pdo, Profile};
use super::units::Device;

/// Objects that a bench requires.
pub(crate) const OUTPUTS: [u16; 2] = [0x6040, 0x6071];
pub(crate) const INPUTS: [u16; 4] = [0x6041, 0x6064, 0x606C, 0x6077];
/// Limits: in the process data of a drive, zero would forbid each torque or motion.
const LIMITS: [u16; 5] = [0x6072, 0x607F, 0x6080, 0x60E0, 0x60E1];

/// The process data of a drive.
#[derive(Clone, Debug)]
pub(crate) struct Mapping {
    pub(crate) outputs: Vec<Pdo>,
    pub(crate) inputs: Vec<Pdo>,
    /// Limits in the outputs, with the values that the drive has.
    pub(crate) limits: Vec<(u16, i32)>,
}

/// Writes the mapping of a profile. If the drive refuses it, its own is used, provided that it is sufficient.
pub(crate) async fn map(device: &Device<'_, '_>, profile: &Profile) -> Result<Mapping, MainDeviceError> {
    let outputs = agree(device, profile.position, 0x1C12, &profile.outputs, &OUTPUTS).await?;
    let inputs = agree(device, profile.position, 0x1C13, &profile.inputs, &INPUTS).await?;
    let mut limits = Vec::new();
    for (object, bits) in mapped(&outputs).filter(|(object, _)| LIMITS.contains(object)) {
        let value = match bits {
            16 => device.sdo_read::<u16>(object, 0).await.map(u32::from),
            _ => device.sdo_read::<u32>(object, 0).await,
        };
        let value = value.map_err(step(format!("device {}, object 0x{object:04X}", profile.position), OBJECTS))?;
        limits.push((object, value as i32));
    }
    Ok(Mapping { outputs, inputs, limits })
}

/// The mapping of a direction.
async fn agree(
    device: &Device<'_, '_>,
    position: u8,
    assignment: u16,
    wanted: &[Pdo],
    required: &[u16],
) -> Result<Vec<Pdo>, MainDeviceError> {
    let before = read(device, assignment).await;
    let error = match (write(device, assignment, wanted).await, &before) {
        (Ok(()), _) => return Ok(wanted.to_vec()),
        (Err(error @ Error::Mailbox(MailboxError::Aborted { .. })), Ok(_)) => error,
        (Err(error), _) => {
            return Err(step(format!("device {position}, mapping 0x{assignment:04X}"), OBJECTS)(error));
        }
    };
    // What was changed before the refusal is restored.
    if let Ok(before) = before {
        let _ = write(device, assignment, &before).await;
    }
    let own = read(device, assignment).await;
    let own = own.map_err(step(format!("device {position}, mapping 0x{assignment:04X}"), OBJECTS))?;
    match missing(&own, required) {
        Some(objects) => {
            Err(MainDeviceError::FixedMapping { position, reason: error.to_string(), own: list(&own), objects })
        }
        None => Ok(own),
    }
}

/// Assigned process data objects and their entries.
async fn read(device: &Device<'_, '_>, assignment: u16) -> Result<Vec<Pdo>, Error> {
    let mut pdos = Vec::new();
    for index in device.sdo_read_array::<u16, 16>(assignment).await? {
        let entries = device.sdo_read_array::<u32, 32>(index).await?;
        pdos.push(Pdo { index, entries: entries.to_vec(), fixed: false });
    }
    Ok(pdos)
}

/// Writes mapping and assignment of process data objects.
async fn write(device: &Device<'_, '_>, assignment: u16, pdos: &[Pdo]) -> Result<(), Error> {
    device.sdo_write(assignment, 0, 0_u8).await?;
    for pdo in pdos.iter().filter(|pdo| !pdo.fixed) {
        device.sdo_write_array(pdo.index, &pdo.entries).await?;
    }
    let indices: Vec<u16> = pdos.iter().map(|pdo| pdo.index).collect();
    device.sdo_write_array(assignment, indices).await
}

/// Objects of entries with subindex 0, and their number of bits.
fn mapped(pdos: &[Pdo]) -> impl Iterator<Item = (u16, u8)> {
    let entries = pdos.iter().flat_map(|pdo| &pdo.entries);
    entries.filter(|entry| **entry >> 8 & 0xFF == 0).map(|entry| ((entry >> 16) as u16, *entry as u8))
}

/// The required objects that are not mapped, as text.
fn missing(pdos: &[Pdo], required: &[u16]) -> Option<String> {
    let missing = required.iter().filter(|object| mapped(pdos).all(|(other, _)| other != **object));
    let missing: Vec<String> = missing.map(|object| format!("0x{object:04X}")).collect();
    (!missing.is_empty()).then(|| missing.join(", "))
}

/// The indices of process data objects, as text.
fn list(pdos: &[Pdo]) -> String {
    let indices: Vec<String> = pdos.iter().map(|pdo| format!("0x{:04X}", pdo.index)).collect();
    if indices.is_empty() { "none".into() } else { indices.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_missing_objects_are_named_and_gaps_are_skipped() {
        let pdo = |entries: &[u32]| vec![Pdo { index: 0x1A02, entries: entries.to_vec(), fixed: false }];
        let own = pdo(&[0x6041_0010, 0x0000_0008, 0x6064_0020, 0x606C_0120]);
        assert_eq!(missing(&own, &INPUTS).as_deref(), Some("0x606C, 0x6077"));
        assert_eq!(missing(&pdo(&[0x6071_0010, 0x60FF_0020, 0x6040_0010]), &OUTPUTS), None);
        assert_eq!((list(&own), list(&[])), ("0x1A02".into(), "none".into()));
    }
}
