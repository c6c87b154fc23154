//! Logs of LinuxCNC's halscope: a line with the period, then rows of name and value in pairs. (Newer versions write a
//! table with names in the first row, which [`text`](super::text) reads; it has no time.)

use std::path::Path;

use super::bad_row;
use super::group::{Group, Table, duration, list};
use crate::column::Column;
use stickslip_base::Error;

const BEGIN: &str = "Sampling period is ";

/// Whether a text is such a log.
pub(super) fn recognises(text: &str) -> bool {
    text.trim_start().starts_with(BEGIN)
}

/// Reads the pairs, over a time from the period.
pub(super) fn read(path: &Path, text: &str) -> Result<Table, Error> {
    let mut lines = text.lines().zip(1u64..).filter(|(line, _)| !line.trim().is_empty());
    let (first, line) = lines.next().unwrap_or_default();
    let period = first.trim().strip_prefix(BEGIN).and_then(period);
    let period = period.ok_or_else(|| {
        bad_row(
            path,
            line,
            "no period of the form \"Sampling period is 1000000 ns\". Save the log again from halscope.",
        )
    })?;
    let mut columns: Vec<Column> = Vec::new();
    let mut numbers = Vec::new();
    for (row, line) in lines {
        let words: Vec<&str> = row.split_whitespace().collect();
        let pairs = words.chunks_exact(2).map(|pair| Some((pair[0], pair[1].parse::<f64>().ok()?)));
        let pairs: Option<Vec<(&str, f64)>> = pairs.collect();
        let pairs = pairs.filter(|_| words.len().is_multiple_of(2)).ok_or_else(|| bad_row(path, line, PAIRS))?;
        if columns.is_empty() {
            columns = pairs.iter().map(|(name, _)| Column::new(name, Vec::new())).collect();
        }
        let same = pairs.len() == columns.len() && pairs.iter().zip(&columns).all(|((name, _), c)| *name == c.name);
        if !same {
            let names = list(columns.iter().map(|column| column.name.as_str()));
            return Err(bad_row(path, line, format!("other names than in the first row: {names}. {PAIRS}")));
        }
        columns.iter_mut().zip(&pairs).for_each(|(column, (_, value))| column.values.push(*value));
        numbers.push(line);
    }
    // The writer of halscope counts one row too many: the last one is not of this recording.
    numbers.pop();
    columns.iter_mut().for_each(|column| column.values.truncate(numbers.len()));
    let time = (0..numbers.len()).map(|row| row as f64 * period).collect();
    columns.insert(0, Column::new("time", time).with_unit(Some("s".into())));
    let notes = vec![
        format!("Column `time` was made from the sampling period in the head of the log, {}.", duration(period)),
        "The last row of the log was omitted: halscope writes one row beyond its samples.".to_owned(),
    ];
    Ok(Table { groups: vec![Group { name: String::new(), time: Some(0), columns, lines: numbers }], notes })
}

const PAIRS: &str = "A row has a name and a number for each channel. Save the log again from halscope.";

/// `1000000 ns` in seconds.
fn period(text: &str) -> Option<f64> {
    let mut words = text.split_whitespace();
    let number: f64 = words.next()?.parse().ok()?;
    let factor = match words.next()?.trim_end_matches([',', '.', ';']) {
        "ns" | "nSecs" | "nsecs" => 1e-9,
        "us" => 1e-6,
        "ms" => 1e-3,
        "s" => 1.0,
        _ => return None,
    };
    let period = number * factor;
    (period > 0.0 && period.is_finite()).then_some(period)
}
