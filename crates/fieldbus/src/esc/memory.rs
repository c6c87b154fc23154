//! Memory of an EtherCAT device: registers up to 0x0FFF, process data and mailboxes above.

/// Size of the memory [bytes].
const SIZE: usize = 0x2000;
/// First address behind the registers.
pub(crate) const DATA: u16 = 0x1000;

/// Right of the main device to a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Right {
    Read,
    Write,
}
use Right::{Read, Write};

/// A register.
struct Register {
    address: u16,
    length: u16,
    right: Right,
    initial: u32,
}

const fn register(address: u16, length: u16, right: Right, initial: u32) -> Register {
    Register { address, length, right, initial }
}

pub(crate) const STATION: u16 = 0x0010;
pub(crate) const ALIAS: u16 = 0x0012;
pub(crate) const DL_CONTROL: u16 = 0x0100;
pub(crate) const DL_STATUS: u16 = 0x0110;
pub(crate) const AL_CONTROL: u16 = 0x0120;
pub(crate) const AL_STATUS: u16 = 0x0130;
pub(crate) const AL_STATUS_CODE: u16 = 0x0134;
pub(crate) const WATCHDOG_DIVIDER: u16 = 0x0400;
pub(crate) const WATCHDOG_TIME: u16 = 0x0420;
pub(crate) const WATCHDOG_STATUS: u16 = 0x0440;
pub(crate) const WATCHDOG_COUNT: u16 = 0x0442;
pub(crate) const EEPROM_OWNER: u16 = 0x0500;
pub(crate) const EEPROM_CONTROL: u16 = 0x0502;
pub(crate) const EEPROM_ADDRESS: u16 = 0x0504;
pub(crate) const EEPROM_DATA: u16 = 0x0508;
pub(crate) const FMMU: u16 = 0x0600;
pub(crate) const SYNC_MANAGER: u16 = 0x0800;
pub(crate) const PORT_TIMES: u16 = 0x0900;
pub(crate) const SYSTEM_TIME: u16 = 0x0910;
pub(crate) const RECEIVE_TIME: u16 = 0x0918;
pub(crate) const TIME_OFFSET: u16 = 0x0920;
pub(crate) const TIME_DELAY: u16 = 0x0928;
pub(crate) const TIME_DIFFERENCE: u16 = 0x092C;
pub(crate) const SPEED_COUNTER: u16 = 0x0930;
pub(crate) const SYNC_ACTIVATION: u16 = 0x0981;
pub(crate) const SYNC_START: u16 = 0x0990;
pub(crate) const SYNC_CYCLE: u16 = 0x09A0;

/// Registers with their values after power-on. All other addresses read as zero and ignore writes.
const REGISTERS: [Register; 35] = [
    // Type, revision, build; FMMUs, sync managers; memory in KiB, ports (0 and 1 present); 64-bit distributed clock.
    register(0x0000, 4, Read, 0x0001_0011),
    register(0x0004, 2, Read, 0x0404),
    register(0x0006, 2, Read, 0x0F04),
    register(0x0008, 2, Read, 0x000C),
    register(STATION, 2, Write, 0),
    register(ALIAS, 2, Write, 0),
    register(DL_CONTROL, 4, Write, 0x0007_C001),
    register(DL_STATUS, 2, Read, 0),
    register(AL_CONTROL, 2, Write, 1),
    register(AL_STATUS, 2, Read, 1),
    register(AL_STATUS_CODE, 2, Read, 0),
    register(0x0140, 2, Read, 0x0E05),
    register(0x0200, 2, Write, 0),
    register(0x0204, 4, Write, 0),
    register(0x0300, 20, Write, 0),
    register(WATCHDOG_DIVIDER, 2, Write, 0x09C2),
    register(0x0410, 2, Write, 0x03E8),
    register(WATCHDOG_TIME, 2, Write, 0x03E8),
    register(WATCHDOG_STATUS, 2, Read, 0),
    register(WATCHDOG_COUNT, 2, Write, 0),
    register(EEPROM_OWNER, 2, Write, 0),
    register(EEPROM_CONTROL, 2, Write, 0x00C0),
    register(EEPROM_ADDRESS, 4, Write, 0),
    register(EEPROM_DATA, 8, Write, 0),
    register(FMMU, 64, Write, 0),
    register(SYNC_MANAGER, 32, Write, 0),
    register(PORT_TIMES, 4, Write, 0),
    register(SYSTEM_TIME, 8, Write, 0),
    register(TIME_OFFSET, 12, Write, 0),
    register(SPEED_COUNTER, 2, Write, 0x1000),
    register(0x0934, 2, Write, 0x0C00),
    register(0x0980, 1, Write, 0),
    register(SYNC_ACTIVATION, 1, Write, 0),
    register(SYNC_START, 8, Write, 0),
    register(SYNC_CYCLE, 8, Write, 0),
];

/// Bytes with the rights of the main device.
#[derive(Debug)]
pub(crate) struct Memory {
    bytes: Box<[u8; SIZE]>,
}

impl Memory {
    pub(crate) fn new() -> Self {
        let mut memory = Memory { bytes: Box::new([0; SIZE]) };
        for register in &REGISTERS {
            let length = usize::from(register.length).min(4);
            memory.set(register.address, &register.initial.to_le_bytes()[..length]);
        }
        memory
    }

    /// The part of a range that exists.
    fn range(address: u16, length: usize) -> std::ops::Range<usize> {
        let first = usize::from(address).min(SIZE);
        first..(first + length).min(SIZE)
    }

    /// The bytes of a range; shorter at the end of the memory.
    pub(crate) fn get(&self, address: u16, length: usize) -> &[u8] {
        &self.bytes[Self::range(address, length)]
    }

    pub(crate) fn byte(&self, address: u16) -> u8 {
        self.number::<1>(address) as u8
    }

    pub(crate) fn word(&self, address: u16) -> u16 {
        self.number::<2>(address) as u16
    }

    pub(crate) fn number<const N: usize>(&self, address: u16) -> u64 {
        self.get(address, N).iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
    }

    /// Sets bytes from the side of the device.
    pub(crate) fn set(&mut self, address: u16, bytes: &[u8]) {
        let range = Self::range(address, bytes.len());
        let length = range.len();
        self.bytes[range].copy_from_slice(&bytes[..length]);
    }

    /// Sets bytes from the side of the main device: read-only bytes keep their values. Whether any byte was writable.
    pub(crate) fn write(&mut self, address: u16, bytes: &[u8]) -> bool {
        let mut any = false;
        for (at, byte) in (usize::from(address)..SIZE).zip(bytes) {
            if at >= usize::from(DATA) || is_writable(at) {
                (self.bytes[at], any) = (*byte, true);
            }
        }
        any
    }
}

fn is_writable(address: usize) -> bool {
    REGISTERS.iter().any(|register| {
        let first = usize::from(register.address);
        register.right == Write
            && (first..first + usize::from(register.length)).contains(&address)
            // Status and the bits of the device within a sync manager.
            && !(first == usize::from(SYNC_MANAGER) && matches!((address - first) % 8, 5 | 7))
            && address != usize::from(TIME_DIFFERENCE)
    })
}

/// Whether a range of addresses contains any byte of a register.
pub(crate) fn touches(address: u16, length: usize, register: u16, size: usize) -> bool {
    usize::from(address) < usize::from(register) + size && usize::from(register) < usize::from(address) + length
}
