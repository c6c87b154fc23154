//! Numbers of a channel: their place in a record, storage and conversion.

use super::Fault;
use super::block::{Block, damaged};
use crate::column::EXACT;

/// How the numbers of a channel are stored.
pub(super) struct Layout {
    source: Source,
    /// Bit of the record that marks an invalid number.
    invalid: Option<usize>,
    conversion: Conversion,
    /// Raw number that is zero of the values.
    origin: u64,
}

enum Source {
    /// The number of the row, counted from 0.
    Row,
    Field(Field),
    /// All values are declared invalid.
    Nothing,
}

/// Bits of a record.
struct Field {
    /// First byte.
    start: usize,
    /// Number of bytes with these bits.
    bytes: usize,
    shift: u32,
    bits: u32,
    big_endian: bool,
    kind: Kind,
}

enum Kind {
    Unsigned,
    Signed,
    Float,
}

enum Conversion {
    None,
    /// P1 + P2·x
    Linear([f64; 2]),
    /// (P1·x² + P2·x + P3) / (P4·x² + P5·x + P6)
    Rational([f64; 6]),
    /// An unknown conversion, as a text.
    Unknown(String),
}

impl Layout {
    /// The numbers of a channel and its conversion, in records of `length` bytes of data; `None` if it has no numbers.
    pub(super) fn of(channel: Block, conversion: Option<Block>, length: usize) -> Result<Option<Self>, Fault> {
        let Some(conversion) = conversion.map_or(Ok(Some(Conversion::None)), Conversion::of)? else { return Ok(None) };
        const ALL_INVALID: u32 = 1;
        const SOME_INVALID: u32 = 2;
        let flags = channel.word(12)?;
        let invalid = (flags & SOME_INVALID != 0).then_some(length * 8 + channel.word(16)? as usize);
        let source = match channel.byte(0)? {
            _ if flags & ALL_INVALID != 0 => Source::Nothing,
            // A virtual master, or another channel that follows from the row.
            3 | 6 => Source::Row,
            // Values, the master, and the synchronisation with another file. Arrays and structures have parts.
            0 | 2 | 4 if channel.link(1) == 0 => {
                let (kind, big_endian) = match channel.byte(2)? {
                    0 => (Kind::Unsigned, false),
                    1 => (Kind::Unsigned, true),
                    2 => (Kind::Signed, false),
                    3 => (Kind::Signed, true),
                    4 => (Kind::Float, false),
                    5 => (Kind::Float, true),
                    _ => return Ok(None),
                };
                let (shift, start, bits) = (u32::from(channel.byte(3)?), channel.word(4)? as usize, channel.word(8)?);
                let size = match kind {
                    Kind::Float => matches!(bits, 32 | 64),
                    _ => (1..=64).contains(&bits),
                };
                if !size || shift > 7 {
                    let fault = format!("unsupported channel with numbers of {bits} bits, from bit {shift} on");
                    return Err(Fault::new(fault, "Export it with numbers of at most 64 bits, floats of 32 or 64."));
                }
                let bytes = (shift + bits).div_ceil(8) as usize;
                if start.checked_add(bytes).is_none_or(|end| end > length) {
                    return Err(damaged(&format!("a channel at byte {start} is outside its record of {length} bytes")));
                }
                Source::Field(Field { start, bytes, shift, bits, big_endian, kind })
            }
            _ => return Ok(None),
        };
        Ok(Some(Layout { source, invalid, conversion, origin: 0 }))
    }

    /// The reason why the values are not available.
    pub(super) fn fault(&self) -> Option<String> {
        match &self.conversion {
            Conversion::Unknown(fault) => Some(fault.clone()),
            _ => None,
        }
    }

    /// Sets the origin from the first record, if it is a whole number beyond the precision of `f64` (stamps in
    /// nanoseconds since 1970): the values are then exact differences from it.
    pub(super) fn set_origin(&mut self, record: &[u8]) {
        let factor_only = matches!(self.conversion, Conversion::None | Conversion::Linear(_));
        if let (Source::Field(field), true) = (&self.source, factor_only) {
            let first = field.word(record);
            if !matches!(field.kind, Kind::Float) && first >= EXACT as u64 && first <= i64::MAX as u64 {
                self.origin = first as f64 as u64;
            }
        }
    }

    /// Zero of the values, converted.
    pub(super) fn origin(&self) -> f64 {
        match (self.origin, &self.conversion) {
            (0, _) => 0.0,
            (origin, Conversion::Linear([offset, factor])) => offset + factor * origin as f64,
            (origin, _) => origin as f64,
        }
    }

    /// The value in the record of a row.
    pub(super) fn value(&self, row: usize, record: &[u8]) -> f64 {
        let invalid = |bit: usize| record.get(bit / 8).is_some_and(|byte| byte >> (bit % 8) & 1 == 1);
        if self.invalid.is_some_and(invalid) {
            return f64::NAN;
        }
        let raw = match &self.source {
            Source::Row => row as f64,
            Source::Field(field) if self.origin > 0 => field.word(record).wrapping_sub(self.origin) as i64 as f64,
            Source::Field(field) => field.number(record),
            Source::Nothing => f64::NAN,
        };
        match &self.conversion {
            Conversion::None => raw,
            Conversion::Linear([_, factor]) if self.origin > 0 => factor * raw,
            Conversion::Linear([offset, factor]) => offset + factor * raw,
            Conversion::Rational([a, b, c, d, e, f]) => ((a * raw + b) * raw + c) / ((d * raw + e) * raw + f),
            Conversion::Unknown(_) => f64::NAN,
        }
    }
}

impl Field {
    /// Its bits, as an unsigned number.
    fn word(&self, record: &[u8]) -> u64 {
        let mut bytes = [0; 16];
        let bytes_of_field = &mut bytes[..self.bytes];
        bytes_of_field.copy_from_slice(&record[self.start..self.start + self.bytes]);
        if self.big_endian {
            bytes_of_field.reverse();
        }
        let unused = 64 - self.bits;
        ((u128::from_le_bytes(bytes) >> self.shift) as u64) << unused >> unused
    }

    fn number(&self, record: &[u8]) -> f64 {
        let unused = 64 - self.bits;
        let word = self.word(record) << unused;
        match self.kind {
            Kind::Unsigned => (word >> unused) as f64,
            Kind::Signed => (word as i64 >> unused) as f64,
            Kind::Float if self.bits == 32 => f32::from_bits((word >> unused) as u32).into(),
            Kind::Float => f64::from_bits(word),
        }
    }
}

impl Conversion {
    /// The conversion of a block; `None` if it converts numbers to texts.
    fn of(block: Block) -> Result<Option<Self>, Fault> {
        let parameter = |index: usize| block.float(24 + 8 * index);
        Ok(Some(match block.byte(0)? {
            0 => Conversion::None,
            1 => Conversion::Linear([parameter(0)?, parameter(1)?]),
            2 => {
                let mut p = [0.0; 6];
                for (index, p) in p.iter_mut().enumerate() {
                    *p = parameter(index)?;
                }
                Conversion::Rational(p)
            }
            kind @ 3..=6 => {
                let name = if kind == 3 { "formula" } else { "table" };
                Conversion::Unknown(format!("a raw number, to be converted by a {name} (export physical values)"))
            }
            _ => return Ok(None),
        }))
    }
}
