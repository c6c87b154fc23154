//! Recordings as text: a header, optionally rows of units and types, then one row per sample.

use std::borrow::Cow;
use std::path::Path;

use super::cells::{Body, Head, Sheet, never};
use super::group::{Group, Table};
use super::numbers::number;
use super::{bad_row, controldesk, halscope, header, inspector, twincat};
use crate::{RecordingError, unreadable};
use stickslip_base::Error;

/// Reads a text of any tool.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Table, Error> {
    let text = decode(bytes).ok_or_else(|| {
        let remedy = "Export it as CSV, MAT (-v7), Parquet or MDF 4.";
        unreadable(path, "it is neither text nor a known kind of table", remedy)
    })?;
    if halscope::recognises(&text) {
        return halscope::read(path, &text);
    }
    let sheet = |comments| Sheet { path, text: &text, delimiter: delimiter(&text), comments };
    for (recognises, read) in [
        (twincat::recognises as fn(&str) -> bool, twincat::read as fn(Sheet) -> Result<Table, Error>),
        (controldesk::recognises, controldesk::read),
    ] {
        if recognises(&text) {
            return read(sheet(false));
        }
    }
    table(sheet(true))
}

/// The most frequent delimiter of the first line with one: comma, semicolon or tab.
fn delimiter(text: &str) -> char {
    const DELIMITERS: [char; 3] = [',', ';', '\t'];
    let is_header = |line: &&str| !line.starts_with('#') && line.contains(DELIMITERS);
    let header = text.lines().find(is_header).unwrap_or_default();
    DELIMITERS.into_iter().max_by_key(|delimiter| header.matches(*delimiter).count()).unwrap_or(',')
}

/// A header and rows of equal length.
fn table(sheet: Sheet) -> Result<Table, Error> {
    let path = sheet.path;
    let first = sheet.first_rows(8)?;
    let Some((header_line, names)) = first.first() else {
        return Err(RecordingError::EmptyRecording { path: path.to_owned() }.into());
    };
    if names.iter().all(|cell| number(cell).is_some()) {
        let remedy = "Insert a row of names above it: time, position, …";
        return Err(unreadable(path, "its first row has numbers", remedy));
    }
    let width = names.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    if inspector::recognises(names) {
        return inspector::read(sheet, *header_line, names, &first[1..]);
    }
    let mut after = *header_line;
    let heads = header::names_and_units(names.iter().take(width).map(String::as_str));
    let mut heads: Vec<Head> =
        heads.into_iter().enumerate().map(|(index, (name, unit))| Head { index, name, unit }).collect();
    for (line, row) in &first[1..] {
        if header::is_units(row) {
            heads.iter_mut().zip(row).for_each(|(head, cell)| head.unit = header::unit(cell).or(head.unit.take()));
        } else if inspector::is_properties(row) {
            let units = row.iter().map(|cell| inspector::labelled_unit(cell));
            heads.iter_mut().zip(units).for_each(|(head, unit)| head.unit = unit.or(head.unit.take()));
        } else if !header::is_types(row) {
            break;
        }
        after = *line;
    }
    check_widths(&sheet, after, names, *header_line)?;
    let Body { columns, lines, notes } = sheet.body(after, heads, never)?;
    Ok(Table { groups: vec![Group { name: String::new(), time: None, columns, lines }], notes })
}

/// Rows must have as many cells as the header; empty cells at the end do not count.
fn check_widths(sheet: &Sheet, after: u64, header: &[String], header_line: u64) -> Result<(), Error> {
    let expected = header.len();
    let named = header.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    sheet.rows(|line, cells| {
        let used = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
        if line <= after || cells.len() == expected || used == named || used == 0 {
            return Ok(true);
        }
        let (found, header) = (cells.len(), header_line);
        Err(bad_row(sheet.path, line, format!(
            "cells in this row: {found}, in the header: {expected} (line {header}). If lines of text precede the names of \
             the columns, begin the file with the names; otherwise export the recording again."
        )))
    })
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
