//! Process data: which objects are mapped, in which order.

use super::object::{Abort, Access, Objects};

/// Most bytes of the outputs or inputs of a device.
pub(crate) const LARGEST: usize = 64;

/// Direction of process data, seen from the main device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Direction {
    Outputs,
    Inputs,
}

impl Direction {
    /// Index of the assignment.
    pub(crate) fn assignment(self) -> u16 {
        if self == Direction::Outputs { 0x1C12 } else { 0x1C13 }
    }

    /// Direction of a process data object or of an assignment, by its index.
    fn of(index: u16) -> Option<Self> {
        match index {
            0x1600..=0x17FF | 0x1C12 => Some(Direction::Outputs),
            0x1A00..=0x1BFF | 0x1C13 => Some(Direction::Inputs),
            _ => None,
        }
    }
}

/// Replaces outputs and inputs of a drive, which cannot be written then.
pub(crate) fn fix(objects: &mut Objects, [outputs, inputs]: [&[u32]; 2]) {
    for (index, entries) in [(0x1600, outputs), (0x1A00, inputs)] {
        objects.set(index, 0, entries.len() as i64);
        for (at, entry) in (1..).zip(entries) {
            objects.set(index, at, i64::from(*entry));
        }
    }
    objects.is_fixed = true;
}

/// Index, subindex and length [bytes] of an entry of a process data object; index 0 is a gap.
fn parts(entry: i64) -> (u16, u8, usize) {
    ((entry >> 16) as u16, (entry >> 8) as u8, (entry & 0xFF) as usize / 8)
}

/// Refuses entries that cannot be mapped, and changes of a list that is in use: its count must be zero.
pub(crate) fn check(objects: &Objects, index: u16, subindex: u8, value: i64) -> Result<(), Abort> {
    let Some(direction) = Direction::of(index) else { return Ok(()) };
    let is_assignment = index == direction.assignment();
    if subindex > 0 {
        return match objects.number(index, 0) {
            0 if is_assignment => {
                let found = objects.object(value as u16).is_ok() && Direction::of(value as u16) == Some(direction);
                if found && value as u16 != index { Ok(()) } else { Err(Abort::Value) }
            }
            0 => check_entry(objects, direction, value),
            _ => Err(Abort::Unsupported),
        };
    }
    if value >= objects.object(index)?.entries.len() as i64 {
        return Err(Abort::Value);
    }
    let listed = (1..=value as u8).map(|at| objects.number(index, at));
    let length: usize = match is_assignment {
        true => listed.map(|object| length_of(objects, object as u16)).sum(),
        false => {
            // Unused entries may be anything until they are counted.
            for entry in listed.clone() {
                check_entry(objects, direction, entry)?;
            }
            listed.map(|entry| parts(entry).2).sum()
        }
    };
    if length <= LARGEST { Ok(()) } else { Err(Abort::TooMuchMapped) }
}

fn check_entry(objects: &Objects, direction: Direction, value: i64) -> Result<(), Abort> {
    let (index, subindex, length) = parts(value);
    if value & 7 != 0 || length == 0 {
        return Err(Abort::NotMappable);
    }
    if index == 0 {
        return Ok(());
    }
    let entry = objects.entry(index, subindex)?;
    let mappable = match direction {
        Direction::Outputs => entry.access == Access::Command,
        Direction::Inputs => matches!(entry.access, Access::Signal | Access::Command),
    };
    if mappable && entry.kind.length() == length { Ok(()) } else { Err(Abort::NotMappable) }
}

/// Length of a process data object [bytes].
fn length_of(objects: &Objects, object: u16) -> usize {
    (1..=objects.number(object, 0) as u8).map(|at| parts(objects.number(object, at)).2).sum()
}

/// The entries of the process data of a device, in order.
#[derive(Debug, Default)]
pub(crate) struct Image {
    entries: Vec<(u16, u8, usize)>,
}

impl Image {
    /// The present mapping.
    pub(crate) fn new(objects: &Objects, direction: Direction) -> Self {
        let list = |index: u16| (1..=objects.number(index, 0) as u8).map(move |at| objects.number(index, at));
        let entries = list(direction.assignment()).flat_map(|object| list(object as u16)).map(parts).collect();
        Image { entries }
    }

    /// Length [bytes].
    pub(crate) fn length(&self) -> usize {
        self.entries.iter().map(|(_, _, length)| length).sum()
    }

    /// Takes outputs from their bytes.
    pub(crate) fn take(&self, objects: &mut Objects, bytes: &[u8]) {
        let mut at = 0;
        for (index, subindex, length) in &self.entries {
            let Some(part) = bytes.get(at..at + length) else { return };
            at += length;
            let number = objects.entry(*index, *subindex).map(|entry| entry.kind.decode(part));
            if let Ok(number) = number {
                objects.set(*index, *subindex, number);
            }
        }
    }

    /// The bytes of the inputs.
    pub(crate) fn give(&self, objects: &Objects) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(LARGEST);
        for (index, subindex, length) in &self.entries {
            let number = objects.number(*index, *subindex).to_le_bytes();
            bytes.extend(number.iter().cycle().take(*length));
        }
        bytes
    }
}

/// The assigned process data objects of a sync manager, for the EEPROM.
pub(crate) fn described(objects: &Objects, manager: u8, direction: Direction) -> Vec<(u8, u16, Vec<u32>)> {
    let list = |index: u16| (1..=objects.number(index, 0) as u8).map(move |at| objects.number(index, at));
    let assigned = list(direction.assignment());
    assigned.map(|object| (manager, object as u16, list(object as u16).map(|entry| entry as u32).collect())).collect()
}
