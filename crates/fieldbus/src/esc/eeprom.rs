//! EEPROM with the device's description (SII), and the registers to read and write it.

use super::memory::{EEPROM_ADDRESS, EEPROM_CONTROL, EEPROM_DATA, EEPROM_OWNER, Memory};

/// Size [bytes].
const SIZE: usize = 2048;
/// Status without errors: 8 bytes per read, two address bytes.
const IDLE: u16 = 0x00C0;
const BUSY: u16 = 0x8000;
const REFUSED: u16 = 0x2000;

/// Identity of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Identity {
    pub(crate) vendor: u32,
    pub(crate) product: u32,
    pub(crate) revision: u32,
    pub(crate) serial: u32,
}

/// Sync manager of a description: start, length, control, type.
pub(crate) type Managed = (u16, u16, u8, u8);

/// Process data object of a description: sync manager, index, and its entries as in the object dictionary.
pub(crate) type Described = (u8, u16, Vec<u32>);

/// The content of an EEPROM.
#[derive(Debug)]
pub(crate) struct Eeprom {
    bytes: Vec<u8>,
}

impl Eeprom {
    pub(crate) fn new(
        identity: &Identity,
        name: &str,
        managers: &[Managed],
        inputs: &[Described],
        outputs: &[Described],
    ) -> Self {
        let mut bytes = vec![0; 0x80];
        let mut word = |address: usize, value: u16| bytes[2 * address..][..2].copy_from_slice(&value.to_le_bytes());
        word(0, 0x0E05);
        let numbers = [identity.vendor, identity.product, identity.revision, identity.serial];
        for (at, number) in numbers.into_iter().enumerate() {
            word(0x08 + 2 * at, number as u16);
            word(0x09 + 2 * at, (number >> 16) as u16);
        }
        for (at, manager) in managers.iter().take(2).enumerate() {
            word(0x18 + 2 * at, manager.0);
            word(0x19 + 2 * at, manager.1);
        }
        // CANopen over EtherCAT; size in kibibits less one; version.
        word(0x1C, 0x0004);
        word(0x3E, (SIZE / 128 - 1) as u16);
        word(0x3F, 1);
        let sum = checksum(&bytes[..14]);
        bytes[14] = sum;

        let mut category = |kind: u16, mut content: Vec<u8>| {
            content.resize(content.len().next_multiple_of(2), 0);
            bytes.extend(kind.to_le_bytes());
            bytes.extend(((content.len() / 2) as u16).to_le_bytes());
            bytes.extend(content);
        };
        let group = "emulated devices";
        let strings = [name, group].map(|text| [&[text.len() as u8], text.as_bytes()].concat()).concat();
        category(10, [vec![2], strings].concat());
        let mut general = vec![0; 32];
        // Group, order and name; object dictionary with information, assignment, mapping and complete access.
        (general[0], general[2], general[3], general[5]) = (2, 1, 1, 0x2F);
        (general[14], general[16]) = (2, 0x11);
        category(30, general);
        category(40, vec![1, 2, 3, 0]);
        let manager = |it: &Managed| {
            let [a, b] = it.0.to_le_bytes();
            let [c, d] = it.1.to_le_bytes();
            [a, b, c, d, it.2, 0, 1, it.3]
        };
        category(41, managers.iter().flat_map(manager).collect());
        category(50, inputs.iter().flat_map(described).collect());
        category(51, outputs.iter().flat_map(described).collect());
        bytes.extend([0xFF; 4]);
        bytes.resize(SIZE, 0xFF);
        Eeprom { bytes }
    }

    /// Executes a command after a write to its register. The status is busy until it is read once.
    pub(crate) fn execute(&mut self, memory: &mut Memory) {
        let command = memory.word(EEPROM_CONTROL);
        let address = 2 * memory.number::<4>(EEPROM_ADDRESS) as usize;
        let mut status = IDLE;
        match command >> 8 & 7 {
            0 => {}
            _ if memory.byte(EEPROM_OWNER) & 1 != 0 => status |= REFUSED,
            1 => {
                let word: Vec<u8> =
                    (address..address + 8).map(|at| self.bytes.get(at).map_or(0xFF, |it| *it)).collect();
                memory.set(EEPROM_DATA, &word);
                status |= BUSY;
            }
            2 if command & 1 != 0 => {
                let word = memory.word(EEPROM_DATA).to_le_bytes();
                match self.bytes.get_mut(address..address + 2) {
                    Some(place) => place.copy_from_slice(&word),
                    None => status |= REFUSED,
                }
                status |= BUSY;
            }
            _ => status |= REFUSED,
        }
        memory.set(EEPROM_CONTROL, &status.to_le_bytes());
    }

    /// The status was read.
    pub(crate) fn seen(memory: &mut Memory) {
        let status = memory.word(EEPROM_CONTROL) & !BUSY;
        memory.set(EEPROM_CONTROL, &status.to_le_bytes());
    }
}

/// A process data object as in the EEPROM.
fn described((manager, index, entries): &Described) -> Vec<u8> {
    let [low, high] = index.to_le_bytes();
    let mut bytes = vec![low, high, entries.len() as u8, *manager, 0, 0, 0, 0];
    for entry in entries {
        let [bits, subindex, low, high] = entry.to_le_bytes();
        bytes.extend([low, high, subindex, 0, 0, bits, 0, 0]);
    }
    bytes
}

/// Checksum of the first words.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0xFF, |sum, byte| {
        (0..8).fold(sum ^ byte, |sum: u8, _| if sum & 0x80 != 0 { sum << 1 ^ 7 } else { sum << 1 })
    })
}
