//! The bench as an XCP slave, as masters, tools and hostile neighbours find it; without a socket.

mod abuse;
mod calibration;
mod description;
#[allow(unreachable_pub, reason = "support of tests")]
mod desk;
mod measurement;
#[allow(unreachable_pub, reason = "support of tests")]
mod memory;
