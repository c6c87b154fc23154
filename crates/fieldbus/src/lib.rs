//! An emulated EtherCAT segment: servo drives after CiA 402 and analogue terminals in front of a machine, on a network
//! interface. Any main device can scan it, bring it to OP and run cyclic torque, velocity or position set-points.
//!
//! It is a test tool in software, without claim of conformance; its vendor ID is not assigned. The machine enters by
//! the trait [`Machine`]: torques in, angles, velocities and torques out. This crate knows nothing of friction.
//!
//! With the feature `main-device`, [`MAIN_DEVICE`] opens two physical or emulated drives as the machine of a bench.
//!
//! - [`Segment`]: passes frames through the devices at given instants, so that tests need neither network nor clock;
//! - [`Server`]: a segment on a raw socket, in real time.
//!
//! Emulated are: registers with station address, DL and AL status, watchdog, EEPROM with SII, FMMUs, sync managers;
//! distributed clocks with drift, propagation delay and SYNC0; mailbox with SDO (expedited, normal, segmented, complete
//! access) and SDO information; assignment and mapping of process data; the states of CiA 402 with cyclic torque,
//! velocity and position, torque limits, over-current and following error, touch probe on the index.
//!
//! Object 0x2020 causes faults on request: a drive fault, lost frames, frames that a device ignores (wrong working
//! counter), a stop of SYNC0, a time without supply. Object 0x2010:2 delays set-points by a number of cycles.
#![cfg(target_os = "linux")]

mod coe;
mod device;
mod drive;
mod esc;
mod frame;
mod machine;
#[cfg(feature = "main-device")]
pub mod main_device;
mod scanned;
mod segment;
mod server;
mod socket;
#[cfg(test)]
mod tests;

pub use device::{DRIVE_PRODUCT, TERMINAL_PRODUCT, VENDOR};
pub use drive::{DriveSheet, FIXED_MAPPING};
pub use machine::{Machine, Readings, Rotors, Shaft};
pub use scanned::{MAIN_DEVICE, MainDeviceFunctions, ScannedDevice};
pub use segment::{Counters, Segment};
pub use server::Server;
