//! Tables of words and of numbers with their uncertainty and unit.

use serde::{Deserialize, Serialize};

use crate::figure::symbol;
use crate::quantity::{Estimate, Written};

/// Number of letters from which the text of a cell may break into lines.
const SENTENCE: usize = 36;

/// Rows under a head.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    caption: String,
    head: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// Words, to the left.
    Text(String),
    /// A number with its uncertainty and unit, each in a column of its own.
    Estimate(Estimate),
}

impl Table {
    /// A table with these titles of columns. An estimate takes three on the page.
    pub fn new(head: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { caption: String::new(), head: head.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Caption of the table, without its number.
    pub fn caption(self, text: impl Into<String>) -> Self {
        Self { caption: text.into(), ..self }
    }

    /// One more row. Missing cells stay empty.
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// The rows in their order.
    pub fn rows(&self) -> &[Vec<Cell>] {
        &self.rows
    }

    /// Head and rows as text, each number formatted for its column.
    fn texts(&self) -> Vec<Vec<String>> {
        let write = |column: usize, cell: &Cell| match cell {
            Cell::Text(text) => text.clone(),
            Cell::Estimate(estimate) => estimate.written_beside(self.size(column)).to_string(),
        };
        let rows =
            self.rows.iter().map(|row| row.iter().enumerate().map(|(column, cell)| write(column, cell)).collect());
        std::iter::once(self.head.clone()).chain(rows).collect()
    }

    /// The table in Markdown, with its caption above.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| {
            let safe: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", safe.join(" | "))
        };
        let columns = self.head.len();
        let mut rows = self.texts().into_iter().map(|mut row| {
            row.resize(columns, String::new());
            row
        });
        let head = line(rows.next().unwrap_or_default());
        let caption = if self.caption.is_empty() { String::new() } else { format!("{}\n\n", self.caption) };
        caption + &head + &line(vec!["---".into(); columns]) + &rows.map(line).collect::<String>()
    }

    /// The table as lines for a terminal, columns aligned.
    pub fn lines(&self) -> Vec<String> {
        let rows = self.texts();
        let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
        let wide = |text: &String| text.chars().count();
        let widths: Vec<usize> = (0..columns)
            .map(|column| rows.iter().filter_map(|row| row.get(column)).map(wide).max().unwrap_or(0))
            .collect();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
            cells.collect::<Vec<_>>().join("   ").trim_end().to_owned()
        };
        rows.iter().map(line).collect()
    }

    /// Whether a column takes three on the page.
    fn holds_estimates(&self, column: usize) -> bool {
        self.rows.iter().any(|row| matches!(row.get(column), Some(Cell::Estimate(_))))
    }

    /// The largest value of a column of one unit, so that all of it has one prefix; 0 where units differ.
    fn size(&self, column: usize) -> f64 {
        let estimates = self.rows.iter().filter_map(|row| match row.get(column) {
            Some(Cell::Estimate(estimate)) => Some(estimate),
            _ => None,
        });
        let mut units = estimates.clone().map(|estimate| &estimate.unit);
        let first = units.next();
        let sizes = estimates.map(|estimate| estimate.value.abs()).filter(|size| size.is_finite());
        if units.all(|unit| Some(unit) == first) { sizes.fold(0.0, f64::max) } else { 0.0 }
    }

    /// The table as HTML; its number stands before the caption.
    pub(super) fn html(&self, number: usize) -> String {
        let columns = self.rows.iter().map(Vec::len).chain([self.head.len()]).max().unwrap_or(0);
        let head = (0..columns).map(|column| {
            let title = self.head.get(column).map_or("", String::as_str);
            match (title, self.holds_estimates(column)) {
                ("", _) => cells("td", "", "", self.holds_estimates(column)),
                (_, true) => {
                    format!("<th scope=\"col\" class=\"value\" colspan=\"3\">{}</th>", symbol::html(title))
                }
                (_, false) => cells("th scope=\"col\"", "", &symbol::html(title), false),
            }
        });
        let head: String = head.collect();
        let rows: String = self.rows.iter().map(|row| self.html_of_row(row, columns)).collect();
        format!(
            "<p class=\"caption\" id=\"table-{number}\"><b>Table {number}.</b> {}</p>\n\
             <div class=\"table\" tabindex=\"0\"><table aria-labelledby=\"table-{number}\">\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n",
            symbol::html(&self.caption)
        )
    }

    fn html_of_row(&self, row: &[Cell], columns: usize) -> String {
        let row = (0..columns).map(|column| match row.get(column) {
            None => cells("td", "", "", self.holds_estimates(column)),
            Some(Cell::Text(text)) if column == 0 => cells("th scope=\"row\"", "", &symbol::html(text), false),
            Some(Cell::Text(text)) => {
                let class = if text.chars().count() > SENTENCE { "words" } else { "" };
                cells("td", class, &symbol::html(text), self.holds_estimates(column))
            }
            Some(Cell::Estimate(estimate)) => {
                let Written { value, half_width, unit } = estimate.written_beside(self.size(column));
                let half_width = if half_width.is_empty() { half_width } else { format!("± {half_width}") };
                cells("td", "value", &value, false)
                    + &cells("td", "half-width", &half_width, false)
                    + &cells("td", "unit", &symbol::escape(&unit), false)
            }
        });
        format!("<tr>{}</tr>\n", row.collect::<String>())
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Cell::Text(text.into())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell::Text(text)
    }
}

