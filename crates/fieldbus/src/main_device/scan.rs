//! List of the devices of a segment, and what is missing for the bench.

use ethercrab::MainDevice;

use super::bring_up::{self, step};
use super::error::MainDeviceError;
use super::machine::{main_device, socket};
use super::units::{Device, object};
use crate::scanned::ScannedDevice;

/// Lists the devices at an interface. They are in PRE-OP then.
///
/// # Errors
/// Cause and remedy, as text: the interface, or no answers.
pub(crate) fn scan(interface: &str) -> Result<Vec<ScannedDevice>, String> {
    let socket = socket(interface).map_err(|error| error.to_string())?;
    main_device(socket, |main, mut wire| wire.run(devices(main))).map_err(|error| error.to_string())
}

async fn devices(main: &MainDevice<'_>) -> Result<Vec<ScannedDevice>, MainDeviceError> {
    let group = bring_up::scan(main).await?;
    let mut devices = Vec::with_capacity(group.len());
    for position in 0..group.len() {
        let device = group.subdevice(main, position).map_err(step("scan", "Scan again."))?;
        devices.push(describe(position, &device).await);
    }
    Ok(devices)
}

async fn describe(position: usize, device: &Device<'_, '_>) -> ScannedDevice {
    let identity = device.identity();
    let state = device.status().await.map_or_else(|error| error.to_string(), |(state, _)| state.to_string());
    let modes = object(device, 0x6502, 0).await;
    let has = async |index: u16| object(device, index, 0).await.is_some_and(|value| value > 0);
    let has_first = async |index: u16| object(device, index, 1).await.is_some_and(|value| value > 0);
    let mut missing = Vec::new();
    if let Some(modes) = modes {
        if modes & 1 << 9 == 0 {
            missing.push("no cyclic synchronous torque mode: use another drive, or enable the mode".into());
        }
        if !device.dc_support().any() {
            missing.push("no distributed clock: use a drive with SYNC0".into());
        }
        if !has(0x6076).await {
            missing.push("no rated torque 0x6076: set torque_unit in the profile".into());
        }
        if !has_first(0x608F).await && !has_first(0x6092).await {
            missing.push("no resolution 0x608F or 0x6092: set units_per_revolution in the profile".into());
        }
        if device.sdo_read::<u16>(0x60B8, 0).await.is_err() {
            missing.push("no touch probe 0x60B8: homing uses whole revolutions of the position".into());
        }
    }
    ScannedDevice {
        position,
        name: device.name().into(),
        vendor: identity.vendor_id,
        product: identity.product_id,
        revision: identity.revision,
        state,
        outputs: assigned(device, 0x1C12).await,
        inputs: assigned(device, 0x1C13).await,
        modes,
        missing,
    }
}

/// Assigned process data objects.
async fn assigned(device: &Device<'_, '_>, assignment: u16) -> Vec<u16> {
    device.sdo_read_array::<u16, 16>(assignment).await.map(|objects| objects.to_vec()).unwrap_or_default()
}
