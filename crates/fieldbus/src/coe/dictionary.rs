//! The objects of the emulated devices, as tables.

use super::object::Access::{Command, Constant, Setting, Setup, Signal};
use super::object::Kind::{I8, I16, I32, Text, U8, U16, U32};
use super::object::{Abort, Entry, Object, Shape, entry};

const fn variable(index: u16, name: &'static str, entries: &'static [Entry; 1]) -> Object {
    Object { index, shape: Shape::Variable, name, entries }
}

const fn record(index: u16, name: &'static str, entries: &'static [Entry]) -> Object {
    Object { index, shape: Shape::Record, name, entries }
}

const fn array(index: u16, name: &'static str, entries: &'static [Entry]) -> Object {
    Object { index, shape: Shape::Array, name, entries }
}

const fn count(number: i64) -> Entry {
    entry(U8, Constant, number, "Number of entries")
}

/// A process data object with room for eight entries.
macro_rules! mapping {
    ($index:expr, $name:expr, $count:expr, $($entry:expr),+) => {
        record($index, $name, &[entry(U8, Setup, $count, "Number of entries"), $(entry(U32, Setup, $entry, "Entry")),+])
    };
}

/// Assignment of process data objects to a sync manager.
macro_rules! assignment {
    ($index:expr, $name:expr, $count:expr, $first:expr) => {
        array(
            $index,
            $name,
            &[
                entry(U8, Setup, $count, "Number of objects"),
                entry(U16, Setup, $first, "Object"),
                entry(U16, Setup, 0, "Object"),
                entry(U16, Setup, 0, "Object"),
            ],
        )
    };
}

/// Times and modes of a sync manager with process data.
macro_rules! synchronisation {
    ($index:expr, $name:expr) => {
        record(
            $index,
            $name,
            &[
                count(5),
                entry(U16, Setting, 1, "Synchronisation type"),
                entry(U32, Setting, 0, "Cycle time [ns]"),
                entry(U32, Constant, 0, "Shift time [ns]"),
                entry(U16, Constant, 0x0007, "Supported synchronisation types"),
                entry(U32, Constant, 62_500, "Minimum cycle time [ns]"),
            ],
        )
    };
}

/// Text of [`NOTICE`].
pub(crate) const NOTICE_TEXT: &str = "stickslip: emulated device for tests, in software, without claim of conformance. \
    Its vendor ID is not assigned by the EtherCAT Technology Group. The machine behind it is a simulation.";
/// Description of the device.
pub(crate) const NOTICE: u16 = 0x2000;
/// Faults on request.
pub(crate) const INJECTION: u16 = 0x2020;

/// Objects of all devices.
pub(crate) const COMMON: &[Object] = &[
    variable(0x1000, "Device type", &[entry(U32, Constant, 0, "Device type")]),
    variable(0x1001, "Error register", &[entry(U8, Signal, 0, "Error register")]),
    variable(0x1008, "Device name", &[entry(Text, Constant, 0, "Device name")]),
    variable(0x1009, "Hardware version", &[entry(Text, Constant, 0, "Hardware version")]),
    variable(0x100A, "Software version", &[entry(Text, Constant, 0, "Software version")]),
    record(
        0x1018,
        "Identity",
        &[
            count(4),
            entry(U32, Constant, 0, "Vendor ID"),
            entry(U32, Constant, 0, "Product code"),
            entry(U32, Constant, 0, "Revision"),
            entry(U32, Constant, 0, "Serial number"),
        ],
    ),
    record(
        0x10F1,
        "Error settings",
        &[
            count(2),
            entry(U32, Constant, 1, "Local error reaction"),
            entry(U16, Setting, 32, "Limit of the count of missed set-points"),
        ],
    ),
    array(
        0x1C00,
        "Sync manager types",
        &[
            count(4),
            entry(U8, Constant, 1, "Sync manager 0"),
            entry(U8, Constant, 2, "Sync manager 1"),
            entry(U8, Constant, 3, "Sync manager 2"),
            entry(U8, Constant, 4, "Sync manager 3"),
        ],
    ),
    variable(NOTICE, "Notice", &[entry(Text, Constant, 0, "Notice")]),
    variable(0x2001, "Note of the user", &[entry(Text, Setting, 0, "Note of the user")]),
    record(
        INJECTION,
        "Faults on request",
        &[
            count(5),
            entry(U16, Setting, 0, "Drive fault: error code"),
            entry(U16, Setting, 0, "Frames with process data to lose"),
            entry(U16, Setting, 0, "Frames with process data to ignore"),
            entry(U8, Setting, 0, "1: SYNC0 stops"),
            entry(U16, Setting, 0, "Time without supply [ms]"),
        ],
    ),
    synchronisation!(0x1C33, "Synchronisation of inputs"),
    assignment!(0x1C13, "Assigned inputs", 1, 0x1A00),
];

