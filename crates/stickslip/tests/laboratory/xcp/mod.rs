//! The bench as an XCP slave, tested with masters, tools and hostile clients; without a socket.

mod abuse;
mod calibration;
mod description;
#[allow(unreachable_pub, reason = "support of tests")]
mod desk;
mod measurement;
#[allow(unreachable_pub, reason = "support of tests")]
mod memory;
