//! Recordings as text: a header, optionally a row of units, then one row per sample.

use crate::RecordingError;
use std::borrow::Cow;
use std::path::Path;

use super::{Column, Recording, unreadable};
use stickslip_base::Error;
use stickslip_base::units::measure;

/// Reads a text. The delimiter is the most frequent one in the header: comma, semicolon or tab; `#` starts a comment.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Recording, Error> {
    let text = decode(bytes).ok_or_else(|| {
        unreadable(
            path,
            "it is neither text nor a known kind of table",
            "Export it as CSV, MAT (-v7), Parquet or MDF 4.",
        )
    })?;
    let header = text.lines().find(|l| !l.trim().is_empty() && !l.starts_with('#')).unwrap_or_default();
    let delimiter = [',', ';', '\t'].into_iter().max_by_key(|d| header.matches(*d).count()).unwrap_or(',');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter as u8)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let malformed = |error: csv::Error| malformed(path, &error);
    let header = reader.headers().map_err(malformed)?;
    if !header.is_empty() && header.iter().all(|cell| number(cell).is_some()) {
        return Err(unreadable(path, "its first row has numbers", "Insert a row of names above it: time, position, …"));
    }
    let mut columns: Vec<Column> = header.iter().map(name_and_unit).collect();
    let mut lines = Vec::new();
    let mut row = csv::StringRecord::new();
    let mut first = true;
    while reader.read_record(&mut row).map_err(malformed)? {
        if std::mem::take(&mut first) && is_units(&row) {
            for (column, unit) in columns.iter_mut().zip(&row) {
                column.unit = measure(unit).map(|_| unit.trim_matches(['[', ']', '(', ')']).to_owned());
            }
            continue;
        }
        // The reader is after the row, or after its line end. (A row's own position is before blank lines.)
        let (end, line) = (reader.position().byte() as usize, reader.position().line());
        lines.push(if text.as_bytes()[end - 1] == b'\n' { line - 1 } else { line });
        for (column, cell) in columns.iter_mut().zip(&row) {
            let value = number(cell);
            if value.is_none() && column.fault.is_none() {
                column.fault = Some((lines.len() - 1, cell.to_owned()));
            }
            column.values.push(value.unwrap_or(f64::NAN));
        }
    }
    if lines.is_empty() {
        return Err(RecordingError::EmptyRecording { path: path.to_owned() }.into());
    }
    Ok(Recording { path: path.to_owned(), columns, lines })
}

/// Decodes UTF-8, UTF-16 with a byte-order mark, or Latin-1, which has the µ and ° of Windows; `None` for other bytes.
fn decode(bytes: &[u8]) -> Option<Cow<'_, str>> {
    let wide = |unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
        String::from_utf16(&units).ok().map(Cow::Owned)
    };
    match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ if bytes.contains(&0) => None,
        _ => Some(match std::str::from_utf8(bytes) {
            // A byte-order mark belongs to the file, not to the first name.
            Ok(text) => Cow::Borrowed(text.trim_start_matches('\u{feff}')),
            Err(_) => Cow::Owned(bytes.iter().map(|byte| char::from(*byte)).collect()),
        }),
    }
}

/// A finite number, with a decimal point or, if it has none, one decimal comma.
fn number(cell: &str) -> Option<f64> {
    let parsed = match cell.split_once(',') {
        Some((whole, fraction)) if !cell.contains('.') => format!("{whole}.{fraction}").parse(),
        _ => cell.parse(),
    };
    parsed.ok().filter(|v: &f64| v.is_finite())
}

/// `x [mm]`, or `x (mm)` if the brackets hold a unit.
fn name_and_unit(text: &str) -> Column {
    let square = text.strip_suffix(']').and_then(|t| t.rsplit_once('['));
    let round = text.strip_suffix(')').and_then(|t| t.rsplit_once('(')).filter(|(_, unit)| measure(unit).is_some());
    let (name, unit) = match square.or(round) {
        Some((name, unit)) => (name.trim(), Some(unit.trim().to_owned())),
        None => (text, None),
    };
    Column::new(name, Vec::new()).with_unit(unit)
}

/// Whether a row below the header has units: no number in it, and at least one unit.
fn is_units(row: &csv::StringRecord) -> bool {
    // The unit 1 of a ratio is also a number.
    let unit = |cell: &str| number(cell).is_none() && measure(cell).is_some();
    row.iter().any(unit) && row.iter().all(|cell| number(cell).is_none() || cell == "1")
}

fn malformed(path: &Path, error: &csv::Error) -> Error {
    let line = error.position().map_or(0, csv::Position::line);
    let fault = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("cells in this row: {len}, in the header: {expected_len}")
        }
        _ => error.to_string(),
    };
    RecordingError::BadRow { path: path.to_owned(), line, fault }.into()
}
