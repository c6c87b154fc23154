//! Tables in which each row has the cells of one topic only: exports of several topics over one column of stamps.

use std::collections::BTreeMap;

use super::group::{Group, list};
use super::{header, join};
use crate::column::Column;

/// Share of empty cells from which a column has stamps of its own; fewer are lost samples.
const SPARSE: f64 = 0.25;
/// Fewer values are events, not a signal.
const FEWEST: usize = 10;

/// The table on the stamps of its densest topic, if it is sparse.
pub(super) fn joined(group: Group, notes: &mut Vec<String>) -> Group {
    let Some(split) = Split::of(&group) else { return group };
    let kept: Vec<usize> = (0..group.lines.len()).filter(|row| split.keeps(*row)).collect();
    let mut table = group.keep(&kept);
    table.time = Some(split.time);
    let Some((_, grid)) = table.stamps() else { return group };
    let mut names = Vec::new();
    for index in &split.sparse {
        let column = &group.columns[*index];
        let rows: Vec<usize> = (0..group.lines.len()).filter(|row| column.values[*row].is_finite()).collect();
        let topic = Group {
            columns: vec![group.columns[split.time].keep(&rows), column.keep(&rows)],
            time: Some(0),
            ..Group::default()
        };
        let Some((_, time)) = topic.stamps().filter(|(_, time)| time.windows(2).all(|w| w[1] > w[0])) else { continue };
        table.columns[*index] = join::column_at(&grid, &time, &topic.columns[1]);
        names.push(column.name.as_str());
    }
    let (all, rows) = (group.lines.len(), table.lines.len());
    notes.push(format!(
        "Rows have the cells of some columns only. Columns with stamps of their own: {}; they were interpolated at the \
         stamps of {}, {rows} of {all} rows.",
        list(names),
        list(split.dense.iter().map(|index| group.columns[*index].name.as_str())),
    ));
    join::cut_ends(table, notes)
}

/// Columns of a sparse table.
struct Split {
    /// The column of stamps.
    time: usize,
    /// Columns of the densest topic.
    dense: Vec<usize>,
    /// Columns to be interpolated.
    sparse: Vec<usize>,
    /// Whether a row has a value of the densest topic.
    grid: Vec<bool>,
    /// Whether a row has any value.
    any: Vec<bool>,
}

impl Split {
    fn of(group: &Group) -> Option<Self> {
        let rows = group.lines.len();
        let time = group.columns.iter().position(|column| column.fault.is_none() && !header::numbers_rows(column))?;
        let count = |column: &Column| column.values.iter().filter(|value| value.is_finite()).count();
        let filled: Vec<usize> = group.columns.iter().map(count).collect();
        let is_signal =
            |index: &usize| *index != time && filled[*index] >= FEWEST && !header::numbers_rows(&group.columns[*index]);
        let signals: Vec<usize> = (0..filled.len()).filter(is_signal).collect();
        let most = signals.iter().map(|index| filled[*index]).max()?;
        let is_sparse = |index: &usize| (filled[*index] as f64) < (1.0 - SPARSE) * rows as f64;
        if !signals.iter().any(is_sparse) {
            return None;
        }
        let mask = |index: usize| -> Vec<bool> { group.columns[index].values.iter().map(|v| v.is_finite()).collect() };
        let mut topics: BTreeMap<Vec<bool>, Vec<usize>> = BTreeMap::new();
        signals.iter().for_each(|index| topics.entry(mask(*index)).or_default().push(*index));
        let (grid, dense) =
            topics.into_iter().filter(|(_, all)| filled[all[0]] == most).max_by_key(|(_, all)| all.len())?;
        let sparse: Vec<usize> = signals.iter().copied().filter(|i| !dense.contains(i) && is_sparse(i)).collect();
        let stamps: Vec<f64> = (0..rows).filter(|row| grid[*row]).map(|row| group.columns[time].values[row]).collect();
        if !stamps.windows(2).all(|w| w[1] > w[0]) {
            return None;
        }
        let any =
            (0..rows).map(|row| signals.iter().any(|index| group.columns[*index].values[row].is_finite())).collect();
        (!sparse.is_empty()).then_some(Split { time, dense, sparse, grid, any })
    }

    /// Whether the row is of the densest topic, or of none: then its values are lost.
    fn keeps(&self, row: usize) -> bool {
        self.grid[row] || !self.any[row]
    }
}
