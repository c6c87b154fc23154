//! Places of objects in the process data of a device.

use super::error::MainDeviceError;
use super::profile::Pdo;

/// Bytes of an object in the process data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    byte: usize,
    length: usize,
}

impl Place {
    /// A signed number of 16 bits.
    pub(crate) fn word(byte: usize) -> Self {
        Place { byte, length: 2 }
    }

    /// The unsigned number at this place; 0 outside of the bytes.
    pub(crate) fn unsigned(self, bytes: &[u8]) -> u32 {
        let part = bytes.get(self.byte..self.byte + self.length).unwrap_or_default();
        part.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
    }

    /// The signed number at this place.
    pub(crate) fn signed(self, bytes: &[u8]) -> i32 {
        let unused = 32 - 8 * self.length as u32;
        ((self.unsigned(bytes) << unused) as i32) >> unused
    }

    /// Writes a number.
    pub(crate) fn write(self, bytes: &mut [u8], number: i32) {
        if let Some(part) = bytes.get_mut(self.byte..self.byte + self.length) {
            part.copy_from_slice(&number.to_le_bytes()[..self.length]);
        }
    }
}

/// The objects in the outputs or inputs of a device.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Entry and first bit.
    places: Vec<(u32, usize)>,
    /// Length of all [bytes].
    pub(crate) length: usize,
}

impl Layout {
    /// The layout of these process data objects.
    pub(crate) fn new(pdos: &[Pdo]) -> Self {
        let (mut places, mut bits) = (Vec::new(), 0);
        for entry in pdos.iter().flat_map(|pdo| &pdo.entries) {
            places.push((*entry, bits));
            bits += (entry & 0xFF) as usize;
        }
        Layout { places, length: bits.div_ceil(8) }
    }

    /// The place of an object with subindex 0, if it is mapped.
    pub(crate) fn find(&self, object: u16) -> Result<Option<Place>, MainDeviceError> {
        let key = u32::from(object) << 8;
        let Some((entry, first)) = self.places.iter().find(|(entry, _)| entry >> 8 == key) else { return Ok(None) };
        let bits = (entry & 0xFF) as usize;
        if !bits.is_multiple_of(8) || !first.is_multiple_of(8) || !(8..=32).contains(&bits) {
            return Err(MainDeviceError::Entry { entry: *entry });
        }
        Ok(Some(Place { byte: first / 8, length: bits / 8 }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_found_behind_each_other_and_gaps_are_skipped() {
        let pdos = [
            Pdo { index: 0x1A00, entries: vec![0x6041_0010, 0x6061_0008, 0x0000_0008], fixed: false },
            Pdo { index: 0x1A01, entries: vec![0x6064_0020], fixed: false },
        ];
        let layout = Layout::new(&pdos);
        let find = |object| layout.find(object).unwrap();
        let bytes = [0x37, 0x12, 10, 0, 0xFE, 0xFF, 0xFF, 0xFF];
        assert_eq!((layout.length, find(0x6077)), (8, None));
        assert_eq!(find(0x6041).unwrap().unsigned(&bytes), 0x1237);
        assert_eq!(find(0x6064).unwrap().signed(&bytes), -2);
        assert_eq!(find(0x6061).unwrap().signed(&bytes), 10);
        let mut out = bytes;
        find(0x6041).unwrap().write(&mut out, -2);
        assert_eq!(out[..2], [0xFE, 0xFF]);
    }

    #[test]
    fn bits_are_skipped_but_a_required_object_must_be_on_whole_bytes() {
        let entries = vec![0x2000_0101, 0x0000_0007, 0x6064_0020, 0x2000_0204, 0x6041_0010, 0x2001_0040];
        let layout = Layout::new(&[Pdo { index: 0x1A00, entries, fixed: true }]);
        assert_eq!(layout.length, 16);
        assert_eq!(layout.find(0x6064).unwrap(), Some(Place { byte: 1, length: 4 }));
        assert_eq!(layout.find(0x6041).unwrap_err(), MainDeviceError::Entry { entry: 0x6041_0010 });
        assert!(layout.find(0x2001).is_err() && layout.find(0x2002).unwrap().is_none());
    }
}
