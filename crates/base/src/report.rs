//! A report: a document of numbers (`report.json`), and the page of it (`report.html`), one self-contained file that is
//! readable without this program.
//!
//! The page is a function of the document alone: saved, read and rendered again it has the same bytes. Execution times
//! are therefore not part of it; they are in `summary.json`.
//!
//! ```
//! use stickslip_base::quantity::Estimate;
//! use stickslip_base::report::{Provenance, Report};
//!
//! let report = Report::new("Friction of an axis", Provenance::new("stickslip demo", Some(1), ""))
//!     .summary("The axis breaks away at 0.3 N·m.")
//!     .key("breakaway torque M_S", Estimate::new(0.2994, "N m").with_half_width(0.004))
//!     .heading("Own friction");
//! assert!(report.html().contains("<i>M</i><sub>S</sub>"));
//! assert_eq!(Report::from_json(&report.to_json()).unwrap(), report);
//! ```

mod compare;
mod figure;
mod html;
mod json;
mod map;
mod table;

use std::path::Path;

use serde::{Deserialize, Serialize};

pub use table::{Cell, Table};

use crate::figure::{Figure, Map};
use crate::quantity::Estimate;
use crate::{Error, Summary, output};

/// Title, summary, key numbers and sections in their order, and their provenance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    title: String,
    summary: String,
    key: Vec<Key>,
    sections: Vec<Section>,
    /// One entry; several in a combined report.
    provenance: Vec<Provenance>,
}

/// A key number, listed at the top.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Key {
    name: String,
    number: Estimate,
}

/// All inputs that reproduce the report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// Commit that the program was built from, if the build stated it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commit: Option<String>,
    /// Seed of the noise; `None` without noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// All parameters, as in a file.
    pub parameters: String,
}

impl Provenance {
    /// Of this program. The commit is that of the environment variable `STICKSLIP_COMMIT` at build time: a build from
    /// an archive has none, and no build script is required.
    pub fn new(command: impl Into<String>, seed: Option<u64>, parameters: impl Into<String>) -> Self {
        let commit = option_env!("STICKSLIP_COMMIT").filter(|commit| !commit.is_empty()).map(Into::into);
        let version = env!("CARGO_PKG_VERSION").into();
        Provenance { command: command.into(), version, commit, seed, parameters: parameters.into() }
    }
}

/// A part of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", content = "content", rename_all = "lowercase")]
pub enum Section {
    /// The title of a report within a report.
    Part(String),
    /// The title of what follows.
    Heading(String),
    /// Some sentences.
    Paragraph(String),
    /// Sentences of equal rank.
    List(Vec<String>),
    /// Rows of text or of estimates.
    Table(Table),
    /// A figure with its caption: a description with the numbers.
    Figure {
        /// The figure.
        figure: Box<Figure>,
        /// The caption, without its number.
        caption: String,
    },
    /// A map with its caption; it counts as a figure.
    Map {
        /// The map.
        map: Box<Map>,
        /// The caption, without its number.
        caption: String,
    },
}

impl Report {
    /// A report without sections.
    pub fn new(title: impl Into<String>, provenance: Provenance) -> Self {
        let (title, provenance) = (title.into(), vec![provenance]);
        Self { title, summary: String::new(), key: Vec::new(), sections: Vec::new(), provenance }
    }

    /// Sets the summary: the results in one or two sentences with the numbers.
    pub fn summary(self, text: impl Into<String>) -> Self {
        Self { summary: text.into(), ..self }
    }

    /// Adds a key number; key numbers are listed below the summary.
    pub fn key(mut self, name: impl Into<String>, number: Estimate) -> Self {
        self.key.push(Key { name: name.into(), number });
        self
    }

    /// Adds a heading.
    pub fn heading(self, text: impl Into<String>) -> Self {
        self.section(Section::Heading(text.into()))
    }

    /// Adds a paragraph.
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.section(Section::Paragraph(text.into()))
    }

    /// Adds a list.
    pub fn list(self, items: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.section(Section::List(items.into_iter().map(Into::into).collect()))
    }

    /// Adds a table.
    pub fn table(self, table: Table) -> Self {
        self.section(Section::Table(table))
    }

    /// Adds a figure with its caption.
    pub fn figure(self, figure: Figure, caption: impl Into<String>) -> Self {
        self.section(Section::Figure { figure: Box::new(figure), caption: caption.into() })
    }

    /// Adds a map with its caption.
    pub fn map(self, map: Map, caption: impl Into<String>) -> Self {
        self.section(Section::Map { map: Box::new(map), caption: caption.into() })
    }

    /// Adds any section.
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// The summary: the results in words.
    pub fn summary_text(&self) -> &str {
        &self.summary
    }

    /// The key numbers by name.
    pub fn keys(&self) -> impl Iterator<Item = (&str, &Estimate)> {
        self.key.iter().map(|key| (key.name.as_str(), &key.number))
    }

    /// Its parts in their order.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// Provenance of its numbers; several entries in a combined report.
    pub fn provenance(&self) -> &[Provenance] {
        &self.provenance
    }

    /// The whole page.
    pub fn html(&self) -> String {
        html::page(self)
    }

    /// Writes the report, these figures as separate files, and last the summary, which lists all files of the folder.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn write_all<'a>(
        &self,
        mut summary: Summary,
        figures: impl IntoIterator<Item = (&'a str, &'a Figure)>,
        directory: &Path,
    ) -> Result<Summary, Error> {
        output::create_folder(directory)?;
        for (name, figure) in figures {
            output::write(&directory.join(name), figure.svg())?;
            summary.file(name);
        }
        for name in self.write(directory)? {
            summary.file(name);
        }
        summary.write(directory)?;
        Ok(summary)
    }

    /// Writes `report.json` and `report.html` into a folder; returns their names.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn write(&self, directory: &Path) -> Result<[&'static str; 2], Error> {
        let names = ["report.json", "report.html"];
        for (name, text) in names.into_iter().zip([self.to_json(), self.html()]) {
            output::write(&directory.join(name), text)?;
        }
        Ok(names)
    }
}

#[cfg(test)]
mod tests;
