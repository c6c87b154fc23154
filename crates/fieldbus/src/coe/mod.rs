//! CANopen over EtherCAT: mailbox, object dictionary and process data of a device.

pub(crate) mod dictionary;
pub(crate) mod information;
pub(crate) mod mailbox;
pub(crate) mod object;
pub(crate) mod pdo;
pub(crate) mod sdo;
