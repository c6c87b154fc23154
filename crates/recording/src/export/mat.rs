//! MAT files of level 5, compressed, as MATLAB writes them with -v7: one column per signal, the units in a struct
//! `units`.
//!
//! [`super::super::mat`] reads them and describes the format.

use std::io::{self, Write as _};

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::{Out, Sink};
use crate::mdf::Channel;

/// Longest name in MATLAB.
const LONGEST: usize = 63;
/// Largest variable [bytes]: its length has 32 bits.
const LARGEST: usize = i32::MAX as usize;

const INT8: u32 = 1;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const UTF16: u32 = 17;
const CLASS_STRUCT: u32 = 2;
const CLASS_CHAR: u32 = 4;
const CLASS_DOUBLE: u32 = 6;

/// The collected columns.
pub(super) struct Mat<'a> {
    out: Out<'a>,
    names: Vec<String>,
    units: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl<'a> Mat<'a> {
    pub(super) fn new(out: Out<'a>, columns: &[&Channel]) -> Self {
        let mut names: Vec<String> = Vec::new();
        for channel in columns {
            let name = legal(&channel.name);
            // Shortened names may be equal.
            let mut candidate = name.clone();
            let mut number = 1;
            while candidate == "units" || names.contains(&candidate) {
                number += 1;
                let end = format!("_{number}");
                candidate = name.chars().take(LONGEST - end.len()).collect::<String>() + &end;
            }
            names.push(candidate);
        }
        let units = columns.iter().map(|channel| channel.unit.clone()).collect();
        Mat { out, names, units, columns: vec![Vec::new(); columns.len()] }
    }
}

impl Sink for Mat<'_> {
    fn row(&mut self, row: &[f64]) -> io::Result<()> {
        if 8 * (self.columns[0].len() + 1) > LARGEST {
            return Err(io::Error::other("a variable of a MAT file holds at most 2 GB: export fewer rows, or Parquet"));
        }
        self.columns.iter_mut().zip(row).for_each(|(column, value)| column.push(*value));
        Ok(())
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        let mut text = format!("MATLAB 5.0 MAT-file, written by stickslip {}", env!("CARGO_PKG_VERSION"));
        text.extend(std::iter::repeat_n(' ', 116 - text.len()));
        self.out.write_all(text.as_bytes())?;
        self.out.write_all(&[0; 8])?;
        self.out.write_all(&[0, 1, b'I', b'M'])?;
        for (name, values) in self.names.iter().zip(&self.columns) {
            let mut numbers = Vec::with_capacity(8 * values.len());
            numbers.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            let shape = [values.len() as u32, 1];
            compressed(self.out, &matrix(CLASS_DOUBLE, shape, name, &[(DOUBLE, &numbers)]))?;
        }
        let units = self.units();
        compressed(self.out, &units)
    }
}

impl Mat<'_> {
    /// The struct of the units, one field per signal.
    fn units(&self) -> Vec<u8> {
        const FIELD: usize = LONGEST + 1;
        let mut names = vec![0; FIELD * self.names.len()];
        for (place, name) in names.chunks_exact_mut(FIELD).zip(&self.names) {
            place[..name.len()].copy_from_slice(name.as_bytes());
        }
        let mut body = matrix(CLASS_STRUCT, [1, 1], "units", &[(INT32, &(FIELD as u32).to_le_bytes()), (INT8, &names)]);
        for unit in &self.units {
            let letters: Vec<u8> = unit.encode_utf16().flat_map(u16::to_le_bytes).collect();
            let shape = [u32::from(!letters.is_empty()), letters.len() as u32 / 2];
            element(&mut body, MATRIX, &matrix(CLASS_CHAR, shape, "", &[(UTF16, &letters)]));
        }
        body
    }
}

/// A variable without its tag.
fn matrix(class: u32, shape: [u32; 2], name: &str, parts: &[(u32, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    element(&mut body, UINT32, &[class.to_le_bytes(), [0; 4]].concat());
    element(&mut body, INT32, &shape.map(u32::to_le_bytes).concat());
    element(&mut body, INT8, name.as_bytes());
    parts.iter().for_each(|(kind, data)| element(&mut body, *kind, data));
    body
}

/// Tag, data, and zeros up to eight bytes.
fn element(into: &mut Vec<u8>, kind: u32, data: &[u8]) {
    into.extend(kind.to_le_bytes());
    into.extend((data.len() as u32).to_le_bytes());
    into.extend(data);
    into.resize(into.len().next_multiple_of(8), 0);
}

fn compressed(out: Out, body: &[u8]) -> io::Result<()> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    let mut tagged = Vec::with_capacity(body.len() + 8);
    element(&mut tagged, MATRIX, body);
    encoder.write_all(&tagged)?;
    let zipped = encoder.finish()?;
    out.write_all(&COMPRESSED.to_le_bytes())?;
    out.write_all(&(zipped.len() as u32).to_le_bytes())?;
    out.write_all(&zipped)
}

/// A valid name in MATLAB: letters, digits and underscores, a letter first.
fn legal(name: &str) -> String {
    let letters = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' });
    let letters: String = letters.take(LONGEST).collect();
    if letters.starts_with(|c: char| c.is_ascii_alphabetic()) {
        letters
    } else {
        format!("x{letters}").chars().take(LONGEST).collect()
    }
}
