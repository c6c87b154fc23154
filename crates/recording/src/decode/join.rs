//! Columns with stamps of their own on the stamps of another group.

use super::group::Group;
use crate::column::{CellFault, Column};

/// Columns on the grid.
pub(super) struct Joined {
    pub(super) columns: Vec<Column>,
    /// How: part of a sentence.
    pub(super) how: &'static str,
}

/// Stamps that differ by less than this share of a step agree.
const AGREE: f64 = 1e-3;
/// Values are not interpolated over a longer gap, in median steps.
const GAP: f64 = 5.0;
/// Numbers of a state have few levels and are held, not interpolated.
const LEVELS: usize = 16;
/// Largest share of rows that is cut at the ends because a group has no values there.
const CUT: f64 = 0.05;

const NO_VALUE: &str = "no value: the column has stamps of its own, and none near this row. Cut the recording to \
     the rows where all columns have values, or select a group with --group NAME.";

/// Columns of a group at the stamps of a table; `None` if either has no rising stamps and the rows do not match.
pub(super) fn onto(table: &Group, group: &Group, columns: &[&Column]) -> Option<Joined> {
    let copies = || columns.iter().map(|column| (*column).clone()).collect();
    let rows = table.lines.len();
    let (Some((start, grid)), Some((begin, mut time))) = (table.stamps(), group.stamps()) else {
        let both = table.time.is_none() && group.time.is_none() && group.lines.len() == rows;
        return both.then(|| Joined { columns: copies(), how: "row by row, as neither has stamps" });
    };
    let shift = begin - start;
    time.iter_mut().for_each(|stamp| *stamp += shift);
    let step = table.step()?;
    if time.len() == rows && time.iter().zip(&grid).all(|(a, b)| (a - b).abs() <= AGREE * step) {
        return Some(Joined { columns: copies(), how: "whose stamps agree" });
    }
    if !time.windows(2).all(|w| w[1] > w[0]) || time.len() < 2 {
        return None;
    }
    let states = columns.iter().filter(|column| is_state(column)).count();
    let how = match states {
        0 => "interpolated linearly at these stamps",
        all if all == columns.len() => "with the last value held at these stamps",
        _ => "interpolated linearly at these stamps, states held",
    };
    let columns = columns.iter().map(|column| column_at(&grid, &time, column)).collect();
    Some(Joined { columns, how })
}

/// A column at the stamps of a grid; NaN where it has no values.
pub(super) fn column_at(grid: &[f64], time: &[f64], column: &Column) -> Column {
    let values = values_at(grid, time, &column.values, is_state(column));
    let mut joined = Column::new(&column.name, values).with_unit(column.unit.clone()).with_origin(column.origin());
    joined.fault = joined.fault.map(|fault| CellFault { text: String::new(), cause: Some(NO_VALUE), ..fault });
    joined
}

/// Values between samples: the line through both, or the earlier one.
fn values_at(grid: &[f64], time: &[f64], values: &[f64], held: bool) -> Vec<f64> {
    let last = time.len() - 1;
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let median = *steps.select_nth_unstable_by(last / 2, f64::total_cmp).1;
    let mut i = 0;
    let value = |at: &f64| {
        while i + 1 < last && time[i + 1] <= *at {
            i += 1;
        }
        // A rounded stamp may be just outside.
        let slack = AGREE * median;
        let inside = *at >= time[0] - slack && *at <= time[last] + slack;
        let width = time[i + 1] - time[i];
        let share = ((at - time[i]) / width).clamp(0.0, 1.0);
        if share == 1.0 {
            return if inside { values[i + 1] } else { f64::NAN };
        }
        if !inside || (width > GAP * median && !held) {
            return f64::NAN;
        }
        if held || share == 0.0 { values[i] } else { values[i] + share * (values[i + 1] - values[i]) }
    };
    grid.iter().map(value).collect()
}

/// Whether a column holds few whole numbers, as a flag or a state.
fn is_state(column: &Column) -> bool {
    let mut levels: Vec<i64> = Vec::new();
    for value in column.values.iter().filter(|value| value.is_finite()) {
        if value.fract() != 0.0 {
            return false;
        }
        if let Err(place) = levels.binary_search(&(*value as i64)) {
            levels.insert(place, *value as i64);
        }
        if levels.len() > LEVELS {
            return false;
        }
    }
    true
}

/// Cuts rows at both ends where joined columns have no values, if these are few.
pub(super) fn cut_ends(table: Group, notes: &mut Vec<String>) -> Group {
    let rows = table.lines.len();
    let is_joined = |column: &&Column| column.fault.as_ref().is_some_and(|fault| fault.cause == Some(NO_VALUE));
    let (mut begin, mut end) = (0, rows);
    for column in table.columns.iter().filter(is_joined) {
        let Some(first) = column.values.iter().position(|v| v.is_finite()) else { continue };
        let last = column.values.iter().rposition(|v| v.is_finite()).unwrap_or(first) + 1;
        // A column that covers less is left with empty cells, which matter only if it is used.
        if (first + rows - last) as f64 <= CUT * rows as f64 {
            (begin, end) = (begin.max(first), end.min(last));
        }
    }
    if (begin, end) == (0, rows) || begin >= end {
        return table;
    }
    let count = |rows: usize, place: &str| (rows > 0).then(|| format!("{rows} at the {place}"));
    let cut: Vec<String> = [count(begin, "start"), count(rows - end, "end")].into_iter().flatten().collect();
    notes.push(format!("Rows cut because not all columns have values there: {}.", cut.join(", ")));
    let kept: Vec<usize> = (begin..end).collect();
    table.keep(&kept)
}
