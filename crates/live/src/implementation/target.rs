//! The program that runs, and what the system gave it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_rt::Granted;

/// What runs, and since when.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Target {
    /// Version of the program.
    pub version: String,
    /// What it was built for: processor, system, and whether overflows are checked.
    pub built: String,
    /// Where the machine is: `virtual`, or its address.
    pub machine: String,
    /// When it was started: seconds since 1970 [s].
    pub since: f64,
    /// Ticks in a second [Hz].
    pub rate: f64,
    /// What the real-time thread asked of the system.
    pub wishes: Vec<SettingResult>,
    /// What can be taken along, at `/implementation/FILE`.
    pub files: Vec<TargetFile>,
}

/// A file of what runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TargetFile {
    /// Its path.
    pub file: String,
    /// What it is called.
    pub name: String,
    /// What is in it.
    pub about: String,
}

/// Path, name, content.
const FILES: [[&str; 3]; 5] = [
    ["tick.zip", "C project", "code, self-test, example, page and diagram"],
    ["tick.h", "C header", "parameters, inputs, outputs"],
    ["tick.c", "C source", "all that goes onto a target"],
    ["bench.a2l", "A2L", "for measurement and calibration tools"],
    ["diagram/tick.svg", "Diagram", "the whole tick as SVG"],
];

/// What became of a wish.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SettingResult {
    /// What was asked for.
    pub wish: String,
    /// What the system said where it refused.
    pub refused: Option<String>,
    /// What the refusal costs; empty where it was granted.
    pub costs: String,
    /// The command that mends it.
    pub mend: Option<String>,
}

impl Target {
    pub(crate) fn new(machine: String, granted: Option<&Granted>) -> Self {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        let checks = if cfg!(debug_assertions) { ", with checks" } else { "" };
        let outcomes = granted.map(|granted| granted.outcomes.as_slice()).unwrap_or_default();
        Target {
            version: env!("CARGO_PKG_VERSION").into(),
            built: format!("{} {}{checks}", std::env::consts::ARCH, std::env::consts::OS),
            machine,
            since: since.as_secs_f64(),
            rate: 0.0,
            wishes: outcomes
                .iter()
                .map(|outcome| SettingResult {
                    wish: outcome.wish.to_string(),
                    costs: outcome.refused.as_ref().map_or("", |_| outcome.wish.costs()).into(),
                    mend: outcome.refused.as_ref().and_then(|_| outcome.wish.mend()),
                    refused: outcome.refused.clone(),
                })
                .collect(),
            files: FILES
                .map(|[file, name, about]| TargetFile { file: file.into(), name: name.into(), about: about.into() })
                .into(),
        }
    }
}
