//! Facts about a run from its own files.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use stickslip_core::fields::Field;

use stickslip_base::report::Report;
use stickslip_base::{Preset, input, parameters};
use stickslip_bench::run::{BEGIN, PRESET};
use stickslip_recording::mdf::Opened;

use super::run::{KeyNumber, Value};

/// Name of a record in a run's folder.
pub(super) const RECORD: &str = "run.mf4";
/// Name of a capture of the scope in a run's folder.
pub(crate) const CAPTURE: &str = "capture.mf4";
/// Points of a miniature.
const POINTS: usize = 64;

/// Facts about a run from its files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Facts {
    pub(super) kind: String,
    pub(super) command: String,
    pub(super) version: String,
    #[serde(skip)]
    pub(super) preset: String,
    pub(super) controller: String,
    pub(super) law: String,
    /// Bench time [s]. In the index it is part of the label.
    #[serde(skip)]
    pub(super) duration: Option<f64>,
    /// Start time of a record, since 1970 [s].
    #[serde(skip)]
    pub(super) begun: Option<f64>,
    pub(super) key: Option<KeyNumber>,
    pub(super) files: Vec<String>,
    pub(super) record: Option<String>,
    pub(super) curve: Vec<[f64; 2]>,
    pub(super) values: Vec<Value>,
    /// Additional words of the name, after the kind.
    #[serde(skip)]
    words: String,
}

/// Kind of each run that a command leaves, its words in a name, and its key result (empty: none).
const KINDS: [(&str, &str, &str); 23] = [
    ("demo", "demonstration", "render.rms_error_over_breakaway"),
    ("measure friction", "sweep", ""),
    ("measure breakaway", "breakaway", "measure.breakaway_torque"),
    ("measure presliding", "presliding", "measure.bristle_stiffness"),
    ("measure response", "frequency response", "measure.tacho.magnitude_deviation"),
    ("measure learning", "learning", "measure.factor"),
    ("measure tracking", "tracking", "measure.deviation"),
    ("trial", "test", "trial.tracking_rms"),
    ("hunting", "hunting", "hunting.amplitude"),
    ("loop", "position loop", "loop.sliding.sensitivity_peak"),
    ("friction", "library friction", "friction.breakaway_torque"),
    ("study", "study", "study.failed_cases"),
    ("load", "loaded external", ""),
    ("benchmark", "controllers compared", "benchmark.failed_runs"),
    ("calibrate", "calibration", "calibrate.load_inertia"),
    ("fit", "fit", "fit.breakaway_torque"),
    ("design", "design", "desired.breakaway_torque"),
    ("render", "rendered friction", "render.rms_error_over_breakaway"),
    ("report", "report", "report.rms_error"),
    ("fidelity", "trajectory equivalence", ""),
    ("identify", "identification", "inertia.mass"),
    ("validate", "validation", "prediction.position_rms"),
    ("capture", "capture", "capture.rows"),
];
/// Kind of a record alone.
pub(super) const RECORDING: &str = "recording";

impl Facts {
    /// Facts of a folder with a summary or a record, or of a record alone; `None` for anything else.
    pub(super) fn read(run: &Path) -> Option<Self> {
        let mut facts = Facts::default();
        if !run.is_dir() {
            facts.record = Some(run.file_name()?.to_string_lossy().into_owned());
            facts.files = facts.record.iter().cloned().collect();
            return facts.of_record(run).then_some(facts);
        }
        let record = run.join(RECORD);
        let has_summary = facts.of_summary(run);
        if record.is_file() {
            facts.record = Some(RECORD.into());
            if !facts.files.iter().any(|file| file == RECORD) {
                facts.files.push(RECORD.into());
            }
            // A report has the parameters already.
            if !has_summary {
                return facts.of_record(&record).then_some(facts);
            }
        }
        has_summary.then_some(facts)
    }

