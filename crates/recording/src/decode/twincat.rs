//! Exports of TwinCAT Scope View: a block about the project, a block of properties for each channel, then the rows.
//!
//! Each row of properties repeats its key before the channels of a sample time; in the rows of numbers this place has the
//! stamps [ms] of these channels. Slower channels have fewer rows, or repeat the last one. The file may end with `EOF`.

use super::cells::{Body, Head, Sheet};
use super::group::{Group, Table};
use super::numbers::number;
use crate::column::Column;
use crate::{RecordingError, unreadable};
use stickslip_base::Error;

/// Rows of properties before the numbers, at most.
const HEADER: usize = 60;
/// Smaller stamps are not ticks of 100 ns since 1601, which the option "full timestamp" writes.
const FILETIME: f64 = 1e16;

/// Whether a text is such an export.
pub(super) fn recognises(text: &str) -> bool {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty()).take(HEADER);
    let is_key = |line: &str, keys: &[&str]| {
        let key = line.split(['\t', ';', ',']).next().unwrap_or_default().trim_matches('"');
        keys.contains(&key)
    };
    let begins = lines.next().is_some_and(|line| is_key(line, &["Name"]));
    const KEYS: [&str; 5] = ["Starttime of export", "SampleTime[ms]", "SymbolName", "Data-Type", "File"];
    // With the shortest header, numbers follow the names.
    let is_row = |line: &str| line.split(['\t', ';']).next().and_then(number).is_some() || line.starts_with("0,");
    begins && lines.any(|line| is_row(line) || is_key(line, &KEYS))
}

/// Reads channels in groups of equal stamps.
pub(super) fn read(sheet: Sheet) -> Result<Table, Error> {
    let path = sheet.path;
    let head = sheet.first_rows(HEADER)?;
    let incomplete = || {
        let remedy = "Export it again from TwinCAT Scope as CSV with the header, and with a time for each sample time.";
        unreadable(path, "the block of channels with the row `Name` is missing", remedy)
    };
    let begin = head.iter().position(|(_, row)| row.first().is_some_and(|cell| number(cell).is_some()));
    let begin = begin.ok_or_else(|| RecordingError::EmptyRecording { path: path.to_owned() })?;
    // The first row `Name` is of the project, if there are two.
    let names = head[..begin].iter().rposition(|(_, row)| row[0] == "Name").ok_or_else(incomplete)?;
    let block = &head[names..begin];
    let cells = &block[0].1;
    let starts: Vec<usize> = (0..cells.len()).filter(|index| cells[*index] == "Name").collect();
    let property = |key: &str, index: usize| {
        let row = block.iter().find(|(_, row)| row[0] == key)?;
        row.1.get(index).map(String::as_str).filter(|cell| !cell.is_empty())
    };
    let heads: Vec<Head> = (0..cells.len())
        .filter(|index| !cells[*index].is_empty())
        .map(|index| match starts.contains(&index) {
            true => Head { index, name: "time".into(), unit: Some("ms".into()) },
            false => {
                let unit = property("Unit", index).and_then(unit);
                Head { index, name: cells[index].trim_end_matches(':').to_owned(), unit }
            }
        })
        .collect();
    let indices: Vec<usize> = heads.iter().map(|head| head.index).collect();
    let after = block.last().map_or(0, |(line, _)| *line);
    let Body { columns, lines, mut notes } = sheet.body(after, heads, is_end)?;
    let scaled = |key: &str, neutral: f64| {
        let other = |index: &&usize| property(key, **index).and_then(number).is_some_and(|value| value != neutral);
        indices.iter().filter(|index| !starts.contains(index)).find(other).map(|index| cells[*index].clone())
    };
    for (key, neutral) in [("ScaleFactor", 1.0), ("Offset", 0.0)] {
        if let Some(name) = scaled(key, neutral) {
            notes.push(format!(
                "Channel `{name}` states {key} in the scope, a setting of the display: its numbers stay as exported."
            ));
        }
    }
    let groups = by_stamps(columns, &lines, |index| starts.contains(&indices[index]));
    Ok(Table { groups: named(groups), notes })
}

/// Splits columns into groups that begin with their stamps; rows without a stamp, or repeated to fill, are omitted.
pub(super) fn by_stamps(columns: Vec<Column>, lines: &[u64], is_stamps: impl Fn(usize) -> bool) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (index, column) in columns.into_iter().enumerate() {
        if is_stamps(index) || groups.is_empty() {
            groups.push(Group { time: is_stamps(index).then_some(0), lines: lines.to_vec(), ..Group::default() });
        }
        if let Some(group) = groups.last_mut() {
            group.columns.push(column);
        }
    }
    let several = groups.len() > 1;
    groups.into_iter().map(|group| if several { sampled(&group) } else { group }).map(in_milliseconds).collect()
}

/// Rows with a stamp and, if all repeated stamps repeat all values, the first of them.
fn sampled(group: &Group) -> Group {
    let stamps = &group.columns[0].values;
    let kept: Vec<usize> = (0..stamps.len()).filter(|row| stamps[*row].is_finite()).collect();
    let repeats = |a: usize, b: usize| group.columns.iter().all(|c| c.values[a] == c.values[b]);
    let pairs = || kept.windows(2).filter(|w| stamps[w[0]] == stamps[w[1]]);
    let is_filled = pairs().next().is_some() && pairs().all(|w| repeats(w[0], w[1]));
    let first = |place: &usize| *place == 0 || !is_filled || stamps[kept[*place - 1]] != stamps[kept[*place]];
    let kept: Vec<usize> = (0..kept.len()).filter(first).map(|place| kept[place]).collect();
    group.keep(&kept)
}

/// Full stamps, ticks of 100 ns since 1601, as milliseconds.
fn in_milliseconds(mut group: Group) -> Group {
    let Some(time) = group.time.map(|index| &mut group.columns[index]) else { return group };
    if time.origin() + time.values.first().copied().unwrap_or(0.0) >= FILETIME {
        let origin = time.origin() * 1e-4;
        let mut ticks = time.clone();
        ticks.values.iter_mut().for_each(|value| *value *= 1e-4);
        *time = ticks.with_origin(origin);
    }
    group
}

/// Names the groups by their steps, and counts those of equal steps.
pub(super) fn named(mut groups: Vec<Group>) -> Vec<Group> {
    for index in 0..groups.len() {
        let step = groups[index].step().map_or_else(|| "no stamps".into(), super::group::duration);
        let taken = groups[..index].iter().filter(|group| group.name.split(" (").next() == Some(&step)).count();
        groups[index].name = if taken == 0 { step } else { format!("{step} ({})", taken + 1) };
    }
    groups
}

/// `mm (Length)` or `(None)`.
fn unit(cell: &str) -> Option<String> {
    let unit = cell.split('(').next().unwrap_or_default().trim();
    (!unit.is_empty()).then(|| unit.to_owned())
}

fn is_end(cells: &[&str]) -> bool {
    cells.first().is_some_and(|cell| cell.eq_ignore_ascii_case("EOF"))
}
