//! The running program, and the settings granted by the system.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stickslip_rt::Granted;

/// The running program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Target {
    /// Version of the program.
    pub version: String,
    /// Target of the build: processor, system, and whether overflows are checked.
    pub built: String,
    /// The machine: `virtual`, or its address.
    pub machine: String,
    /// Start time: seconds since 1970 [s].
    pub since: f64,
    /// Tick rate [Hz].
    pub rate: f64,
    /// Requested settings of the real-time thread, each with its result.
    pub thread_settings: Vec<SettingResult>,
    /// Files for download, at `/implementation/FILE`.
    pub files: Vec<TargetFile>,
}

/// A file of the running software.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TargetFile {
    /// Its path.
    pub file: String,
    /// Name.
    pub name: String,
    /// Content.
    pub about: String,
}

/// Path, name, content.
const FILES: [[&str; 3]; 5] = [
    ["tick.zip", "C project", "code, self-test, example, page and diagram"],
    ["tick.h", "C header", "parameters, inputs, outputs"],
    ["tick.c", "C source", "complete code for a target"],
    ["bench.a2l", "A2L", "for measurement and calibration tools"],
    ["diagram/tick.svg", "Diagram", "the whole tick as SVG"],
];

/// Result of a requested setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SettingResult {
    /// The requested setting.
    pub setting: String,
    /// Message of the system, if it refused.
    pub refused: Option<String>,
    /// Effect of the refusal; empty if granted.
    pub costs: String,
    /// The command that fixes it.
    pub remedy: Option<String>,
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
            thread_settings: outcomes
                .iter()
                .map(|outcome| SettingResult {
                    setting: outcome.setting.to_string(),
                    costs: outcome.refused.as_ref().map_or("", |_| outcome.setting.costs()).into(),
                    remedy: outcome.refused.as_ref().and_then(|_| outcome.setting.remedy()),
                    refused: outcome.refused.clone(),
                })
                .collect(),
            files: FILES
                .map(|[file, name, about]| TargetFile { file: file.into(), name: name.into(), about: about.into() })
                .into(),
        }
    }
}