    /// The default name of a run.
    pub(super) fn name(&self, number: i64) -> String {
        let kind = KINDS.iter().find(|(kind, ..)| *kind == self.kind).map_or(self.kind.as_str(), |(_, words, _)| words);
        format!("run {number}, {kind}{}", self.words)
    }

    fn of_summary(&mut self, folder: &Path) -> bool {
        let Ok(text) = input::text(&folder.join("summary.json"), input::RESULT) else { return false };
        let Ok(summary) = serde_json::from_str::<Json>(&text) else { return false };
        if summary["schema"] != stickslip_base::summary::SCHEMA {
            return false;
        }
        let text = |name: &str| summary[name].as_str().unwrap_or_default().to_owned();
        (self.kind, self.version) = (text("command"), text("version"));
        let Some((_, _, key)) = KINDS.iter().find(|(kind, ..)| *kind == self.kind) else { return false };
        self.files =
            summary["files"].as_array().into_iter().flatten().filter_map(Json::as_str).map(Into::into).collect();
        for (path, result) in summary["results"].as_object().into_iter().flatten() {
            let (number, unit) = (result["value"].as_f64(), result["unit"].as_str().unwrap_or_default());
            self.values.push(Value {
                path: path.clone(),
                symbol: String::new(),
                unit: unit.into(),
                number,
                text: number.map_or("unknown".into(), |number| number.to_string()),
                result: true,
            });
        }
        self.curve = curve(&summary);
        let slowest = self.curve.iter().filter(|point| point[0] > 0.0).min_by(|a, b| a[0].total_cmp(&b[0])).copied();
        let named = self.result(key).map(|value| KeyNumber {
            name: (*key).into(),
            value: value.number.unwrap_or(f64::NAN),
            unit: value.unit.clone(),
        });
        self.key = named.filter(|key| key.value.is_finite()).or_else(|| {
            slowest.map(|[velocity, torque]| KeyNumber {
                name: format!("torque at {} rad/s", parameters::number::rounded(velocity, 2)),
                value: torque,
                unit: "N m".into(),
            })
        });
        let number = |name: &str| self.result(name).and_then(|value| value.number);
        let preload = ["measure.preload", "render.preload"].into_iter().find_map(number);
        let duration = ["measure.duration", "speed.bench_time", "calibrate.bench_time"].into_iter().find_map(number);
        self.duration = duration;
        // A trial is named by its motion.
        let motion = summary["rows"][0]["motion"].as_str().filter(|_| self.kind == "trial");
        let motion = motion.map_or(String::new(), |motion| format!(" {}", motion.replace('_', " ")));
        let wheel: String = match preload {
            Some(0.0) => " without wheel".into(),
            Some(1.0) => " with wheel".into(),
            Some(preload) => format!(" with wheel at {}", parameters::number::rounded(preload, 2)),
            None => String::new(),
        };
        self.words = motion + &wheel;
        if let Ok(report) = Report::read(folder)
            && let Some(provenance) = report.provenance().first()
        {
            self.command = provenance.command.clone();
            self.preset = preset(&self.command);
            self.of_parameters(&provenance.parameters);
        } else if let Ok(opened) = Opened::open(&folder.join(RECORD)) {
            // Stopped before the first result.
            self.of_attached(&opened);
        }
        true
    }

    /// Reads a record. Returns whether it is one of a run.
    fn of_record(&mut self, record: &Path) -> bool {
        let Ok(opened) = Opened::open(record) else { return false };
        let contents = opened.head();
        let property = |name: &str| {
            contents.header.properties.iter().find(|(other, _)| other == name).map(|(_, value)| value.as_str())
        };
        if property("schema") != Some(stickslip_bench::run::SCHEMA) {
            return false;
        }
        self.kind = RECORDING.into();
        self.command = contents.header.comment.clone();
        self.version = contents.header.version.clone();
        self.preset = preset(&self.command);
        let tick = property("tick_time").and_then(|time| time.parse::<f64>().ok());
        self.duration = tick.map(|tick| tick * opened.len() as f64);
        let start = contents.header.start.duration_since(std::time::UNIX_EPOCH);
        let first = contents.events.iter().find(|(_, event)| event.name == BEGIN).map_or(0, |(_, event)| event.cycle);
        self.begun = start.ok().map(|start| start.as_secs_f64() + first as f64 * tick.unwrap_or_default());
        self.of_attached(&opened);
        true
    }

