//! Groups of a file, and the one table that they become.

use std::collections::BTreeSet;
use std::path::Path;

use super::Wanted;
use super::join::{self, Joined};
use crate::column::Column;
use crate::{Recording, RecordingError};
use stickslip_base::Error;
use stickslip_base::units::{Dimension, measure};

/// Columns that were sampled together.
#[derive(Debug, Default)]
pub(super) struct Group {
    /// Name in the file.
    pub(super) name: String,
    /// Index of the column with the stamps.
    pub(super) time: Option<usize>,
    pub(super) columns: Vec<Column>,
    /// Line of each row, or its number.
    pub(super) lines: Vec<u64>,
}

/// Contents of a file.
#[derive(Debug, Default)]
pub(super) struct Table {
    pub(super) groups: Vec<Group>,
    pub(super) notes: Vec<String>,
}

impl Group {
    /// A group whose rows have numbers instead of lines.
    pub(super) fn new(name: &str, time: Option<usize>, columns: Vec<Column>) -> Self {
        let rows = columns.first().map_or(0, |column| column.values.len()) as u64;
        Group { name: name.to_owned(), time, columns, lines: (1..=rows).collect() }
    }

    /// The rows of these numbers.
    pub(super) fn keep(&self, rows: &[usize]) -> Self {
        let columns = self.columns.iter().map(|column| column.keep(rows)).collect();
        let lines = rows.iter().map(|row| self.lines[*row]).collect();
        Group { name: self.name.clone(), time: self.time, columns, lines }
    }

    /// Its columns except the stamps.
    pub(super) fn signals(&self) -> impl Iterator<Item = &Column> {
        self.columns.iter().enumerate().filter(|(index, _)| Some(*index) != self.time).map(|(_, column)| column)
    }

    fn has(&self, name: &str) -> bool {
        self.columns.iter().any(|column| column.name == name)
    }

    /// Its stamps in seconds from `origin`, and its own origin [s].
    pub(super) fn stamps(&self) -> Option<(f64, Vec<f64>)> {
        let time = &self.columns[self.time?];
        let factor = time.unit.as_deref().and_then(measure).filter(|(d, _)| *d == Dimension::Time).map_or(1.0, |m| m.1);
        Some((time.origin() * factor, time.values.iter().map(|value| value * factor).collect()))
    }

