//! Numbers in text: decimal point or comma, and separators of thousands.
//!
//! `112,345` is 112.345 in one country and 112345 in another. The cells that have only one reading (`0,5`, `1,234.5`,
//! `0.001`) decide for their column, and else for the file; without any, such a cell is refused.

use super::{exact, stamps};
use crate::column::{CellFault, Column};
use stickslip_base::excerpt::excerpt;

/// Marks seen in the cells of a column.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Marks {
    /// A cell whose point, or whose comma, separates decimals.
    point: bool,
    comma: bool,
    /// A cell with a comma, or a point, before each three digits that may be either.
    grouped_by_comma: bool,
    grouped_by_point: bool,
}

/// How the cells of a column are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    /// `1,234.5`
    Point,
    /// `1.234,5`
    Comma,
    /// Cells of one reading only.
    Ambiguous,
}

/// Fault of a cell with two readings.
const AMBIGUOUS: &str = "which has two readings: its comma or point separates thousands or decimals, and no other \
     number of the file shows which. Export without separators of thousands and with a decimal point.";

impl Marks {
    /// Adds what a cell shows.
    pub(super) fn see(&mut self, cell: &str) {
        let is_number = cell.bytes().all(|byte| byte.is_ascii_digit() || b",.+-eE".contains(&byte));
        if !is_number || !cell.contains([',', '.']) {
            return;
        }
        match reading(cell) {
            Some(Reading::Only(Style::Comma)) => self.comma = true,
            Some(Reading::Only(_)) => self.point = true,
            Some(Reading::Grouped(',')) => self.grouped_by_comma = true,
            Some(Reading::Grouped(_)) => self.grouped_by_point = true,
            _ => {}
        }
    }

    /// Marks of both.
    pub(super) fn and(self, other: Marks) -> Marks {
        Marks {
            point: self.point || other.point,
            comma: self.comma || other.comma,
            grouped_by_comma: self.grouped_by_comma || other.grouped_by_comma,
            grouped_by_point: self.grouped_by_point || other.grouped_by_point,
        }
    }

    /// How a column is read whose file has other marks.
    pub(super) fn style(self, file: Marks) -> Style {
        match (self.point, self.comma) {
            (true, false) => Style::Point,
            (false, true) => Style::Comma,
            (true, true) => Style::Ambiguous,
            (false, false) => match (file.point, file.comma) {
                (true, false) => Style::Point,
                (false, true) => Style::Comma,
                // A lone point is the usual decimal point.
                (false, false) if !self.grouped_by_comma && !file.grouped_by_comma => Style::Point,
                _ => Style::Ambiguous,
            },
        }
    }

    /// Whether cells of this style have separators of thousands.
    pub(super) fn separates(self, style: Style) -> bool {
        self.grouped_by_comma && style == Style::Point || self.grouped_by_point && style == Style::Comma
    }
}

enum Reading {
    Plain,
    /// Point or comma separates decimals.
    Only(Style),
    /// One separator before three digits.
    Grouped(char),
}

/// The readings of a cell that is a number in any of them.
fn reading(cell: &str) -> Option<Reading> {
    let digits = cell.trim_start_matches(['+', '-']);
    let points = digits.matches('.').count();
    let commas = digits.matches(',').count();
    Some(match (points, commas) {
        (0, 0) => Reading::Plain,
        (0, 1) if grouped(digits, ',') => Reading::Grouped(','),
        (1, 0) if grouped(digits, '.') => Reading::Grouped('.'),
        (1, 0) => Reading::Only(Style::Point),
        (0, 1) => Reading::Only(Style::Comma),
        (0, _) => grouped(digits, ',').then_some(Reading::Only(Style::Point))?,
        (_, 0) => grouped(digits, '.').then_some(Reading::Only(Style::Comma))?,
        // With both, the last one separates decimals.
        _ => {
            let (decimal, separator, style) =
                if digits.rfind('.') > digits.rfind(',') { ('.', ',', Style::Point) } else { (',', '.', Style::Comma) };
            let (whole, _) = digits.split_once(decimal)?;
            grouped(whole, separator).then_some(Reading::Only(style))?
        }
    })
}

