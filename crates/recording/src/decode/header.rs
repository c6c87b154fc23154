//! Headers of text tables: names, units in brackets or in a row below, rows of types, and columns without a name.

use std::collections::BTreeMap;

use super::numbers::number;
use crate::column::{Column, counts_rows};
use stickslip_base::units::{Dimension, measure};

/// Names of types that tools write below the names.
const TYPES: [&str; 34] = [
    "bool", "boolean", "byte", "char", "dint", "double", "dword", "enum", "float", "float32", "float64", "int",
    "int16", "int32", "int64", "int8", "integer", "long", "lreal", "real", "real32", "real64", "short", "sint",
    "single", "udint", "uint", "uint16", "uint32", "uint64", "uint8", "usint", "word", "object",
];
/// Names of row numbers.
const ROW_NUMBERS: [&str; 12] =
    ["index", "idx", "row", "sample", "samples", "no", "no.", "nr", "nr.", "n", "#", "counter"];

/// Names and units of a header.
pub(super) fn names_and_units<'a>(cells: impl Iterator<Item = &'a str> + Clone) -> Vec<(String, Option<String>)> {
    let mut stems: BTreeMap<&str, usize> = BTreeMap::new();
    for (stem, ..) in cells.clone().filter_map(bracket) {
        *stems.entry(stem.trim()).or_default() += 1;
    }
    cells.map(|cell| name_and_unit(cell, &stems)).collect()
}

/// `x [mm]`, or `x (mm)` if the brackets hold a unit. `x[1]` is an element of an array, and so is `x[left]` next to
/// `x[right]`.
fn name_and_unit(cell: &str, stems: &BTreeMap<&str, usize>) -> (String, Option<String>) {
    let whole = || (cell.to_owned(), None);
    let Some((stem, inner, square)) = bracket(cell) else { return whole() };
    let name = stem.trim();
    let attached = stem.ends_with(|letter: char| !letter.is_whitespace());
    let is_index = !inner.is_empty() && inner.chars().all(|c| c.is_ascii_digit() || matches!(c, ',' | ':' | ' '));
    let has_siblings = stems.get(name).is_some_and(|count| *count > 1);
    let is_known = measure(inner).is_some();
    let is_name = name.is_empty()
        || is_index && (attached || has_siblings || !is_known)
        || !is_known && (!square || attached && has_siblings);
    if is_name { whole() } else { (name.to_owned(), Some(inner.to_owned())) }
}

/// Text before the last brackets, text in them, and whether they are square.
fn bracket(cell: &str) -> Option<(&str, &str, bool)> {
    let square = cell.strip_suffix(']').and_then(|text| text.rsplit_once('[')).map(|(a, b)| (a, b.trim(), true));
    let round = || cell.strip_suffix(')').and_then(|text| text.rsplit_once('(')).map(|(a, b)| (a, b.trim(), false));
    square.or_else(round)
}

/// A unit of a row below the header, without brackets; `None` if it is unknown.
pub(super) fn unit(cell: &str) -> Option<String> {
    measure(cell).map(|_| cell.trim_matches(['[', ']', '(', ')']).to_owned())
}

/// Whether a row below the header has units: no number in it, and at least one unit.
pub(super) fn is_units<S: AsRef<str>>(row: &[S]) -> bool {
    // The unit 1 of a ratio is also a number.
    let is_unit = |cell: &S| number(cell.as_ref()).is_none() && measure(cell.as_ref()).is_some();
    row.iter().any(is_unit) && row.iter().all(|cell| number(cell.as_ref()).is_none() || cell.as_ref() == "1")
}

/// Whether a row below the header has names of types only.
pub(super) fn is_types<S: AsRef<str>>(row: &[S]) -> bool {
    let is_type = |cell: &S| {
        let cell = cell.as_ref().to_lowercase();
        cell.is_empty() || TYPES.contains(&cell.as_str())
    };
    row.iter().all(is_type) && row.iter().any(|cell| !cell.as_ref().is_empty())
}

/// Names columns without a name, and marks row numbers by their unit, so that they are not taken for a time.
pub(super) fn name_row_numbers(columns: &mut [Column], notes: &mut Vec<String>) {
    for index in 0..columns.len() {
        let column = &columns[index];
        let nameless = column.name.is_empty() || column.name.starts_with("Unnamed: ") || column.name == INDEX;
        let is_named = index == 0 && ROW_NUMBERS.contains(&column.name.to_lowercase().as_str());
        let counts = nameless && mostly_counts(column) || is_named && counts_rows(&column.values);
        if counts && column.unit.is_none() {
            let name = if nameless { "row".to_owned() } else { column.name.clone() };
            let name = free_name(name, index, columns);
            let named = if nameless { ", which has no name in the file," } else { "" };
            notes.push(format!("Column `{name}`{named} counts the rows; it was not taken for a time."));
            if !counts_rows(&columns[index].values) {
                notes.push(format!("The numbers in `{name}` do not rise evenly: rows were removed or joined before."));
            }
            let column = &mut columns[index];
            (column.name, column.unit) = (name, Some("1".into()));
        } else if nameless {
            let is_time = column.unit.as_deref().and_then(measure).is_some_and(|(d, _)| d == Dimension::Time);
            let name = match () {
                () if is_time => "time".to_owned(),
                () if index == 0 || column.name == INDEX => "index".to_owned(),
                () => format!("column {}", index + 1),
            };
            columns[index].name = free_name(name, index, columns);
        }
    }
}

/// Whether most values are the next whole number.
fn mostly_counts(column: &Column) -> bool {
    let steps = column.values.windows(2).filter(|w| w[1] - w[0] == 1.0).count();
    is_whole(column) && (2 * steps > column.values.len() || counts_rows(&column.values))
}

fn is_whole(column: &Column) -> bool {
    column.fault.is_none() && column.values.iter().all(|value| value.fract() == 0.0)
}

/// Whether a column was recognised as row numbers.
pub(super) fn numbers_rows(column: &Column) -> bool {
    column.unit.as_deref() == Some("1") && is_whole(column)
}

/// Name of the index in the Parquet files of pandas.
const INDEX: &str = "__index_level_0__";

/// A name that no other column has.
fn free_name(name: String, index: usize, columns: &[Column]) -> String {
    let taken = columns.iter().enumerate().any(|(other, column)| other != index && column.name == name);
    if taken { format!("{name} (column {})", index + 1) } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(header: &[&'static str]) -> Vec<(String, Option<String>)> {
        names_and_units(header.iter().copied())
    }

    #[test]
    fn an_index_belongs_to_the_name_and_a_unit_does_not() {
        for (cell, name, unit) in [
            ("position[0]", "position[0]", None),
            ("effort[1]", "effort[1]", None),
            ("duty [1]", "duty", Some("1")),
            ("pos [mm]", "pos", Some("mm")),
            ("pos[mm]", "pos", Some("mm")),
            ("x [Inkr.]", "x", Some("Inkr.")),
            ("x (actual)", "x (actual)", None),
            ("x(1)", "x(1)", None),
            ("matrix[1,2]", "matrix[1,2]", None),
            ("joint[1].pos [deg]", "joint[1].pos", Some("deg")),
            ("[mm]", "[mm]", None),
        ] {
            assert_eq!(read(&["t", cell])[1], (name.to_owned(), unit.map(str::to_owned)), "{cell}");
        }
        let names = |header: &[&'static str]| read(header).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
        assert_eq!(names(&["q[left]", "q[right]"]), ["q[left]", "q[right]"]);
        assert_eq!(names(&["q [0]", "q [1]"]), ["q [0]", "q [1]"]);
    }
}
