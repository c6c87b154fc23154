//! From the scan to SAFE-OP: checks, start-up list, process data, distributed clocks.

use std::time::Duration;

use ethercrab::error::Error;
use ethercrab::std::ethercat_now;
use ethercrab::subdevice_group::{DcConfiguration, HasDc, NoDc, PreOp, SafeOp};
use ethercrab::{DcSync, DefaultLock, MainDevice, SubDeviceGroup};

use super::drive::{Drive, TORQUE_MODE};
use super::error::MainDeviceError;
use super::mapping::{Mapping, map};
use super::profile::{Profile, StartUp};
use super::units::{Device, Expected, Units};

/// Most devices, and bytes of process data.
pub(crate) const DEVICES: usize = 16;
pub(crate) const IMAGE: usize = 1024;
/// Time from the configuration of SYNC0 to its first pulse.
const START_DELAY: Duration = Duration::from_millis(200);

/// The devices in a state.
pub(crate) type Group<S, DC = HasDc> = SubDeviceGroup<DEVICES, IMAGE, DefaultLock, S, DC>;

/// What to bring up.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) period: Duration,
    pub(crate) profiles: [Profile; 2],
    pub(crate) expected: [Expected; 2],
    /// Position of the analogue input.
    pub(crate) analogue: Option<u8>,
    /// Time of the watchdogs [s].
    pub(crate) watchdog: Option<f64>,
}

/// The error of a step.
pub(crate) fn step(step: impl Into<String>, remedy: &'static str) -> impl FnOnce(Error) -> MainDeviceError {
    let step = step.into();
    move |error| MainDeviceError::Step { step, reason: error.to_string(), remedy }
}

const SCAN: &str = "Check the cable, that the devices have supply, and that no other main device uses the interface.";
pub(crate) const OBJECTS: &str = "Compare the profile with the manual of the drive.";
const STATES: &str = "See the messages of the drive and the AL status code in its manual.";

/// Finds all devices and brings them to PRE-OP.
pub(crate) async fn scan(main: &MainDevice<'_>) -> Result<Group<PreOp, NoDc>, MainDeviceError> {
    main.init_single_group::<DEVICES, IMAGE>(ethercat_now).await.map_err(step("scan", SCAN))
}

/// Brings the devices to SAFE-OP.
pub(crate) async fn prepare(
    main: &MainDevice<'_>,
    plan: &Plan,
) -> Result<(Group<SafeOp>, [Drive; 2]), MainDeviceError> {
    let mut group = scan(main).await?;
    let found = group.len();
    for position in plan.profiles.iter().map(|profile| profile.position).chain(plan.analogue) {
        if usize::from(position) >= found {
            return Err(MainDeviceError::Missing { position, found });
        }
    }
    let mut drives = Vec::with_capacity(2);
    for (profile, expected) in plan.profiles.iter().zip(&plan.expected) {
        let position = profile.position;
        let device = group.subdevice(main, position.into()).map_err(step("scan", SCAN))?;
        if !device.dc_support().any() {
            return Err(MainDeviceError::NoClock { position });
        }
        let units = Units::read(&device, profile, expected.torque_constant).await?;
        units.check(position, expected)?;
        let mapping = configure(&device, profile, plan).await?;
        drives.push(Drive::new(position, &mapping, units)?);
    }
    for (position, mut device) in group.iter_mut(main).enumerate() {
        if plan.profiles.iter().any(|profile| usize::from(profile.position) == position) {
            device.set_dc_sync(DcSync::Sync0);
        }
    }
    let group = group.into_pre_op_pdi(main).await.map_err(step("process data", OBJECTS))?;
    for drive in &drives {
        let device = group.subdevice(main, drive.position.into()).map_err(step("scan", SCAN))?;
        for (found, due) in
            [(device.outputs_raw().len(), drive.output_length), (device.inputs_raw().len(), drive.input_length)]
        {
            if found != due {
                return Err(MainDeviceError::Length { position: drive.position, found, due });
            }
        }
    }
    let dc = DcConfiguration { start_delay: START_DELAY, sync0_period: plan.period, sync0_shift: plan.period / 2 };
    let group = group.configure_dc_sync(main, dc).await.map_err(step("SYNC0", STATES))?;
    let group = group.into_safe_op(main).await.map_err(step("SAFE-OP", STATES))?;
    let drives: [Drive; 2] = drives.try_into().expect("one for each of two profiles");
    Ok((group, drives))
}

/// Start-up list, mode, process data and watchdog of a drive.
async fn configure(device: &Device<'_, '_>, profile: &Profile, plan: &Plan) -> Result<Mapping, MainDeviceError> {
    let position = profile.position;
    let failed = |what: String| step(format!("device {position}, {what}"), OBJECTS);
    for entry in &profile.start {
        let StartUp { index, subindex, value, bytes } = *entry;
        let written = match bytes {
            1 => device.sdo_write(index, subindex, value as u8).await,
            2 => device.sdo_write(index, subindex, value as u16).await,
            _ => device.sdo_write(index, subindex, value as u32).await,
        };
        written.map_err(failed(format!("start-up list, object 0x{index:04X}:{subindex}")))?;
    }
    device.sdo_write(0x6060, 0, TORQUE_MODE as u8).await.map_err(failed("mode of operation 0x6060".into()))?;
    // Where the drive has them: period of the set-points, source of the touch probe, synchronisation by SYNC0.
    let period = plan.period.as_micros();
    for (exponent, unit) in [(-3_i8, 1000), (-4, 100), (-5, 10), (-6, 1)] {
        if let (0, Ok(units)) = (period % unit, u8::try_from(period / unit)) {
            let _ = device.sdo_write(0x60C2, 1, units).await;
            let _ = device.sdo_write(0x60C2, 2, exponent).await;
            break;
        }
    }
    let _ = device.sdo_write(0x60D0, 1, 5_u16).await;
    for synchronisation in [0x1C32, 0x1C33] {
        let _ = device.sdo_write(synchronisation, 1, 2_u16).await;
    }
    let mapping = map(device, profile).await?;
    if let Some(time) = plan.watchdog {
        // With the usual divider, in 100 µs.
        let units = (time * 1e4).round() as u16;
        device.register_write(0x0420_u16, units).await.map_err(failed("watchdog".into()))?;
    }
    Ok(mapping)
}
