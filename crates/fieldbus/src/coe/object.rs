//! Object dictionary: a table of objects, and the values of a device.

use super::{dictionary, pdo};
use crate::esc::state::State;

/// Data type of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    I8,
    I16,
    I32,
    U8,
    U16,
    U32,
    /// Text up to [`LONGEST_TEXT`].
    Text,
}

/// Longest text that an entry accepts [bytes].
pub(crate) const LONGEST_TEXT: usize = 512;

impl Kind {
    /// Code of the data type.
    pub(crate) fn code(self) -> u16 {
        match self {
            Kind::I8 => 2,
            Kind::I16 => 3,
            Kind::I32 => 4,
            Kind::U8 => 5,
            Kind::U16 => 6,
            Kind::U32 => 7,
            Kind::Text => 9,
        }
    }

    /// Length [bytes]; 0 for text.
    pub(crate) fn length(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 => 4,
            Kind::Text => 0,
        }
    }

    fn is_signed(self) -> bool {
        matches!(self, Kind::I8 | Kind::I16 | Kind::I32)
    }

    /// The number in little-endian bytes.
    pub(crate) fn decode(self, bytes: &[u8]) -> i64 {
        let number = bytes.iter().rev().fold(0, |number: i64, byte| number << 8 | i64::from(*byte));
        let unused = 64 - 8 * bytes.len().clamp(1, 8) as u32;
        if self.is_signed() { number << unused >> unused } else { number }
    }

    /// The nearest number of this type.
    pub(crate) fn saturate(self, number: i64) -> i64 {
        let bits = 8 * self.length().max(1) as u32;
        let (low, high) =
            if self.is_signed() { (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) } else { (0, (1 << bits) - 1) };
        number.clamp(low, high)
    }
}

/// What a main device may do with an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// Read.
    Constant,
    /// Read; an input of the process data.
    Signal,
    /// Read and write.
    Setting,
    /// Read and write; an output of the process data.
    Command,
    /// Read, and write in PRE-OP.
    Setup,
}

impl Access {
    /// Bits of the access in an entry description.
    pub(crate) fn code(self) -> u16 {
        match self {
            Access::Constant => 0x0007,
            Access::Signal => 0x0087,
            Access::Setting => 0x003F,
            Access::Command => 0x007F,
            Access::Setup => 0x000F,
        }
    }
}

/// An entry of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) kind: Kind,
    pub(crate) access: Access,
    pub(crate) initial: i64,
    pub(crate) name: &'static str,
}

pub(crate) const fn entry(kind: Kind, access: Access, initial: i64, name: &'static str) -> Entry {
    Entry { kind, access, initial, name }
}

/// Shape of an object, with its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Variable = 7,
    Array = 8,
    Record = 9,
}

/// An object: entry 0 of an array or a record is the number of its other entries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Object {
    pub(crate) index: u16,
    pub(crate) shape: Shape,
    pub(crate) name: &'static str,
    pub(crate) entries: &'static [Entry],
}

/// Reason why an access is refused, as an SDO abort code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Abort {
    Toggle = 0x0503_0000,
    Command = 0x0504_0001,
    Unsupported = 0x0601_0000,
    ReadOnly = 0x0601_0002,
    NoObject = 0x0602_0000,
    NotMappable = 0x0604_0041,
    TooMuchMapped = 0x0604_0042,
    Length = 0x0607_0010,
    TooLong = 0x0607_0012,
    NoSubindex = 0x0609_0011,
    Value = 0x0609_0030,
    State = 0x0800_0022,
}

/// Value of an entry.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Value {
    Number(i64),
    Text(Vec<u8>),
}

/// The dictionary of a device with its values.
#[derive(Debug)]
pub(crate) struct Objects {
    /// Whether mapping and assignment of process data cannot be written.
    pub(crate) is_fixed: bool,
    table: Vec<(Object, Vec<Value>)>,
}

