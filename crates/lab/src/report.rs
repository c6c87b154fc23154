//! A report: one HTML file that holds everything, readable in ten years without this program.
//!
//! ```
//! use stickslip::quantity::Estimate;
//! use stickslip::report::{Provenance, Report, Table};
//!
//! let key = Table::of_estimates([("breakaway torque M_S", Estimate::new(0.2994, "N m").with_half_width(0.004))]);
//! let origin = Provenance { command: "stickslip demo".into(), version: "0.1.0".into(), seed: Some(1), parameters: String::new() };
//! let report = Report::new("Friction of an axis", origin).heading("Own friction").table(key);
//! assert!(report.html().contains("<td class=\"value\">0.299</td>"));
//! ```

use std::path::Path;

use crate::figure::{Figure, escape, theme};
use crate::quantity::{Estimate, Written};
use crate::{Error, output};

/// Headings, paragraphs, tables and figures in their order, and where they come from.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    title: String,
    provenance: Provenance,
    sections: Vec<Section>,
}

/// What it takes to get the same report again.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Seed of the noise; none where nothing was drawn.
    pub seed: Option<u64>,
    /// All parameters, as in a file.
    pub parameters: String,
}

/// A part of a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Section {
    /// The title of what follows.
    Heading(String),
    /// Some sentences.
    Paragraph(String),
    /// Rows of text or of estimates.
    Table(Table),
    /// A figure with a sentence about it.
    Figure(Box<Figure>, String),
}

/// Rows under a head.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    head: Vec<String>,
    rows: Vec<Vec<Cell>>,
}

/// What stands in a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words, to the left.
    Text(String),
    /// A number with its uncertainty and unit, each in a column of its own.
    Estimate(Estimate),
}

impl Table {
    /// A table with these titles of columns. An estimate takes three on the page.
    pub fn new(head: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { head: head.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// One more row. Cells that it lacks stay empty.
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    /// The usual table of key numbers: name, value ± half width, unit.
    pub fn of_estimates<N: Into<String>>(estimates: impl IntoIterator<Item = (N, Estimate)>) -> Self {
        estimates.into_iter().fold(Self::new(["", "value"]), |table, (name, estimate)| {
            table.row([Cell::Text(name.into()), Cell::Estimate(estimate)])
        })
    }

    /// Whether a column takes three on the page.
    fn holds_estimates(&self, column: usize) -> bool {
        self.rows.iter().any(|row| matches!(row.get(column), Some(Cell::Estimate(_))))
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Cell::Text(text.into())
    }
}

impl From<Estimate> for Cell {
    fn from(estimate: Estimate) -> Self {
        Cell::Estimate(estimate)
    }
}

impl Report {
    /// A report without sections.
    pub fn new(title: impl Into<String>, provenance: Provenance) -> Self {
        Self { title: title.into(), provenance, sections: Vec::new() }
    }

    /// Adds a heading.
    pub fn heading(self, text: impl Into<String>) -> Self {
        self.section(Section::Heading(text.into()))
    }

    /// Adds a paragraph.
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.section(Section::Paragraph(text.into()))
    }

    /// Adds a table.
    pub fn table(self, table: Table) -> Self {
        self.section(Section::Table(table))
    }

    /// Adds a figure with its caption.
    pub fn figure(self, figure: Figure, caption: impl Into<String>) -> Self {
        self.section(Section::Figure(Box::new(figure), caption.into()))
    }

    /// Adds any section.
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// The whole page.
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        let body: String = self.sections.iter().map(html_of).collect();
        let Provenance { command, version, seed, parameters } = &self.provenance;
        let seed = seed.map(|seed| format!("<dt>Seed</dt><dd>{seed}</dd>\n")).unwrap_or_default();
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n\
             <style>\n{STYLE}{}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n{body}\
             <footer>\n<h2>Where this comes from</h2>\n<dl>\n<dt>Command</dt><dd><code>{}</code></dd>\n\
             <dt>Version</dt><dd>stickslip {}</dd>\n{seed}</dl>\n\
             <details>\n<summary>Parameters</summary>\n<pre>{}</pre>\n</details>\n</footer>\n</main>\n</body>\n</html>\n",
            colours(),
            escape(command),
            escape(version),
            escape(parameters),
        )
    }

    /// Writes the page.
    ///
    /// # Errors
    /// [`Error::File`] if the system refuses.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        output::write(path, self.html())
    }
}

