//! Recordings as MAT files of level 5, which MATLAB writes as -v6 and, compressed, as -v7.
//!
//! A file is a header of 128 bytes and a sequence of elements, each a tag (type, length) and data padded to eight
//! bytes; small data are in the tag itself. A variable is an element of elements: flags, dimensions, name, numbers.
//! "MAT-File Format", The MathWorks, chapter 1.

use std::io::Read;
use std::path::Path;

use super::{Column, Recording, unreadable};
use stickslip_base::Error;

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of full numeric arrays: double, single, and the integers.
const NUMERIC: std::ops::RangeInclusive<u8> = 6..=15;
/// Largest size of an unpacked variable [bytes].
const LARGEST: u64 = 1 << 31;

/// Reads vectors, and columns of matrices as `NAME_1`, `NAME_2`, …; only those of the most frequent length.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Recording, Error> {
    let damaged = || unreadable(path, "damaged MAT file", "Save it again with save(…, '-v7').");
    let swapped = match bytes.get(126..128) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => return Err(damaged()),
    };
    let mut columns: Vec<Column> = Vec::new();
    let mut file = Elements { bytes: &bytes[128..], swapped };
    while !file.bytes.is_empty() {
        let (kind, data) = file.next().ok_or_else(damaged)?;
        match kind {
            MATRIX => columns.extend(variable(data, swapped).ok_or_else(damaged)?),
            COMPRESSED => {
                let mut inner = Vec::new();
                let decoder = flate2::read::ZlibDecoder::new(data).take(LARGEST);
                { decoder }.read_to_end(&mut inner).map_err(|_| damaged())?;
                let (kind, data) = Elements { bytes: &inner, swapped }.next().ok_or_else(damaged)?;
                if kind == MATRIX {
                    columns.extend(variable(data, swapped).ok_or_else(damaged)?);
                }
            }
            _ => {}
        }
    }
    let alike = |length: usize| columns.iter().filter(|c| c.values.len() == length).count();
    let lengths = columns.iter().map(|c| c.values.len());
    let length = lengths.max_by_key(|length| (alike(*length), *length)).unwrap_or(0);
    columns.retain(|c| c.values.len() == length);
    Recording::from_table(path, columns)
}

/// The columns of a numeric variable with more than one value; empty for any other. `None` if it is damaged.
fn variable(data: &[u8], swapped: bool) -> Option<Vec<Column>> {
    let mut parts = Elements { bytes: data, swapped };
    let (_, flags) = parts.next()?;
    let flags = integer(flags.get(..4)?, swapped);
    let (class, complex) = (flags as u8, flags & 0x800 != 0);
    let (_, dimensions) = parts.next()?;
    let dimensions: Vec<usize> = dimensions.chunks_exact(4).map(|d| integer(d, swapped) as usize).collect();
    let (_, name) = parts.next()?;
    let name = String::from_utf8_lossy(name).into_owned();
    let [rows, width] = dimensions[..] else { return Some(Vec::new()) };
    if !NUMERIC.contains(&class) || complex || rows.checked_mul(width)? < 2 {
        return Some(Vec::new());
    }
    let (kind, numbers) = parts.next()?;
    let values = numbers_of(kind, numbers, swapped)?;
    if values.len() != rows * width {
        return None;
    }
    if rows == 1 || width == 1 {
        return Some(vec![Column::new(&name, values)]);
    }
    let column = |(i, values): (usize, &[f64])| Column::new(&format!("{name}_{}", i + 1), values.to_vec());
    Some(values.chunks(rows).enumerate().map(column).collect())
}

/// Numbers of any stored type; MATLAB stores whole numbers in the smallest suitable type.
fn numbers_of(kind: u32, data: &[u8], swapped: bool) -> Option<Vec<f64>> {
    fn all<const N: usize>(data: &[u8], swapped: bool, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let ordered = |chunk: &[u8]| {
            let mut bytes: [u8; N] = std::array::from_fn(|i| chunk[i]);
            if swapped {
                bytes.reverse();
            }
            number(bytes)
        };
        data.chunks_exact(N).map(ordered).collect()
    }
    Some(match kind {
        1 => all(data, swapped, |[b]: [u8; 1]| f64::from(b as i8)),
        2 => all(data, swapped, |[b]: [u8; 1]| f64::from(b)),
        3 => all(data, swapped, |b| f64::from(i16::from_le_bytes(b))),
        4 => all(data, swapped, |b| f64::from(u16::from_le_bytes(b))),
        5 => all(data, swapped, |b| f64::from(i32::from_le_bytes(b))),
        6 => all(data, swapped, |b| f64::from(u32::from_le_bytes(b))),
        7 => all(data, swapped, |b| f64::from(f32::from_le_bytes(b))),
        9 => all(data, swapped, f64::from_le_bytes),
        12 => all(data, swapped, |b| i64::from_le_bytes(b) as f64),
        13 => all(data, swapped, |b| u64::from_le_bytes(b) as f64),
        _ => return None,
    })
}

fn integer(bytes: &[u8], swapped: bool) -> u32 {
    let bytes = std::array::from_fn(|i| bytes[i]);
    if swapped { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
}

/// The remaining elements.
struct Elements<'a> {
    bytes: &'a [u8],
    swapped: bool,
}

impl<'a> Elements<'a> {
    /// Type and data of the next element; `None` if the bytes end too early.
    fn next(&mut self) -> Option<(u32, &'a [u8])> {
        let tag = integer(self.bytes.get(..4)?, self.swapped);
        // A small element keeps its length in the upper half of the type.
        let (kind, start, length, padded): (u32, usize, usize, usize) = match (tag >> 16) as usize {
            0 => {
                let length = integer(self.bytes.get(4..8)?, self.swapped) as usize;
                // Compressed data are not padded.
                let padded = if tag == COMPRESSED { length } else { length.checked_next_multiple_of(8)? };
                (tag, 8, length, 8usize.checked_add(padded)?)
            }
            length => (tag & 0xffff, 4, length, 8),
        };
        let data = self.bytes.get(start..start.checked_add(length)?)?;
        self.bytes = self.bytes.get(padded..).unwrap_or_default();
        Some((kind, data))
    }
}
