//! `run.json`: data of a run that are not among its results.

use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use stickslip_base::{Error, input, output};

const SCHEMA: &str = "stickslip.run-label/1";

/// Number, name, and texts of the user.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Label {
    pub(super) schema: String,
    /// Distinguishes the run from a copy and from another run of the same number.
    pub(super) identity: String,
    pub(super) number: i64,
    pub(super) name: String,
    /// RFC 3339, UTC.
    pub(super) begun: String,
    /// Bench time, or elapsed time of a run without a bench [s].
    pub(super) duration: Option<f64>,
    pub(super) preset: String,
    #[serde(default)]
    pub(super) tags: Vec<String>,
    #[serde(default)]
    pub(super) note: String,
    /// Why the run was not completed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) incomplete: Option<String>,
    /// Whether its record was made automatically, so that it may be removed for newer ones.
    #[serde(default, skip_serializing_if = "is_false")]
    pub(super) automatic: bool,
    /// Whether its record was removed for newer ones.
    #[serde(default, skip_serializing_if = "is_false")]
    pub(super) record_removed: bool,
    /// Time of deletion, and its place before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) deleted: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) origin: Option<String>,
}

impl Label {
    pub(super) fn new(identity: String) -> Self {
        Label { schema: SCHEMA.into(), identity, ..Label::default() }
    }

    /// Reads the label of a run's folder or file.
    pub(super) fn read(run: &Path) -> Option<Self> {
        let text = input::text(&file(run), input::RESULT).ok()?;
        serde_json::from_str(&text).ok().filter(|label: &Label| label.schema == SCHEMA)
    }

    pub(super) fn write(&self, run: &Path) -> Result<(), Error> {
        let mut text = serde_json::to_string_pretty(self).expect("strings and numbers");
        text.push('\n');
        output::write(&file(run), text)
    }
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// Path of the label.
pub(super) fn file(run: &Path) -> PathBuf {
    if run.is_dir() {
        return run.join("run.json");
    }
    let name = run.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    run.with_file_name(format!("{name}.run.json"))
}

/// A unique identity, also across projects.
pub(super) fn identity() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    format!("{now:x}-{:x}-{:x}", process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}