fn html_of(section: &Section) -> String {
    match section {
        Section::Heading(text) => format!("<h2>{}</h2>\n", escape(text)),
        Section::Paragraph(text) => format!("<p>{}</p>\n", escape(text)),
        Section::Table(table) => html_of_table(table),
        Section::Figure(figure, caption) => {
            format!("<figure>\n{}<figcaption>{}</figcaption>\n</figure>\n", figure.svg(), escape(caption))
        }
    }
}

fn html_of_table(table: &Table) -> String {
    let columns = table.rows.iter().map(Vec::len).chain([table.head.len()]).max().unwrap_or(0);
    let head = (0..columns).map(|column| {
        let title = table.head.get(column).map_or("", String::as_str);
        match (title, table.holds_estimates(column)) {
            ("", _) => cells("td", "", "", table.holds_estimates(column)),
            (_, true) => cells("th scope=\"col\"", "value", &escape(title), true),
            (_, false) => cells("th scope=\"col\"", "", &escape(title), false),
        }
    });
    let head: String = head.collect();
    let rows: String = table.rows.iter().map(|row| html_of_row(table, row, columns)).collect();
    format!("<div class=\"table\"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n")
}

fn html_of_row(table: &Table, row: &[Cell], columns: usize) -> String {
    let row = (0..columns).map(|column| match row.get(column) {
        None => cells("td", "", "", table.holds_estimates(column)),
        Some(Cell::Text(text)) if column == 0 => cells("th scope=\"row\"", "", &escape(text), false),
        Some(Cell::Text(text)) => cells("td", "", &escape(text), table.holds_estimates(column)),
        Some(Cell::Estimate(estimate)) => {
            let Written { value, half_width, unit } = estimate.written();
            let half_width = if half_width.is_empty() { half_width } else { format!("± {half_width}") };
            cells("td", "value", &value, false)
                + &cells("td", "half-width", &half_width, false)
                + &cells("td", "unit", &escape(&unit), false)
        }
    });
    format!("<tr>{}</tr>\n", row.collect::<String>())
}

/// A cell, and two empty ones behind it in a column of estimates, which has a value, a half width and a unit.
fn cells(tag: &str, class: &str, content: &str, in_estimates: bool) -> String {
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    let end = tag.split(' ').next().unwrap_or(tag);
    let rest = if in_estimates { "<td></td><td></td>" } else { "" };
    format!("<{tag}{class}>{content}</{end}>{rest}")
}

/// The page's colours; figures take theirs from the classes of their elements.
fn colours() -> String {
    let list = |dark: bool| -> String {
        let value = |colour: &theme::Colour| if dark { colour.dark } else { colour.light };
        theme::COLOURS.iter().map(|colour| format!("--{}:{};", colour.class, value(colour))).collect()
    };
    let classes: String = theme::COLOURS.iter().map(|colour| rule(colour.class)).collect();
    let rim = "svg .rim{stroke:var(--surface)}\n";
    format!(":root{{{}}}\n@media (prefers-color-scheme:dark){{:root{{{}}}}}\n{classes}{rim}", list(false), list(true))
}

fn rule(class: &str) -> String {
    let property = match class {
        "grid" | "axis" => "stroke",
        "surface" | "ink" | "text-2" | "text-3" | "interval" => "fill",
        _ => "color",
    };
    format!("svg .{class}{{{property}:var(--{class})}}\n")
}

const STYLE: &str = include_str!("report/style.css");

#[cfg(test)]
mod tests;
