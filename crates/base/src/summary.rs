//! `summary.json`: the results of a command, for scripts.
//!
//! `{"schema": "stickslip.summary/1", "command", "version", "results": {NAME: {"value", "unit", "ci95"?}}, "rows"?,
//! "notes"?, "files"?}`. Names are dotted, values SI, torques on the screw. The same results give the same bytes, in any order of
//! the calls: names are sorted, rows and files keep their order, a number that is not finite is `null`.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::parameters::number::rounded;
use crate::quantity::Estimate;
use crate::{Error, output};

/// Schema of a summary.
pub const SCHEMA: &str = "stickslip.summary/1";

/// The results of one run of a command.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    schema: &'static str,
    command: String,
    version: &'static str,
    results: BTreeMap<String, Quantity>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    rows: Vec<Row>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    files: Vec<String>,
}

/// A number with its unit.
#[derive(Clone, Debug, Serialize)]
struct Quantity {
    value: f64,
    unit: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    ci95: Option<[f64; 2]>,
}

/// Named values in the order given.
#[derive(Clone, Debug)]
struct Row(Vec<(String, Value)>);

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl Summary {
    /// Of the command `stickslip COMMAND`, without results yet.
    pub fn new(command: &str) -> Self {
        Summary {
            schema: SCHEMA,
            command: command.into(),
            version: env!("CARGO_PKG_VERSION"),
            results: BTreeMap::new(),
            rows: Vec::new(),
            notes: Vec::new(),
            files: Vec::new(),
        }
    }

    /// Adds a result: dotted name, SI value, unit ("1" for a pure number).
    pub fn result(&mut self, name: &str, value: f64, unit: &str) -> &mut Self {
        self.add(name, Quantity { value, unit: unit.into(), ci95: None })
    }

    /// Adds a result with the ends of its 95 % confidence interval.
    pub fn with_interval(&mut self, name: &str, value: f64, ci95: [f64; 2], unit: &str) -> &mut Self {
        self.add(name, Quantity { value, unit: unit.into(), ci95: Some(ci95) })
    }

    fn add(&mut self, name: &str, quantity: Quantity) -> &mut Self {
        let old = self.results.insert(name.into(), quantity);
        debug_assert!(old.is_none(), "two results have the name {name}");
        self
    }

    /// Adds a row of a table: names and values (`"clm-bench".into()`, `0.3.into()`, `true.into()`).
    pub fn row<'a>(&mut self, cells: impl IntoIterator<Item = (&'a str, Value)>) -> &mut Self {
        self.rows.push(Row(cells.into_iter().map(|(name, value)| (name.into(), value)).collect()));
        self
    }

    /// Adds a sentence on the data: what was found and corrected.
    pub fn note(&mut self, text: impl Into<String>) -> &mut Self {
        self.notes.push(text.into());
        self
    }

    /// The sentences, in order.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Adds a file that the command wrote, relative to the folder of the summary.
    pub fn file(&mut self, name: &str) -> &mut Self {
        self.files.push(name.into());
        self
    }

    /// The value of a result.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.results.get(name).map(|quantity| quantity.value)
    }

    /// A result for readers: with half the width of its interval and its unit.
    pub fn estimate(&self, name: &str) -> Option<Estimate> {
        let Quantity { value, unit, ci95 } = self.results.get(name)?;
        let half_width = ci95.map(|[low, high]| 0.5 * (high - low));
        Some(Estimate { value: *value, half_width, unit: unit.clone() })
    }

    /// The text of `summary.json`.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("strings, numbers and maps with string keys");
        text.push('\n');
        text
    }

    /// Writes `summary.json` into a folder, which is created if it does not exist.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn write(&self, directory: &Path) -> Result<(), Error> {
        output::create_folder(directory)?;
        output::write(&directory.join("summary.json"), self.to_json())
    }
}

/// The results as lines for a terminal: name, value, unit, interval.
impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let width = self.results.keys().map(String::len).max().unwrap_or(0);
        for (name, Quantity { value, unit, ci95 }) in &self.results {
            let unit = if unit == "1" { "" } else { unit };
            write!(f, "{name:width$}  {} {unit}", rounded(*value, 5))?;
            match ci95 {
                Some([low, high]) => writeln!(f, "  [{} … {}]", rounded(*low, 5), rounded(*high, 5))?,
                None => writeln!(f)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Summary {
        let mut summary = Summary::new("demo");
        summary
            .result("speed.real_time_factor", 12.0, "1")
            .with_interval("measure.breakaway_torque", 0.1 + 0.2, [0.25, f64::INFINITY], "N m")
            .result("measure.broken", f64::NAN, "rad/s")
            .row([("preset", "clm-bench".into()), ("difference", f64::NAN.into()), ("auto", true.into())])
            .file("report.html");
        summary
    }

    #[test]
    fn a_summary_has_its_documented_form() {
        let expected = r#"{
  "schema": "stickslip.summary/1",
  "command": "demo",
  "version": "VERSION",
  "results": {
    "measure.breakaway_torque": {
      "value": 0.30000000000000004,
      "unit": "N m",
      "ci95": [
        0.25,
        null
      ]
    },
    "measure.broken": {
      "value": null,
      "unit": "rad/s"
    },
    "speed.real_time_factor": {
      "value": 12.0,
      "unit": "1"
    }
  },
  "rows": [
    {
      "preset": "clm-bench",
      "difference": null,
      "auto": true
    }
  ],
  "files": [
    "report.html"
  ]
}
"#;
        assert_eq!(example().to_json(), expected.replace("VERSION", env!("CARGO_PKG_VERSION")));
    }

    #[test]
    fn the_order_of_the_calls_has_no_effect() {
        let (mut a, mut b) = (Summary::new("demo"), Summary::new("demo"));
        a.result("x.a", 1.0, "1").result("x.b", 2.0, "1");
        b.result("x.b", 2.0, "1").result("x.a", 1.0, "1");
        assert_eq!(a.to_json(), b.to_json());
    }

    #[test]
    #[should_panic(expected = "two results have the name x")]
    fn a_name_given_twice_is_a_mistake_of_the_program() {
        Summary::new("demo").result("x", 1.0, "1").result("x", 2.0, "1");
    }

    #[test]
    fn a_summary_lands_in_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("stickslip-out/demo");
        example().write(&out).unwrap();
        assert_eq!(std::fs::read_to_string(out.join("summary.json")).unwrap(), example().to_json());
    }
}
