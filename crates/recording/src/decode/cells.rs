//! Rows of cells in a text, and the columns of numbers below a header.

use std::path::Path;

use super::bad_row;
use super::numbers::{Marks, Numbers, Style, ungrouped};
use crate::column::Column;
use stickslip_base::Error;

/// A text of rows of cells.
#[derive(Clone, Copy)]
pub(super) struct Sheet<'a> {
    pub(super) path: &'a Path,
    pub(super) text: &'a str,
    pub(super) delimiter: char,
    /// Whether `#` at the start of a line begins a comment.
    pub(super) comments: bool,
}

/// A column to be read: index of its cells, name and unit.
pub(super) struct Head {
    pub(super) index: usize,
    pub(super) name: String,
    pub(super) unit: Option<String>,
}

impl Head {
    /// Its name for notes, or its place.
    fn title(&self) -> String {
        if self.name.is_empty() { (self.index + 1).to_string() } else { format!("`{}`", self.name) }
    }
}

/// Columns of numbers with their lines.
pub(super) struct Body {
    pub(super) columns: Vec<Column>,
    pub(super) lines: Vec<u64>,
    pub(super) notes: Vec<String>,
}

impl<'a> Sheet<'a> {
    /// Calls `row` with the line and the trimmed cells of each row that is not blank, until it returns false.
    pub(super) fn rows(&self, mut row: impl FnMut(u64, &[&str]) -> Result<bool, Error>) -> Result<(), Error> {
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(self.delimiter as u8)
            .comment(self.comments.then_some(b'#'))
            .trim(csv::Trim::All)
            .from_reader(self.text.as_bytes());
        let mut record = csv::StringRecord::new();
        loop {
            let more = reader.read_record(&mut record).map_err(|error| {
                let line = error.position().map_or(0, csv::Position::line);
                bad_row(self.path, line, format!("{error}. Export the recording again."))
            })?;
            if !more {
                return Ok(());
            }
            // The reader is after the row, or after its line end. (A row's own position is before blank lines.)
            let (end, line) = (reader.position().byte() as usize, reader.position().line());
            let line = if self.text.as_bytes()[end - 1] == b'\n' { line - 1 } else { line };
            let cells: Vec<&str> = record.iter().collect();
            if !row(line, &cells)? {
                return Ok(());
            }
        }
    }

    /// The first rows, at most `count`.
    pub(super) fn first_rows(&self, count: usize) -> Result<Vec<(u64, Vec<String>)>, Error> {
        let mut rows = Vec::new();
        self.rows(|line, cells| {
            rows.push((line, cells.iter().map(|cell| (*cell).to_owned()).collect()));
            Ok(rows.len() < count)
        })?;
        Ok(rows)
    }

    /// Numbers of the columns in the rows after the line `after`. Rows may have any length; missing cells are empty.
    pub(super) fn body(&self, after: u64, heads: Vec<Head>, end: fn(&[&str]) -> bool) -> Result<Body, Error> {
        fn cell<'c>(cells: &[&'c str], head: &Head) -> &'c str {
            cells.get(head.index).copied().unwrap_or_default()
        }
        let mut marks = vec![Marks::default(); heads.len()];
        self.rows(|line, cells| {
            if line > after && !end(cells) {
                heads.iter().zip(&mut marks).for_each(|(head, marks)| marks.see(cell(cells, head)));
            }
            Ok(true)
        })?;
        let file = marks.iter().fold(Marks::default(), |all, marks| all.and(*marks));
        let styles: Vec<Style> = marks.iter().map(|marks| marks.style(file)).collect();
        let mut numbers: Vec<Numbers> = styles.iter().map(|style| Numbers::new(*style)).collect();
        let (mut lines, mut rows) = (Vec::new(), 0);
        let mut example = vec![None; heads.len()];
        self.rows(|line, cells| {
            if line <= after {
                return Ok(true);
            }
            if end(cells) {
                return Ok(false);
            }
            lines.push(line);
            for (i, (head, numbers)) in heads.iter().zip(&mut numbers).enumerate() {
                let cell = cell(cells, head);
                numbers.push(cell);
                if example[i].is_none() && marks[i].separates(styles[i]) {
                    example[i] = ungrouped(cell, styles[i]).map(|digits| (cell.to_owned(), digits));
                }
                if !cell.is_empty() {
                    rows = lines.len();
                }
            }
            Ok(true)
        })?;
        // Spreadsheets end with rows of separators.
        lines.truncate(rows);
        numbers.iter_mut().for_each(|numbers| numbers.truncate(rows));
        let separated = heads.iter().zip(&example).filter_map(|(head, cell)| Some((head, cell.as_ref()?)));
        let notes = separated.map(|(head, (cell, digits))| {
            format!("Column {} has separators of thousands: \"{cell}\" was read as {digits}.", head.title())
        });
        let mut notes: Vec<String> = notes.collect();
        for (head, _) in heads.iter().zip(&numbers).filter(|(_, numbers)| numbers.is_stamps()) {
            notes.push(format!("Column {} holds dates or times of day; it was read in s.", head.title()));
        }
        let columns = heads.iter().zip(numbers).map(|(head, numbers)| numbers.column(&head.name, head.unit.clone()));
        Ok(Body { columns: columns.collect(), lines, notes })
    }
}

/// No row ends the numbers.
pub(super) fn never(_: &[&str]) -> bool {
    false
}