impl From<Estimate> for Cell {
    fn from(estimate: Estimate) -> Self {
        Cell::Estimate(estimate)
    }
}

/// A cell, and two empty ones behind it in a column of estimates, which has a value, a half width and a unit.
fn cells(tag: &str, class: &str, content: &str, in_estimates: bool) -> String {
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    let end = tag.split(' ').next().unwrap_or(tag);
    let rest = if in_estimates { "<td></td><td></td>" } else { "" };
    format!("<{tag}{class}>{content}</{end}>{rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_spans_the_columns_of_the_head() {
        let columns = |html: &str| {
            let wide = |line: &str| line.matches("</td>").count() + line.matches("</th>").count();
            let spans = |line: &str| 2 * line.matches("colspan=\"3\"").count();
            html.lines().filter(|line| line.contains("<tr>")).map(|line| wide(line) + spans(line)).collect::<Vec<_>>()
        };
        let table = Table::new(["scenario", "difference", "note"])
            .row(["sine".into(), Estimate::new(1.0, "1").into(), "good".into()])
            .row(["chirp".into(), "not run".into()])
            .row([]);
        assert_eq!(columns(&table.html(1)), [5, 5, 5, 5]);
        assert_eq!(columns(&Table::new(["a"]).row(["1".into(), "2".into()]).html(1)), [2, 2]);
    }

    #[test]
    fn markdown_has_a_cell_for_each_column_and_no_bar_of_its_own() {
        let table = Table::new(["a", "b|c"]).caption("Both").row(["1".into()]);
        assert_eq!(table.markdown(), "Both\n\n| a | b\\|c |\n| --- | --- |\n| 1 |  |\n");
    }

    #[test]
    fn a_number_has_its_uncertainty_and_unit_and_a_symbol_its_style() {
        let row = ["breakaway torque M_S".into(), Estimate::new(0.299_4, "N m").with_half_width(0.004).into()];
        let html = Table::new(["", "value"]).caption("Friction").row(row).html(3);
        assert!(html.contains("<b>Table 3.</b> Friction"), "{html}");
        assert!(
            html.contains("<th scope=\"row\">breakaway torque <i>M</i><sub>S</sub></th><td class=\"value\">0.299</td>")
        );
        assert!(html.contains("<td class=\"half-width\">± 0.004</td><td class=\"unit\">N·m</td>"));
    }
}
