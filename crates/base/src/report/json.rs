//! `report.json`: the document as data, `{"schema": "stickslip.report/1", "title", "summary", "key", "sections",
//! "provenance"}`. An unknown number is `null`; every number reads back with the same bits.

use std::io::{self, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::error::Category;
use serde_json::ser::Formatter;

use super::Report;
use crate::{Error, input};

const SCHEMA: &str = "stickslip.report/1";
/// Common start of the schemas of all versions.
const FAMILY: &str = "stickslip.report/";

/// The document with its schema.
#[derive(Serialize)]
struct Saved<'a> {
    schema: &'a str,
    #[serde(flatten)]
    report: &'a Report,
}

/// The schema alone.
#[derive(Deserialize)]
struct Schema {
    schema: Option<String>,
}

/// One object per line: easy to read, and an error has a line.
struct Lines;

impl Formatter for Lines {
    fn begin_object<W: ?Sized + Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b"\n{")
    }
}

impl Report {
    /// The text of `report.json`.
    pub fn to_json(&self) -> String {
        let mut bytes = Vec::new();
        let mut serializer = serde_json::Serializer::with_formatter(&mut bytes, Lines);
        let saved = Saved { schema: SCHEMA, report: self };
        saved.serialize(&mut serializer).expect("strings and numbers, into memory");
        bytes.push(b'\n');
        String::from_utf8(bytes).expect("JSON is text").trim_start().into()
    }

    /// A document from the text of `report.json`.
    ///
    /// # Errors
    /// [`Error::Document`] with the place of the error.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        Self::parse(text, Path::new("report.json"))
    }

    /// Reads `report.json` of a folder, or the file itself.
    ///
    /// # Errors
    /// [`Error::File`] if there is none, [`Error::Document`] if it is not a report.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let file = if path.is_dir() { path.join("report.json") } else { path.into() };
        let text = input::text(&file, input::RESULT)?;
        Self::parse(&text, &file)
    }

    fn parse(text: &str, path: &Path) -> Result<Self, Error> {
        let invalid = |error: serde_json::Error| Error::Document {
            path: path.into(),
            place: Some([error.line(), error.column()]),
            reason: reason(&error),
            remedy: match error.classify() {
                Category::Eof => "The file ends too early: copy it again, or run the command that wrote it.",
                _ => "Repeat the command that wrote it; do not edit a report by hand.",
            },
        };
        let external = |reason: String, remedy| Error::Document { path: path.into(), place: None, reason, remedy };
        match serde_json::from_str::<Schema>(text).map_err(invalid)?.schema.as_deref() {
            Some(SCHEMA) => serde_json::from_str(text).map_err(invalid),
            Some(other) if other.starts_with(FAMILY) => {
                let reason = format!("its schema is {other:?}; this program reads {SCHEMA:?}");
                Err(external(reason, "Use the version of stickslip that wrote it, or a newer one."))
            }
            Some(other) => {
                let reason = format!("its schema is {other:?}; that of a report is {SCHEMA:?}");
                Err(external(reason, "Name a folder with a report.json in it."))
            }
            None => {
                let reason = format!("it has no schema; that of a report is {SCHEMA:?}");
                Err(external(reason, "Name a folder with a report.json in it."))
            }
        }
    }
}

/// The message without the place, which is a separate field.
fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.rsplit_once(" at line ").map_or(text.as_str(), |(reason, _)| reason).to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::tests::report;
    use super::*;

    #[test]
    fn a_saved_document_gives_the_same_bytes_of_json_and_of_html() {
        let report = report("Saved");
        let json = report.to_json();
        let read = Report::from_json(&json).unwrap();
        assert_eq!(read.to_json(), json);
        assert_eq!(read.html(), report.html());
        assert!(json.starts_with("{\"schema\":\"stickslip.report/1\",\"title\":\"Saved\""), "{json}");
        // The third row of the table of estimates is unknown, and stays unknown.
        assert!(json.contains("\"value\":null,\"half_width\":0.1,\"unit\":\"rad/s\""), "{json}");
    }

    #[test]
    fn numbers_keep_their_bits() {
        use crate::figure::{Axis, Data, Figure, Role, Series};
        let values: Vec<f64> = (0..2000).map(|k| libm::exp(0.31 * f64::from(k) - 310.0) / 3.0).collect();
        let line = Series::line(Role::Fitted, "fit", values.iter().map(|&value| (value, -value)));
        let figure = Figure::new("Bits").x(Axis::new("speed", "rad/s")).series(line);
        let copy: Figure = serde_json::from_str(&serde_json::to_string(&figure).unwrap()).unwrap();
        let Data::Line(rows) = &copy.series[0].data else { panic!("a line stays a line") };
        assert!(rows.iter().zip(&values).all(|(row, value)| row[0].to_bits() == value.to_bits()));
    }

    #[test]
    fn a_broken_file_is_named_with_place_and_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.json");
        let json = report("Broken").to_json();
        for (text, expected) in [
            (json[..json.len() - 20].to_owned(), ["report.json:", "EOF while parsing", "ends too early"]),
            (
                json.replace("\"heading\"", "\"haeding\""),
                ["report.json:", "unknown variant `haeding`", "Repeat the command"],
            ),
            (json.replace("[0.0,0.3]", "[0.0]"), ["report.json:", "a row of 1 numbers; 2 expected", "Repeat"]),
            (json.replace("report/1", "report/2"), ["report.json: ", "its schema is \"stickslip.report/2\"", "newer"]),
            (
                json.replace("report/1", "SUMMARY").replace("stickslip.SUMMARY", "stickslip.summary/1"),
                ["report.json: ", "\"stickslip.summary/1\"", "Name a folder with a report.json"],
            ),
            ("{}".to_owned(), ["report.json: ", "it has no schema", "Name a folder"]),
            ("\"text\"".to_owned(), ["report.json:1:", "invalid type: string", "Repeat"]),
        ] {
            std::fs::write(&path, &text).unwrap();
            let message = Report::read(folder.path()).unwrap_err().to_string();
            for part in expected {
                assert!(message.contains(part), "{part}: {message}");
            }
        }
        let absent = Report::read(&folder.path().join("nowhere")).unwrap_err().to_string();
        assert!(absent.contains("nowhere: cannot read it"), "{absent}");
    }
}