impl Objects {
    /// A dictionary with the initial values of its tables.
    pub(crate) fn new(tables: &[&[Object]]) -> Self {
        let initial = |entry: &Entry| match entry.kind {
            Kind::Text => Value::Text(Vec::new()),
            _ => Value::Number(entry.initial),
        };
        let values = |object: &Object| (*object, object.entries.iter().map(initial).collect());
        let mut table: Vec<_> = tables.iter().copied().flatten().map(values).collect();
        table.sort_by_key(|(object, _)| object.index);
        Objects { is_fixed: false, table }
    }

    /// The objects in the order of their indices.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Object> {
        self.table.iter().map(|(object, _)| object)
    }

    fn place(&self, index: u16) -> Result<usize, Abort> {
        self.table.binary_search_by_key(&index, |(object, _)| object.index).map_err(|_| Abort::NoObject)
    }

    pub(crate) fn object(&self, index: u16) -> Result<&Object, Abort> {
        Ok(&self.table[self.place(index)?].0)
    }

    pub(crate) fn entry(&self, index: u16, subindex: u8) -> Result<&Entry, Abort> {
        self.object(index)?.entries.get(usize::from(subindex)).ok_or(Abort::NoSubindex)
    }

    fn value(&self, index: u16, subindex: u8) -> Option<&Value> {
        self.table[self.place(index).ok()?].1.get(usize::from(subindex))
    }

    fn value_mut(&mut self, index: u16, subindex: u8) -> Option<&mut Value> {
        let place = self.place(index).ok()?;
        self.table[place].1.get_mut(usize::from(subindex))
    }

    /// A number; 0 for text and for what does not exist.
    pub(crate) fn number(&self, index: u16, subindex: u8) -> i64 {
        match self.value(index, subindex) {
            Some(Value::Number(number)) => *number,
            _ => 0,
        }
    }

    /// Sets a number from the side of the device, limited to its type.
    pub(crate) fn set(&mut self, index: u16, subindex: u8, number: i64) {
        let Ok(kind) = self.entry(index, subindex).map(|entry| entry.kind) else { return };
        if let Some(value) = self.value_mut(index, subindex) {
            *value = Value::Number(kind.saturate(number));
        }
    }

    /// Sets a text from the side of the device.
    pub(crate) fn set_text(&mut self, index: u16, text: &str) {
        if let Some(value) = self.value_mut(index, 0) {
            *value = Value::Text(text.into());
        }
    }

    /// The bytes of an entry.
    pub(crate) fn read(&self, index: u16, subindex: u8) -> Result<Vec<u8>, Abort> {
        let entry = self.entry(index, subindex)?;
        Ok(match self.value(index, subindex) {
            Some(Value::Text(text)) => text.clone(),
            _ => self.number(index, subindex).to_le_bytes()[..entry.kind.length()].to_vec(),
        })
    }

    /// Writes an entry from the side of the main device.
    pub(crate) fn write(&mut self, index: u16, subindex: u8, bytes: &[u8], state: State) -> Result<(), Abort> {
        let entry = *self.entry(index, subindex)?;
        match entry.access {
            Access::Constant | Access::Signal => return Err(Abort::ReadOnly),
            Access::Setup if self.is_fixed => return Err(Abort::ReadOnly),
            Access::Setup if state != State::PreOperational => return Err(Abort::State),
            _ => {}
        }
        let value = if entry.kind == Kind::Text {
            if bytes.len() > LONGEST_TEXT {
                return Err(Abort::TooLong);
            }
            Value::Text(bytes.into())
        } else {
            if bytes.len() != entry.kind.length() {
                return Err(Abort::Length);
            }
            let number = entry.kind.decode(bytes);
            dictionary::check(index, subindex, number)?;
            pdo::check(self, index, subindex, number)?;
            Value::Number(number)
        };
        if let Some(place) = self.value_mut(index, subindex) {
            *place = value;
        }
        Ok(())
    }
}
