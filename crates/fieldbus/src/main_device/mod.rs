//! The main device: the bench drives two servo drives after CiA 402 in cyclic synchronous torque mode, on `ethercrab`.
//!
//! [`open`] scans the segment, configures the drives by their profiles, brings them to OP with distributed clocks, and
//! returns them as the machine of a bench ([`Io`](stickslip_bench::Io)).

mod bring_up;
mod cyclic;
mod drive;
mod error;
mod exchange;
mod image;
mod lost;
mod machine;
mod mapping;
mod power;
mod probe;
mod profile;
mod record;
mod scan;
mod steering;
mod units;
mod wire;

pub use machine::{ServoDrives, open};
pub(crate) use scan::scan;