/// `1,234,567`: up to three digits without a leading zero, then groups of three.
fn grouped(digits: &str, separator: char) -> bool {
    let mut parts = digits.split(separator);
    let first = parts.next().unwrap_or_default();
    let is_number = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    (1..=3).contains(&first.len())
        && !first.starts_with('0')
        && is_number(first)
        && parts.all(|part| part.len() == 3 && is_number(part))
}

/// A cell as Rust writes numbers; `None` if it has two readings or none.
fn plain(cell: &str, style: Style) -> Option<String> {
    let only = match reading(cell)? {
        Reading::Plain => return Some(cell.to_owned()),
        Reading::Only(only) => only,
        Reading::Grouped(_) if style == Style::Ambiguous => return None,
        Reading::Grouped(_) => style,
    };
    Some(match only {
        Style::Comma => cell.replace('.', "").replace(',', "."),
        _ => cell.replace(',', ""),
    })
}

/// The number without its separators of thousands, if it has any.
pub(super) fn ungrouped(cell: &str, style: Style) -> Option<String> {
    let separators = match style {
        Style::Point => cell.matches(',').count(),
        Style::Comma => cell.matches('.').count(),
        Style::Ambiguous => 0,
    };
    plain(cell, style)
        .filter(|_| separators > 0 && !matches!(reading(cell), Some(Reading::Only(only)) if only != style))
}

/// A finite number of a single reading, for headers.
pub(super) fn number(cell: &str) -> Option<f64> {
    let text = plain(&without_spaces(cell), Style::Point)?;
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

/// Without the separators of thousands that have no other meaning: apostrophes and spaces between digits.
fn without_spaces(cell: &str) -> std::borrow::Cow<'_, str> {
    const SEPARATORS: [char; 5] = ['\'', '’', ' ', '\u{a0}', '\u{202f}'];
    let body = cell.trim_start_matches(['+', '-']);
    let whole = body.split([',', '.']).next().unwrap_or_default();
    let mut separators = whole.chars().filter(|c| !c.is_ascii_digit());
    let Some(separator) = separators.next().filter(|c| SEPARATORS.contains(c)) else { return cell.into() };
    if grouped(whole, separator) { cell.replace(separator, "").into() } else { cell.into() }
}

/// What the cells of a column are.
#[derive(Clone, Copy)]
enum Kind {
    Number,
    /// Numbers of many digits, as differences from this one.
    Difference(i128),
    /// Dates or times of day, as seconds from this one.
    Stamp(i128),
}

impl Kind {
    fn origin(self) -> i128 {
        match self {
            Kind::Number => 0,
            Kind::Difference(origin) | Kind::Stamp(origin) => origin,
        }
    }
}

/// The numbers of a column, cell by cell.
pub(super) struct Numbers {
    style: Style,
    /// What the first number is.
    kind: Option<Kind>,
    values: Vec<f64>,
    fault: Option<CellFault>,
}

impl Numbers {
    pub(super) fn new(style: Style) -> Self {
        Numbers { style, kind: None, values: Vec::new(), fault: None }
    }

    /// Appends a cell.
    pub(super) fn push(&mut self, cell: &str) {
        let value = self.value(cell);
        if value.is_none() && self.fault.is_none() {
            let two = self.style == Style::Ambiguous && matches!(reading(cell), Some(Reading::Grouped(_)));
            let cause = two.then_some(AMBIGUOUS);
            self.fault = Some(CellFault { row: self.values.len(), text: excerpt(cell), cause });
        }
        self.values.push(value.unwrap_or(f64::NAN));
    }

    fn value(&mut self, cell: &str) -> Option<f64> {
        if let None | Some(Kind::Stamp(_)) = self.kind
            && let Some(seconds) = stamps::seconds(cell)
        {
            let kind = *self.kind.get_or_insert_with(|| Kind::Stamp(exact::whole(seconds)));
            return Some(exact::difference(seconds, kind.origin()));
        }
        // The usual cell needs no copy.
        let cell = without_spaces(cell);
        let direct = !cell.contains(',') && (self.style == Style::Point || !cell.contains('.'));
        let text = if direct { cell } else { plain(&cell, self.style)?.into() };
        let number: f64 = text.parse().ok().filter(|value: &f64| value.is_finite())?;
        match *self.kind.get_or_insert_with(|| exact::origin(&text).map_or(Kind::Number, Kind::Difference)) {
            Kind::Number => Some(number),
            Kind::Stamp(_) => None,
            Kind::Difference(origin) => Some(
                exact::fixed(&text).map_or(number - exact::value(origin), |fixed| exact::difference(fixed, origin)),
            ),
        }
    }

