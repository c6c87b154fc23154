//! Tables with several columns of stamps of the same name, each for the columns to its right.
//!
//! The Simulink Data Inspector writes `time` and, below the names, rows of properties with labels: `Type:`, `Unit:`,
//! `Interp:`, `BlockPath:`, `PortIndex:`. "Simulation Data Inspector Import and Export File Format", MathWorks.

use super::cells::{Body, Head, Sheet, never};
use super::group::Table;
use super::{header, twincat};
use stickslip_base::Error;
use stickslip_base::units::{Dimension, measure};

/// Labels of properties.
const LABELS: [&str; 9] =
    ["Type:", "Unit:", "Units:", "Interp:", "Quant:", "BlockPath:", "PortIndex:", "Enum:", "SampleTime:"];

/// Whether a header has several columns of stamps, or is one of the Data Inspector.
pub(super) fn recognises(header: &[String]) -> bool {
    stamps(header).len() > 1
}

/// Indices of the columns that have the name of the first, without its unit.
fn stamps(header: &[String]) -> Vec<usize> {
    let name = |cell: &String| {
        let (name, unit) = header::names_and_units([cell.as_str()].into_iter()).remove(0);
        let is_time = unit.as_deref().and_then(measure).is_none_or(|(dimension, _)| dimension == Dimension::Time);
        is_time.then(|| name.to_lowercase())
    };
    let Some(first) = header.first().and_then(name).filter(|name| !name.is_empty()) else { return Vec::new() };
    (0..header.len()).filter(|index| name(&header[*index]).as_ref() == Some(&first)).collect()
}

/// Whether a row below the header has labelled properties only.
pub(super) fn is_properties(row: &[String]) -> bool {
    let is_label = |cell: &String| LABELS.iter().any(|label| cell.starts_with(label));
    row.iter().any(is_label) && row.iter().all(|cell| cell.is_empty() || is_label(cell))
}

/// The unit of a labelled cell.
pub(super) fn labelled_unit(cell: &str) -> Option<String> {
    let unit = cell.strip_prefix("Unit:").or_else(|| cell.strip_prefix("Units:"))?.trim();
    (!unit.is_empty()).then(|| unit.to_owned())
}

/// Reads the groups of columns behind each column of stamps.
pub(super) fn read(sheet: Sheet, line: u64, names: &[String], below: &[(u64, Vec<String>)]) -> Result<Table, Error> {
    let mut after = line;
    let heads = header::names_and_units(names.iter().map(String::as_str)).into_iter().enumerate();
    let mut heads: Vec<Head> = heads.map(|(index, (name, unit))| Head { index, name, unit }).collect();
    for (line, row) in below {
        let unit: fn(&str) -> Option<String> = match () {
            () if is_properties(row) => labelled_unit,
            () if header::is_units(row) => header::unit,
            () if header::is_types(row) => |_| None,
            () => break,
        };
        heads.iter_mut().zip(row).for_each(|(head, cell)| head.unit = unit(cell).or(head.unit.take()));
        after = *line;
    }
    let stamps = stamps(names);
    heads.retain(|head| !head.name.is_empty());
    let indices: Vec<usize> = heads.iter().map(|head| head.index).collect();
    let Body { columns, lines, notes } = sheet.body(after, heads, never)?;
    let groups = twincat::by_stamps(columns, &lines, |index| stamps.contains(&indices[index]));
    Ok(Table { groups: twincat::named(groups), notes })
}
