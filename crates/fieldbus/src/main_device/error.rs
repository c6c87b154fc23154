//! Errors until the drives are in operation.

use std::path::PathBuf;

/// Cause and remedy, before the bench runs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum MainDeviceError {
    /// The interface cannot be opened.
    #[error("{interface}: {reason}. {remedy}")]
    Interface { interface: String, reason: String, remedy: &'static str },
    /// The file of the drives.
    #[error("{}: {reason}.", path.display())]
    File { path: PathBuf, reason: String },
    /// A step of the start failed.
    #[error("{step}: {reason}. {remedy}")]
    Step { step: String, reason: String, remedy: &'static str },
    /// A device is missing.
    #[error("no device at position {position}; {found} devices answer. Check cables and supply, or set the position.")]
    Missing { position: u8, found: usize },
    /// An object of the profile is not in its process data.
    #[error(
        "the process data of the drive at position {position} has no object 0x{object:04X}. Add it to the profile."
    )]
    NotMapped { position: u8, object: u16 },
    /// The drive refuses the mapping, and its own is not sufficient.
    #[error(
        "the drive at position {position} refuses the mapping of the profile ({reason}), and its own process data \
         ({own}) lack {objects}. Assign other process data objects in the profile (fixed = true), or by the software of \
         the drive."
    )]
    FixedMapping { position: u8, reason: String, own: String, objects: String },
    /// An entry of the mapping is not on whole bytes.
    #[error("entry 0x{entry:08X} of the process data is not on whole bytes, up to 4. Correct the mapping.")]
    Entry { entry: u32 },
    /// The process data of the device has another length.
    #[error(
        "the process data of the device at position {position} has {found} bytes, the profile {due}. Correct the mapping \
         in the profile."
    )]
    Length { position: u8, found: usize, due: usize },
    /// A unit is neither in the drive nor in the profile.
    #[error("the drive at position {position} has no object 0x{object:04X}. Set {key} in the profile.")]
    Unit { position: u8, object: u16, key: &'static str },
    /// The resolution differs from the preset.
    #[error(
        "the encoder of the drive at position {position} has {found} counts per revolution in a counter of 2^32, the \
         preset {own} in {range}. Use --set model.encoder.counts_per_revolution={found} \
         --set model.encoder.counter_range=4294967296, for [plant] too if it is used."
    )]
    Resolution { position: u8, found: f64, own: f64, range: f64 },
    /// The drive gives less torque than the preset requests.
    #[error(
        "the largest torque of the drive at position {position} is {found:.3} N m, that of the preset {own:.3} N m. \
         Reduce {parameter}, or increase 0x6072 of the drive."
    )]
    Torque { position: u8, found: f64, own: f64, parameter: &'static str },
    /// The mode is not supported.
    #[error(
        "the drive at position {position} has no cyclic synchronous torque mode (0x6502 = 0x{modes:08X}, bit 9). Use \
         another drive, or enable the mode."
    )]
    Mode { position: u8, modes: u32 },
    /// No clock.
    #[error("the drive at position {position} has no distributed clock. Use a drive with SYNC0.")]
    NoClock { position: u8 },
    /// OP was not reached.
    #[error(
        "the device at position {position} does not reach OP: AL status code 0x{status:04X}. See the table of status \
         codes in the guide, Emulated EtherCAT drives, or the manual of the device."
    )]
    NotOperational { position: u8, status: u16 },
}