    /// Whether the cells are dates or times of day.
    pub(super) fn is_stamps(&self) -> bool {
        matches!(self.kind, Some(Kind::Stamp(_)))
    }

    /// Only the first rows.
    pub(super) fn truncate(&mut self, rows: usize) {
        self.values.truncate(rows);
        self.fault = self.fault.take().filter(|fault| fault.row < rows);
    }

    /// The column; its first cell that is not a number is a fault if the column is used.
    pub(super) fn column(self, name: &str, unit: Option<String>) -> Column {
        let unit = if self.is_stamps() { Some("s".to_owned()) } else { unit };
        let origin = self.kind.map_or(0, Kind::origin);
        let mut column = Column::new(name, self.values).with_unit(unit).with_origin(exact::value(origin));
        column.fault = self.fault;
        column
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(columns: &[&[&str]]) -> Vec<Vec<Option<f64>>> {
        let marks: Vec<Marks> = columns
            .iter()
            .map(|cells| {
                cells.iter().fold(Marks::default(), |mut marks, cell| {
                    marks.see(cell);
                    marks
                })
            })
            .collect();
        let file = marks.iter().fold(Marks::default(), |a, b| a.and(*b));
        let column = |(cells, marks): (&&[&str], &Marks)| {
            let mut numbers = Numbers::new(marks.style(file));
            cells.iter().for_each(|cell| numbers.push(cell));
            numbers.values.iter().map(|v| Some(*v).filter(|v| v.is_finite())).collect()
        };
        columns.iter().zip(&marks).map(column).collect()
    }

    #[test]
    fn a_comma_before_three_digits_is_read_as_the_rest_of_the_file_shows() {
        assert_eq!(read(&[&["0.001", "0.002"], &["987", "112,345"]])[1], [Some(987.0), Some(112_345.0)]);
        assert_eq!(read(&[&["0,001", "0,002"], &["987", "112,345"]])[1], [Some(987.0), Some(112.345)]);
        assert_eq!(read(&[&["1,5", "0,002"], &["987", "112.345"]])[1], [Some(987.0), Some(112_345.0)]);
        assert_eq!(read(&[&["0.001"], &["112.345"]])[1], [Some(112.345)]);
        // Its own cells decide before those of other columns.
        assert_eq!(read(&[&["0.001", "0.002"], &["0,5", "112,345"]])[1], [Some(0.5), Some(112.345)]);
    }

    #[test]
    fn without_another_number_that_shows_it_the_cell_is_refused() {
        assert_eq!(read(&[&["1", "2"], &["987", "112,345"]])[1], [Some(987.0), None]);
        let mut numbers = Numbers::new(Style::Ambiguous);
        numbers.push("112,345");
        assert_eq!(numbers.column("x", None).fault.map(|fault| fault.cause), Some(Some(AMBIGUOUS)));
    }

    #[test]
    fn cells_of_one_reading_are_read_in_any_file() {
        for (cell, value) in [
            ("1.234,5", 1234.5),
            ("1,234.5", 1234.5),
            ("1,234,567", 1_234_567.0),
            ("1.234.567", 1_234_567.0),
            ("1'234.5", 1234.5),
            ("-1 234,5", -1234.5),
            ("+0,123", 0.123),
            ("1.5e-3", 1.5e-3),
        ] {
            assert_eq!(number(cell), Some(value), "{cell}");
        }
        for cell in ["1,2,3", "1.2.3", "12,34.5", "1 2", "", "abc", "inf", "1,5 mm", "0x1f"] {
            assert_eq!(number(cell), None, "{cell}");
        }
    }
}
