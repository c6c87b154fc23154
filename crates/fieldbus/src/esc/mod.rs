//! The EtherCAT slave controller: memory, sync managers, clocks, EEPROM and states of one device.

pub(crate) mod clock;
pub(crate) mod eeprom;
pub(crate) mod fmmu;
pub(crate) mod memory;
pub(crate) mod state;
