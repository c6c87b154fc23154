//! CSV exports of dSPACE ControlDesk: rows of properties, each with its key in the first cell; the numbers begin in the
//! row `trace_values`, and the first cells of the following rows are empty.

use std::path::Path;

use super::cells::{Body, Head, Sheet, never};
use super::group::{Group, Table};
use super::header;
use crate::unreadable;
use stickslip_base::Error;

/// Rows of properties before the numbers, at most.
const HEADER: usize = 200;
/// Key of the first row of numbers.
const MARK: &str = "trace_values";

/// Whether a text is such an export.
pub(super) fn recognises(text: &str) -> bool {
    let key = |line: &str| line.split([',', ';', '\t']).next().unwrap_or_default().trim_matches('"').to_lowercase();
    text.lines().take(HEADER).any(|line| key(line) == MARK)
}

/// Reads all signals over the first one, the time.
pub(super) fn read(sheet: Sheet) -> Result<Table, Error> {
    let head = sheet.first_rows(HEADER)?;
    let key = |row: &[String]| row.first().map(|cell| cell.to_lowercase()).unwrap_or_default();
    let begin = head.iter().position(|(_, row)| key(row) == MARK).unwrap_or(head.len() - 1);
    let property =
        |keys: &[&str]| head[..begin].iter().find(|(_, row)| keys.contains(&key(row).as_str())).map(|(_, row)| row);
    let names = property(&["path", "trace_names", "name", "names", "variable"]).ok_or_else(|| no_names(sheet.path))?;
    let units = property(&["unit", "units"]);
    let width = head[begin].1.len();
    let column = |index: usize| {
        let cell = |row: &[String]| row.get(index).map(|cell| cell.replace('"', "")).filter(|cell| !cell.is_empty());
        // Below the key, the column of the time has no path.
        let name =
            cell(names).unwrap_or_else(|| if index == 1 { "time".into() } else { format!("signal {}", index - 1) });
        let (name, unit) = header::names_and_units([name.as_str()].into_iter()).remove(0);
        let unit = units.and_then(|row| cell(row)).filter(|unit| unit != "-").or(unit);
        Head { index, name, unit: unit.or_else(|| (index == 1).then(|| "s".to_owned())) }
    };
    let after = begin.checked_sub(1).map_or(0, |row| head[row].0);
    let Body { columns, lines, notes } = sheet.body(after, (1..width).map(column).collect(), never)?;
    Ok(Table { groups: vec![Group { name: String::new(), time: Some(0), columns, lines }], notes })
}

fn no_names(path: &Path) -> Error {
    let remedy = "Export the measurement again from ControlDesk as CSV with all properties, or as MAT.";
    unreadable(path, "the row `path` with the names of the signals is missing", remedy)
}
