//! Formats of files: each one file here, from its bytes to groups of columns, which become one [`Recording`].
//!
//! | file | read as | units |
//! |-|-|-|
//! | text | comma, semicolon or tab; decimal point or comma, thousands separators; `#` comments; rows of units and types below the header; columns with empty cells that have stamps of their own; UTF-8, UTF-16 or Latin-1 | `x [mm]`, `x (mm)` or a row below the header |
//! | text of TwinCAT Scope | header block, then columns; a time column for each channel or sample time | row `Unit` |
//! | text of dSPACE ControlDesk | rows of properties, then `trace_values` | row `unit` |
//! | text of the Simulink Data Inspector | repeated columns `time`, rows of properties below the header | `Unit:` |
//! | text of LinuxCNC halscope | `Sampling period is N ns`, then pairs of name and value; or a table without time | none |
//! | MAT, level 5 | vectors, matrices by column, structures with time (Simulink), `X` and `Y` (ControlDesk), To-File matrices | of ControlDesk |
//! | Parquet | flat columns of numbers and time stamps, not compressed or with Snappy | metadata `unit.NAME`, or JSON under `units` |
//! | MDF 4 | numbers of all groups, by their masters; see [`mdf`] | of channel or conversion |
//!
//! Any of them may be gzipped. A file with several groups (rasters) becomes one table on the stamps of the fastest
//! group that holds what is [`Wanted`]; [`Recording::notes`] lists what was read, resampled and omitted.

mod cells;
mod controldesk;
mod exact;
mod group;
mod halscope;
mod header;
mod inspector;
mod join;
mod mat;
mod mat_value;
mod mdf4;
mod numbers;
mod parquet;
mod sparse;
mod stamps;
mod text;
mod twincat;

use std::io::Read;
use std::path::Path;

use super::{Recording, RecordingError, unreadable};
use crate::mdf;
use stickslip_base::{Error, input};

/// Fault of a cell that is not a finite number.
pub(crate) const NOT_A_NUMBER: &str = "not a finite number. Export the column as numbers with a decimal point; if \
     values are missing, cut the recording before or after them. Removing single rows would shift the later samples in time.";

/// First bytes of a Parquet file.
const PARQUET: &[u8] = b"PAR1";

/// What a reader needs of a file with several groups.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Name of the only group to be read; default: the fastest one that has the columns.
    pub group: Option<String>,
    /// Names of columns; default: all.
    pub columns: Vec<String>,
}

/// Reads a file; its kind and gzip are recognised by content.
pub(crate) fn read(path: &Path, wanted: &Wanted) -> Result<Recording, Error> {
    let failed = |source| Error::file(path, "read", source);
    let bytes = input::read(path, input::RECORDING)?;
    if bytes.starts_with(PARQUET) && input::is_standard_input(path) {
        return Err(unreadable(path, "Parquet from standard input is not supported", "Save it as a file."));
    }
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return parse(path, &bytes, wanted);
    }
    let mut inner = Vec::new();
    let most = input::RECORDING.bytes();
    let unpacked = flate2::read::MultiGzDecoder::new(bytes.as_slice());
    unpacked.take(most + 1).read_to_end(&mut inner).map_err(failed)?;
    if inner.len() as u64 > most {
        return Err(input::RECORDING.exceeded(path, None));
    }
    if inner.starts_with(PARQUET) {
        return Err(unreadable(
            path,
            "a gzipped Parquet file",
            "Unpack it with gunzip; Parquet is compressed in itself.",
        ));
    }
    parse(path, &inner, wanted)
}

/// Parses the contents of a file.
pub(crate) fn parse(path: &Path, bytes: &[u8], wanted: &Wanted) -> Result<Recording, Error> {
    let mut table = if bytes.starts_with(PARQUET) {
        parquet::read(path)
    } else if bytes.starts_with(b"MATLAB 5.0") {
        mat::read(path, bytes)
    } else if mdf::recognises(bytes) {
        mdf4::read(path, bytes)
    } else {
        refuse_known(path, bytes).map_or_else(|| text::read(path, bytes), Err)
    }?;
    table.groups.iter_mut().for_each(|group| header::name_row_numbers(&mut group.columns, &mut table.notes));
    if let [group] = &mut table.groups[..]
        && group.time.is_none()
    {
        *group = sparse::joined(std::mem::take(group), &mut table.notes);
    }
    group::combine(path, table, wanted)
}

/// The error of a known format that is not read.
fn refuse_known(path: &Path, bytes: &[u8]) -> Option<Error> {
    let text = |begin: &str| bytes.starts_with(begin.as_bytes());
    let (fault, remedy) = if text("MATLAB 7.3") || text("\u{89}HDF") || bytes.starts_with(b"\x89HDF") {
        let remedy = "In MATLAB: load('NAME.mat'), then save('NAME.mat', '-v7'), in parts if a variable exceeds 2 GB. \
                      In other programs: export as CSV or Parquet.";
        ("unsupported HDF5 file, as MATLAB writes with -v7.3", remedy)
    } else if text("# Created by Octave") {
        ("unsupported text file of Octave", "In Octave: load the file, then save -v7 NAME.mat.")
    } else if is_level_4(bytes) {
        ("unsupported MAT file of level 4", "In MATLAB: load('NAME.mat'), then save('NAME.mat', '-v7').")
    } else if text("PK\x03\x04") {
        let remedy = "Export the sheet as CSV, or unpack the file and read the recording in it.";
        ("unsupported archive or spreadsheet (xlsx, ods, zip)", remedy)
    } else if text("TDSm") {
        ("unsupported TDMS file", "Export it as CSV, or with npTDMS in Python to Parquet.")
    } else {
        return None;
    };
    Some(unreadable(path, fault, remedy))
}

/// Whether a file begins with the head of a variable as MATLAB's -v4 writes it: type, rows, columns, flag of imaginary
/// numbers, length of the name, name.
fn is_level_4(bytes: &[u8]) -> bool {
    let Some((head, rest)) = bytes.split_at_checked(20) else { return false };
    let word = |index: usize| u32::from_le_bytes(std::array::from_fn(|byte| head[4 * index + byte]));
    let length = word(4) as usize;
    let name = rest.get(..length.saturating_sub(1)).unwrap_or_default();
    word(0) <= 52
        && word(0) % 10 <= 2
        && word(3) <= 1
        && (2..64).contains(&length)
        && name.iter().all(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
        && rest.get(length - 1) == Some(&0)
}

/// The error of a row.
fn bad_row(path: &Path, line: u64, fault: impl Into<String>) -> Error {
    RecordingError::BadRow { path: path.to_owned(), line, fault: fault.into() }.into()
}

#[cfg(test)]
mod tests;
