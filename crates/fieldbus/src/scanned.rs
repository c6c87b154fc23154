//! The main device as seen by a program: its functions, and a device found by a scan.

/// A device of a segment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScannedDevice {
    /// Position in the segment, from 0.
    pub position: usize,
    /// Name in its EEPROM.
    pub name: String,
    /// Vendor ID.
    pub vendor: u32,
    /// Product code.
    pub product: u32,
    /// Revision.
    pub revision: u32,
    /// AL state.
    pub state: String,
    /// Assigned process data objects of the outputs.
    pub outputs: Vec<u16>,
    /// Assigned process data objects of the inputs.
    pub inputs: Vec<u16>,
    /// Supported modes (0x6502), of a drive.
    pub modes: Option<u32>,
    /// What a bench lacks, each with its remedy; empty for other devices.
    pub missing: Vec<String>,
}

/// Functions of the main device, where the program has one.
#[derive(Clone, Copy, Debug)]
pub struct MainDeviceFunctions {
    /// Opens two servo drives as the machine of a bench.
    pub open: stickslip_bench::OpenFieldbus,
    /// Lists the devices at an interface; the error has cause and remedy.
    pub scan: fn(&str) -> Result<Vec<ScannedDevice>, String>,
}

/// The main device, if this program was built with the feature `main-device`.
#[cfg(feature = "main-device")]
pub const MAIN_DEVICE: Option<MainDeviceFunctions> =
    Some(MainDeviceFunctions { open: crate::main_device::open, scan: crate::main_device::scan });
/// The main device, if this program was built with the feature `main-device`.
#[cfg(not(feature = "main-device"))]
pub const MAIN_DEVICE: Option<MainDeviceFunctions> = None;