/// Objects of a drive besides [`COMMON`].
pub(crate) const DRIVE: &[Object] = &[
    mapping!(0x1600, "Torque outputs", 4, 0x6040_0010, 0x6071_0010, 0x6060_0008, 8, 0, 0, 0, 0),
    mapping!(0x1601, "Position and velocity outputs", 3, 0x607A_0020, 0x60FF_0020, 0x60B2_0010, 0, 0, 0, 0, 0),
    mapping!(0x1602, "Touch probe outputs", 1, 0x60B8_0010, 0, 0, 0, 0, 0, 0, 0),
    mapping!(
        0x1A00,
        "Axis inputs",
        7,
        0x6041_0010,
        0x6064_0020,
        0x606C_0020,
        0x6077_0010,
        0x603F_0010,
        0x6061_0008,
        8,
        0
    ),
    mapping!(0x1A01, "Touch probe inputs", 3, 0x60B9_0010, 0x60BA_0020, 0x60F4_0020, 0, 0, 0, 0, 0),
    assignment!(0x1C12, "Assigned outputs", 1, 0x1600),
    synchronisation!(0x1C32, "Synchronisation of outputs"),
    record(
        0x2010,
        "Emulation",
        &[
            count(2),
            entry(U16, Setting, 4000, "Trip torque for the over-current fault [0.1 %]"),
            entry(U8, Setting, 0, "Delay of set-points [cycles]"),
        ],
    ),
    variable(0x603F, "Error code", &[entry(U16, Signal, 0, "Error code")]),
    variable(0x6040, "Controlword", &[entry(U16, Command, 0, "Controlword")]),
    variable(0x6041, "Statusword", &[entry(U16, Signal, 0, "Statusword")]),
    variable(0x605A, "Quick stop option", &[entry(I16, Constant, 2, "Quick stop option")]),
    variable(0x6060, "Modes of operation", &[entry(I8, Command, 0, "Modes of operation")]),
    variable(0x6061, "Modes of operation display", &[entry(I8, Signal, 0, "Modes of operation display")]),
    variable(0x6064, "Position actual value", &[entry(I32, Signal, 0, "Position actual value [counts]")]),
    variable(0x6065, "Following error window", &[entry(U32, Setting, 20_000, "Following error window [counts]")]),
    variable(0x6066, "Following error time out", &[entry(U16, Setting, 10, "Following error time out [ms]")]),
    variable(0x606C, "Velocity actual value", &[entry(I32, Signal, 0, "Velocity actual value [counts/s]")]),
    variable(0x6071, "Target torque", &[entry(I16, Command, 0, "Target torque [0.1 %]")]),
    variable(0x6072, "Max torque", &[entry(U16, Command, 3000, "Max torque [0.1 %]")]),
    variable(0x6075, "Motor rated current", &[entry(U32, Constant, 0, "Motor rated current [mA]")]),
    variable(0x6076, "Motor rated torque", &[entry(U32, Constant, 0, "Motor rated torque [mN m]")]),
    variable(0x6077, "Torque actual value", &[entry(I16, Signal, 0, "Torque actual value [0.1 %]")]),
    variable(0x6078, "Current actual value", &[entry(I16, Signal, 0, "Current actual value [0.1 %]")]),
    variable(0x6079, "DC link circuit voltage", &[entry(U32, Signal, 48_000, "DC link circuit voltage [mV]")]),
    variable(0x607A, "Target position", &[entry(I32, Command, 0, "Target position [counts]")]),
    record(
        0x608F,
        "Position encoder resolution",
        &[count(2), entry(U32, Constant, 0, "Encoder increments"), entry(U32, Constant, 1, "Motor revolutions")],
    ),
    record(
        0x6091,
        "Gear ratio",
        &[count(2), entry(U32, Constant, 1, "Motor revolutions"), entry(U32, Constant, 1, "Shaft revolutions")],
    ),
    record(
        0x6092,
        "Feed constant",
        &[count(2), entry(U32, Constant, 0, "Feed [counts]"), entry(U32, Constant, 1, "Shaft revolutions")],
    ),
    variable(0x60B1, "Velocity offset", &[entry(I32, Command, 0, "Velocity offset [counts/s]")]),
    variable(0x60B2, "Torque offset", &[entry(I16, Command, 0, "Torque offset [0.1 %]")]),
    variable(0x60B8, "Touch probe function", &[entry(U16, Command, 0, "Touch probe function")]),
    variable(0x60B9, "Touch probe status", &[entry(U16, Signal, 0, "Touch probe status")]),
    variable(0x60BA, "Touch probe position", &[entry(I32, Signal, 0, "Touch probe position [counts]")]),
    record(
        0x60C2,
        "Interpolation time period",
        &[count(2), entry(U8, Setting, 1, "Value"), entry(I8, Setting, -3, "Index: seconds by ten to its power")],
    ),
    array(0x60D0, "Touch probe source", &[count(1), entry(I16, Setting, 5, "Source: 5 is the index pulse")]),
    variable(0x60E0, "Positive torque limit", &[entry(U16, Command, 3000, "Positive torque limit [0.1 %]")]),
    variable(0x60E1, "Negative torque limit", &[entry(U16, Command, 3000, "Negative torque limit [0.1 %]")]),
    variable(0x60F4, "Following error actual value", &[entry(I32, Signal, 0, "Following error actual value [counts]")]),
    variable(0x60FF, "Target velocity", &[entry(I32, Command, 0, "Target velocity [counts/s]")]),
    variable(0x6502, "Supported drive modes", &[entry(U32, Constant, 0x0380, "Supported drive modes")]),
];

/// Objects of an analogue terminal besides [`COMMON`].
pub(crate) const TERMINAL: &[Object] = &[
    assignment!(0x1C12, "Assigned outputs", 0, 0),
    mapping!(0x1A00, "Analogue input", 1, 0x6000_0110, 0, 0, 0, 0, 0, 0, 0),
    record(0x6000, "Analogue input", &[count(1), entry(I16, Signal, 0, "Voltage: 32767 is the upper limit")]),
];

/// Refuses values outside of the list or range of an object.
pub(crate) fn check(index: u16, subindex: u8, value: i64) -> Result<(), Abort> {
    let valid = match (index, subindex) {
        (0x6060, 0) => [0, 8, 9, 10].contains(&value),
        (0x2010, 2) => (0..=64).contains(&value),
        (0x60D0, 1) => value == 5,
        (0x1C32 | 0x1C33, 1) => (0..=2).contains(&value),
        _ => true,
    };
    if valid { Ok(()) } else { Err(Abort::Value) }
}