    /// Median step of the stamps [s].
    pub(super) fn step(&self) -> Option<f64> {
        let (_, stamps) = self.stamps()?;
        let mut steps: Vec<f64> = stamps.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
        let middle = steps.len() / 2;
        (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// `"NAME" (3 signals, step 1 ms)`.
    fn description(&self) -> String {
        let signals = self.signals().count();
        let step = self.step().map_or_else(|| "no stamps".into(), |step| format!("step {}", duration(step)));
        format!("\"{}\" ({signals} signal{}, {step})", self.name, if signals == 1 { "" } else { "s" })
    }
}

/// A time with four digits in a readable unit.
pub(super) fn duration(seconds: f64) -> String {
    // A rounded millisecond is not 1000 µs.
    let (value, unit) = match seconds.abs() * (1.0 + 1e-4) {
        s if s >= 1.0 => (seconds, "s"),
        s if s >= 1e-3 => (seconds * 1e3, "ms"),
        s if s >= 1e-6 => (seconds * 1e6, "µs"),
        _ => (seconds * 1e9, "ns"),
    };
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    format!("{rounded} {unit}")
}

/// At most eight names, then the number of the others.
pub(super) fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    let shown = names.iter().take(8).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    if names.len() > 8 { format!("{shown} and {} more", names.len() - 8) } else { shown }
}

/// One recording from the groups of a file.
pub(super) fn combine(path: &Path, table: Table, wanted: &Wanted) -> Result<Recording, Error> {
    let Table { groups, mut notes } = table;
    let (groups, empty): (Vec<Group>, Vec<Group>) =
        groups.into_iter().partition(|group| !group.lines.is_empty() && !group.columns.is_empty());
    if let Some(name) = &wanted.group {
        return requested(path, groups, name, notes);
    }
    if !groups.is_empty() && !empty.is_empty() {
        let names = list(empty.iter().map(|group| group.name.as_str()));
        notes.push(format!("Groups without rows were not read: {names}."));
    }
    let Some(base) = base(&groups, wanted) else {
        return Err(RecordingError::EmptyRecording { path: path.to_owned() }.into());
    };
    let group = if groups.len() == 1 {
        groups.into_iter().next().unwrap_or_default()
    } else {
        join_all(groups, base, wanted, &mut notes)
    };
    Ok(Recording { path: path.to_owned(), columns: group.columns, lines: group.lines, notes })
}

/// The only group of a name.
fn requested(path: &Path, groups: Vec<Group>, name: &str, mut notes: Vec<String>) -> Result<Recording, Error> {
    let named = |group: &Group| if group.name.is_empty() { "(one without a name)".into() } else { group.name.clone() };
    let names: Vec<String> = groups.iter().map(named).collect();
    let Some(group) = groups.into_iter().find(|group| group.name == name) else {
        return Err(RecordingError::MissingGroup { path: path.to_owned(), name: name.into(), groups: names }.into());
    };
    let others: Vec<&str> = names.iter().map(String::as_str).filter(|other| *other != name).collect();
    if !others.is_empty() {
        notes.push(format!(
            "Group {} of the file was read, as requested. Not read: {}.",
            group.description(),
            list(others)
        ));
    }
    Ok(Recording { path: path.to_owned(), columns: group.columns, lines: group.lines, notes })
}

/// Index of the group whose stamps are the grid: the fastest one with all wanted columns, or else the fastest raster
/// with two signals, so that a single fast channel (a microphone) does not set the grid of an axis.
fn base(groups: &[Group], wanted: &Wanted) -> Option<usize> {
    let step = |index: &usize| groups[*index].step().unwrap_or(f64::INFINITY);
    let fastest = |among: &[usize]| {
        // Of equal steps the group with most signals, then the first in the file.
        let rank = |a: &&usize, b: &&usize| {
            let same = (step(a) / step(b) - 1.0).abs() < SAME_STEP;
            let size = || groups[**b].columns.len().cmp(&groups[**a].columns.len());
            if same || step(a) == step(b) { size() } else { step(a).total_cmp(&step(b)) }
        };
        among.iter().min_by(rank).copied()
    };
    let all: Vec<usize> = (0..groups.len()).collect();
    let complete = |index: &usize| wanted.columns.iter().all(|name| groups[*index].has(name));
    let complete: Vec<usize> = all.iter().copied().filter(complete).collect();
    if !wanted.columns.is_empty() && !complete.is_empty() {
        return fastest(&complete);
    }
    let holds = |index: &usize| groups[*index].signals().any(|column| wanted.columns.contains(&column.name));
    let holding: Vec<usize> = all.iter().copied().filter(holds).collect();
    let among = if holding.is_empty() { all } else { holding };
    let first = fastest(&among)?;
    let signals = |index: &usize| {
        let alike = |other: &&usize| (step(other) / step(index) - 1.0).abs() < SAME_STEP;
        among.iter().filter(alike).map(|other| groups[*other].signals().count()).sum::<usize>()
    };
    let usable = |index: &usize| signals(index) >= 2 && step(index) <= SLOWEST * step(&first);
    let rasters: Vec<usize> = among.iter().copied().filter(usable).collect();
    fastest(&rasters).or(Some(first))
}

/// Steps that differ by less are one raster.
const SAME_STEP: f64 = 0.01;
/// A raster with several signals is preferred to a faster single signal up to this ratio of steps.
const SLOWEST: f64 = 10.0;

/// The base group with the signals of the others at its stamps.
fn join_all(mut groups: Vec<Group>, base: usize, wanted: &Wanted, notes: &mut Vec<String>) -> Group {
    let mut table = groups.remove(base);
    groups.sort_by(|a, b| a.step().unwrap_or(f64::INFINITY).total_cmp(&b.step().unwrap_or(f64::INFINITY)));
    notes.push(format!("Group {} of the file was read.", table.description()));
    let missing = |table: &Group| wanted.columns.iter().any(|name| !table.has(name));
    let mut unread = Vec::new();
    for group in groups {
        let useful = wanted.columns.is_empty() || missing(&table) && wanted.columns.iter().any(|name| group.has(name));
        if !useful {
            unread.push(group.description());
            continue;
        }
        let known: BTreeSet<String> = table.columns.iter().map(|column| column.name.clone()).collect();
        let (repeated, new): (Vec<&Column>, Vec<&Column>) =
            group.signals().partition(|column| known.contains(&column.name));
        if new.is_empty() {
            unread.push(group.description());
            continue;
        }
        match join::onto(&table, &group, &new) {
            Some(Joined { columns, how }) => {
                let names = list(new.iter().map(|column| column.name.as_str()));
                notes.push(format!("From group {}, {how}: {names}.", group.description()));
                if !repeated.is_empty() {
                    let names = list(repeated.iter().map(|column| column.name.as_str()));
                    notes.push(format!(
                        "Not read from group \"{}\", as a faster group has the same names: {names}.",
                        group.name
                    ));
                }
                table.columns.extend(columns);
            }
            None => unread.push(group.description()),
        }
    }
    if !unread.is_empty() {
        notes.push(format!("Groups of the file that were not read: {}.", unread.join(", ")));
    }
    join::cut_ends(table, notes)
}