    /// Reads the parameters in a record.
    fn of_attached(&mut self, record: &Opened) {
        let attached = record.head().attachments.iter().find(|file| file.name == PRESET);
        if let Some(text) = attached.and_then(|file| std::str::from_utf8(&file.bytes).ok()) {
            self.of_parameters(text);
        }
    }

    fn result(&self, name: &str) -> Option<&Value> {
        self.values.iter().find(|value| value.result && value.path == name)
    }

    /// Adds all values of a parameter file.
    fn of_parameters(&mut self, text: &str) {
        let Ok(table) = text.parse::<toml::Table>() else { return };
        let rows = parameters::describe::<Preset<f64>>("").unwrap_or_default();
        let field = |path: &str| rows.iter().find(|row| row.path == path).and_then(|row| row.field);
        collect(&toml::Value::Table(table), "", &field, &mut self.values);
        let text = |path: &str| self.values.iter().find(|value| value.path == path).map(|value| value.text.clone());
        self.controller = text("bench.controller.kind").unwrap_or_default();
        self.law = text("bench.law.kind").unwrap_or_default();
    }
}

fn collect(value: &toml::Value, path: &str, field: &impl Fn(&str) -> Option<&'static Field>, to: &mut Vec<Value>) {
    let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    let (number, text) = match value {
        toml::Value::Table(table) => {
            return table.iter().for_each(|(name, value)| collect(value, &below(name), field, to));
        }
        toml::Value::Array(values) => {
            let values = values.iter().enumerate();
            return values.for_each(|(index, value)| collect(value, &below(&index.to_string()), field, to));
        }
        toml::Value::String(text) => (None, text.clone()),
        toml::Value::Integer(number) => (Some(*number as f64), number.to_string()),
        toml::Value::Float(number) => (Some(*number), number.to_string()),
        toml::Value::Boolean(flag) => (Some(f64::from(u8::from(*flag))), flag.to_string()),
        toml::Value::Datetime(time) => (None, time.to_string()),
    };
    let field = field(path);
    to.push(Value {
        path: path.into(),
        symbol: field.map_or("", |field| field.symbol).into(),
        unit: field.map_or("", |field| field.unit).into(),
        number,
        text,
        result: false,
    });
}

/// The preset in a command line.
fn preset(command: &str) -> String {
    let mut words = command.split_whitespace();
    words.find(|word| word.starts_with("--preset")).map_or(String::new(), |word| match word.split_once('=') {
        Some((_, name)) => name.into(),
        None => words.next().unwrap_or_default().into(),
    })
}

/// The friction curve of a summary, reduced to [`POINTS`] points.
fn curve(summary: &Json) -> Vec<[f64; 2]> {
    let rows: Vec<&Json> = summary["rows"].as_array().into_iter().flatten().collect();
    let of = |row: &Json| ["measurement", "fit"].into_iter().find_map(|name| row[name].as_str().map(str::to_owned));
    let names: Vec<String> = rows.iter().filter_map(|row| of(row)).collect();
    let best = ["rendered", "own"].into_iter().find(|best| names.iter().any(|name| name == best));
    let best = best.map(str::to_owned).or_else(|| names.first().cloned());
    let is_of_best = |row: &&&Json| of(row) == best && row["counts"].as_bool().unwrap_or(true);
    let point = |row: &&Json| Some([row["velocity"].as_f64()?, row["torque"].as_f64()?]);
    let mut points: Vec<[f64; 2]> = rows.iter().filter(is_of_best).filter_map(point).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let step = points.len().div_ceil(POINTS).max(1);
    points.into_iter().step_by(step).collect()
}
