//! A report: one HTML file that holds everything, readable in ten years without this program.
//!
//! ```
//! use stickslip::quantity::Estimate;
//! use stickslip::report::{Provenance, Report, Table};
//!
//! let key = Table::of_estimates([("breakaway torque M_S", Estimate::new(0.2994, "N m").with_half_width(0.004))]);
//! let origin = Provenance { command: "stickslip demo".into(), version: "0.1.0".into(), seed: 1, parameters: String::new() };
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
    /// Seed of the noise.
    pub seed: u64,
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
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title}</title>\n\
             <style>\n{STYLE}{}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n{body}\
             <footer>\n<h2>Where this comes from</h2>\n<dl>\n<dt>Command</dt><dd><code>{}</code></dd>\n\
             <dt>Version</dt><dd>stickslip {}</dd>\n<dt>Seed</dt><dd>{seed}</dd>\n</dl>\n\
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

const STYLE: &str = "\
*{box-sizing:border-box}
body{margin:0;background:var(--surface);color:var(--ink);font:15px/1.55 Inter,system-ui,sans-serif;\
font-feature-settings:'tnum','calt','ss03','cv05'}
main{max-width:824px;margin:0 auto;padding:40px 32px 64px}
h1{font-size:26px;line-height:1.25;font-weight:650;margin:0 0 24px}
h2{font-size:17px;font-weight:600;margin:40px 0 8px}
p{max-width:68ch;margin:8px 0;color:var(--text-2)}
.table{overflow-x:auto;margin:16px 0}
table{border-collapse:collapse}
th,td{padding:7px 24px 7px 0;border-bottom:1px solid var(--grid);text-align:left;font-weight:400;white-space:nowrap}
thead th,thead td{font-size:12px;color:var(--text-3);border-color:var(--axis)}
th.value,td.value{text-align:right;padding-right:8px}
td.value{font-weight:600}
td.half-width{color:var(--text-2);padding-right:8px}
td.unit{color:var(--text-3)}
figure{margin:24px 0}
figure svg{display:block;width:100%;height:auto}
figcaption{font-size:13px;color:var(--text-3);margin-top:4px}
footer{margin-top:56px;border-top:1px solid var(--axis);font-size:13px;color:var(--text-2)}
footer h2{margin-top:24px;font-size:14px;color:var(--ink)}
dl{display:grid;grid-template-columns:max-content 1fr;gap:4px 16px;margin:8px 0}
dt{color:var(--text-3)}
dd{margin:0;overflow-wrap:anywhere}
summary{cursor:pointer}
code,pre{font:12.5px/1.5 ui-monospace,monospace}
pre{overflow-x:auto}
@media print{main{max-width:none;padding:0}figure,tr{break-inside:avoid}h2{break-after:avoid}}
";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Axis, Role, Series};
    use expect_test::expect_file;

    fn report(text: &str) -> Report {
        let provenance = Provenance {
            command: format!("stickslip demo --out {text}"),
            version: "0.1.0".into(),
            seed: 7,
            parameters: format!("# {text}\n[model.load.friction]\nbreakaway_torque = 0.3\n"),
        };
        let figure = Figure::new(text)
            .x(Axis::new("speed Ω", "rad/s").stretched())
            .y(Axis::new("friction torque", "N m"))
            .interval(-0.3, 0.3, "fade-out")
            .series(Series::line(
                Role::Fitted,
                "fit",
                [(-50.0, -0.19), (0.0, -0.3), (0.0, f64::NAN), (0.0, 0.3), (50.0, 0.19)],
            ));
        let estimates = [
            (text, Estimate::new(0.299_4, "N m").with_half_width(0.004)),
            ("kinetic torque M_K", Estimate::new(0.181_23, "N m").with_half_width(0.000_61)),
            ("viscous friction b", Estimate::new(0.000_206, "N m s/rad").with_half_width(0.000_007)),
            ("Stribeck velocity Ω_Strib", Estimate::new(f64::NAN, "rad/s").with_half_width(0.1)),
            ("speed against real time", Estimate::new(1234.0, "1")),
        ];
        let wide = Table::new(["scenario", "difference", text])
            .row(["sine 0.5 Hz".into(), Estimate::new(0.031, "1").into(), text.into()])
            .row([Cell::from("sine 2 Hz")]);
        Report::new(text, provenance)
            .paragraph("The axis was measured at 16 speeds in both directions.")
            .table(Table::of_estimates(estimates))
            .heading("Own friction")
            .figure(figure, text)
            .table(wide)
    }

    #[test]
    fn a_report_looks_as_it_did() {
        expect_file!["golden/report.html"].assert_eq(&report("Friction of the bench").html());
    }

    #[test]
    fn text_from_outside_is_escaped_everywhere() {
        let page = report("<img src=x onerror=\"alert(1)\">&").html();
        assert!(!page.contains("<img"), "{page}");
        assert!(page.contains("&lt;img src=x onerror=&quot;alert(1)&quot;&gt;&amp;"));
    }

    #[test]
    fn a_report_reaches_for_nothing_outside() {
        let page = report("Alone").html().replace("http://www.w3.org/2000/svg", "");
        for reach in ["http", "src=", "href=", "url(", "@import", "<script"] {
            assert!(!page.contains(reach), "{reach}");
        }
    }

    #[test]
    fn every_colour_of_a_figure_has_its_dark_one() {
        let page = report("Dark").html();
        let (_, figure) = page.split_once("<svg").expect("there is a figure");
        let classes = figure.split("class=\"").skip(1).filter_map(|rest| rest.split('"').next());
        for class in classes.flat_map(|classes| classes.split(' ')) {
            let table = ["value", "half-width", "unit", "table"].contains(&class);
            assert!(table || page.contains(&format!("svg .{class}{{")), "{class}");
        }
        assert!(page.contains("@media (prefers-color-scheme:dark){:root{--surface:#13171E;"));
    }

    #[test]
    fn every_row_has_the_cells_of_the_head() {
        let cells = |html: &str| {
            html.lines()
                .filter(|line| line.contains("<tr>"))
                .map(|line| line.matches("</t").count())
                .collect::<Vec<_>>()
        };
        let table = Table::new(["scenario", "difference", "note"])
            .row(["sine".into(), Estimate::new(1.0, "1").into(), "good".into()])
            .row(["chirp".into(), "not run".into()])
            .row([]);
        // Five cells and the end of the row; in the head also the end of the head.
        assert_eq!(cells(&html_of_table(&table)), [7, 6, 6, 6]);
        assert!(html_of_table(&table).contains("<th scope=\"col\" class=\"value\">difference</th><td></td><td></td>"));
        assert_eq!(cells(&html_of_table(&Table::new(["a"]).row(["1".into(), "2".into()]))), [4, 3]);
    }

    #[test]
    fn a_file_that_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("report.html");
        report("Written").write(&path).expect("the folder takes a file");
        assert_eq!(std::fs::read_to_string(&path).expect("it was written"), report("Written").html());
        let nowhere = folder.path().join("nowhere/report.html");
        let refusal = report("Refused").write(&nowhere).expect_err("the folder does not exist").to_string();
        assert!(refusal.contains("nowhere/report.html: cannot write it"), "{refusal}");
    }
}
