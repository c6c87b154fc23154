//! Variables of MAT files of level 5, which MATLAB writes as -v6 and, compressed, as -v7.
//!
//! A file is a header of 128 bytes and a sequence of elements, each a tag (type, length) and data padded to eight
//! bytes; small data are in the tag itself. A variable is an element of elements: flags, dimensions, name, contents.
//! "MAT-File Format", The MathWorks, chapter 1.

use std::io::Read;

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Largest size of an unpacked variable [bytes].
const LARGEST: u64 = 1 << 31;
/// Deepest structure within structures.
const DEEPEST: usize = 8;

/// Contents of a variable.
#[derive(Debug)]
pub(super) enum Value {
    /// Real numbers, column by column.
    Numbers {
        size: Vec<usize>,
        values: Vec<f64>,
    },
    Text(String),
    /// Elements of an array of structures, each with its fields.
    Structures(Vec<Vec<(String, Value)>>),
    Cells(Vec<Value>),
    /// An object of a class, as a timeseries or a table.
    Object,
    /// Sparse or complex numbers, functions.
    Other,
}

impl Value {
    /// The numbers, if there are any.
    pub(super) fn numbers(&self) -> Option<&[f64]> {
        match self {
            Value::Numbers { values, .. } => Some(values),
            _ => None,
        }
    }

    /// The text, if it is one.
    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Value::Text(text) => Some(text.trim()).filter(|text| !text.is_empty()),
            _ => None,
        }
    }

    /// The elements of an array of structures, also of a cell array of them.
    pub(super) fn structures(&self) -> Vec<Structure<'_>> {
        match self {
            Value::Structures(elements) => elements.iter().map(|fields| Structure(fields)).collect(),
            Value::Cells(cells) => cells.iter().flat_map(Value::structures).collect(),
            _ => Vec::new(),
        }
    }
}

/// One structure.
#[derive(Clone, Copy)]
pub(super) struct Structure<'a>(pub(super) &'a [(String, Value)]);

impl<'a> Structure<'a> {
    /// A field by its name.
    pub(super) fn field(&self, name: &str) -> Option<&'a Value> {
        self.0.iter().find(|(field, _)| field == name).map(|(_, value)| value)
    }
}

/// The variables of a file with their names; `None` if it is damaged.
pub(super) fn variables(bytes: &[u8]) -> Option<Vec<(String, Value)>> {
    let swapped = match bytes.get(126..128)? {
        b"IM" => false,
        b"MI" => true,
        _ => return None,
    };
    let mut variables = Vec::new();
    let mut file = Elements { bytes: &bytes[128..], swapped };
    while !file.bytes.is_empty() {
        let (kind, data) = file.next()?;
        if kind == MATRIX {
            variables.push(variable(data, swapped, 0)?);
        } else if kind == COMPRESSED {
            let mut inner = Vec::new();
            flate2::read::ZlibDecoder::new(data).take(LARGEST).read_to_end(&mut inner).ok()?;
            let (kind, data) = Elements { bytes: &inner, swapped }.next()?;
            if kind == MATRIX {
                variables.push(variable(data, swapped, 0)?);
            }
        }
    }
    Some(variables)
}

/// Name and contents of a variable.
fn variable(data: &[u8], swapped: bool, depth: usize) -> Option<(String, Value)> {
    // An empty element is an empty array.
    if data.is_empty() {
        return Some((String::new(), Value::Numbers { size: vec![0, 0], values: Vec::new() }));
    }
    let mut parts = Elements { bytes: data, swapped };
    let (_, flags) = parts.next()?;
    let flags = integer(flags.get(..4)?, swapped);
    let (class, complex) = (flags as u8, flags & 0x800 != 0);
    if class == 17 {
        // An opaque object: its first element is its name.
        let (_, name) = Elements { bytes: data, swapped }.skip_first()?;
        return Some((String::from_utf8_lossy(name).into_owned(), Value::Object));
    }
    let (_, size) = parts.next()?;
    let size: Vec<usize> = size.chunks_exact(4).map(|d| integer(d, swapped) as usize).collect();
    let count = size.iter().try_fold(1usize, |product, length| product.checked_mul(*length))?;
    let (_, name) = parts.next()?;
    let name = String::from_utf8_lossy(name).into_owned();
    let value = match class {
        1 => Value::Cells(elements(&mut parts, count, depth)?),
        2 => structures(&mut parts, count, depth)?,
        3 => Value::Object,
        4 => {
            let (kind, text) = parts.next()?;
            Value::Text(text_of(kind, text, swapped))
        }
        6..=15 if !complex => {
            let (kind, numbers) = if count == 0 { (9, &[][..]) } else { parts.next()? };
            let values = numbers_of(kind, numbers, swapped)?;
            if values.len() != count {
                return None;
            }
            Value::Numbers { size, values }
        }
        _ => Value::Other,
    };
    Some((name, value))
}

/// Elements of a cell array or fields of structures.
fn elements(parts: &mut Elements, count: usize, depth: usize) -> Option<Vec<Value>> {
    if depth >= DEEPEST || count > parts.bytes.len() {
        return None;
    }
    let element = |_| {
        let (kind, data) = parts.next()?;
        if kind == MATRIX { Some(variable(data, parts.swapped, depth + 1)?.1) } else { Some(Value::Other) }
    };
    (0..count).map(element).collect()
}

/// An array of structures: length of the names, names, then all fields of each element.
fn structures(parts: &mut Elements, count: usize, depth: usize) -> Option<Value> {
    let (_, length) = parts.next()?;
    let length = integer(length.get(..4)?, parts.swapped) as usize;
    let (_, names) = parts.next()?;
    let name = |chunk: &[u8]| String::from_utf8_lossy(chunk.split(|b| *b == 0).next().unwrap_or_default()).into_owned();
    let names: Vec<String> = if length == 0 { Vec::new() } else { names.chunks_exact(length).map(name).collect() };
    if names.is_empty() {
        return Some(Value::Structures(Vec::new()));
    }
    let mut fields = elements(parts, count.checked_mul(names.len())?, depth)?.into_iter();
    let element = |_| names.iter().cloned().zip(fields.by_ref().take(names.len())).collect();
    Some(Value::Structures((0..count).map(element).collect()))
}

/// A text in any stored type.
fn text_of(kind: u32, data: &[u8], swapped: bool) -> String {
    match kind {
        // Letters as whole numbers of 16 bits, or UTF-16.
        4 | 17 => {
            let unit = |pair: &[u8]| {
                if swapped { u16::from_be_bytes([pair[0], pair[1]]) } else { u16::from_le_bytes([pair[0], pair[1]]) }
            };
            String::from_utf16_lossy(&data.chunks_exact(2).map(unit).collect::<Vec<_>>())
        }
        _ => String::from_utf8_lossy(data).into_owned(),
    }
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

    /// The second element.
    fn skip_first(mut self) -> Option<(u32, &'a [u8])> {
        self.next()?;
        self.next()
    }
}
