//! `run.json`: what belongs to a run and stands in no result of it.

use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use stickslip_base::{Error, output};

const SCHEMA: &str = "stickslip.run-label/1";

/// Number, name and whatever a person wrote.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Label {
    pub(super) schema: String,
    /// Told from a copy of it, and from another run of the same number, by this.
    pub(super) identity: String,
    pub(super) number: i64,
    pub(super) name: String,
    /// RFC 3339, UTC.
    pub(super) begun: String,
    /// Time on the bench, or on the clock where there was no bench [s].
    pub(super) duration: Option<f64>,
    pub(super) preset: String,
    #[serde(default)]
    pub(super) tags: Vec<String>,
    #[serde(default)]
    pub(super) note: String,
    /// When it was deleted, and where it lay.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) deleted: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) origin: Option<String>,
}

impl Label {
    pub(super) fn new(identity: String) -> Self {
        Label { schema: SCHEMA.into(), identity, ..Label::default() }
    }

    /// Of a run's folder, or of the file that it consists of.
    pub(super) fn read(run: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(file(run)).ok()?;
        serde_json::from_str(&text).ok().filter(|label: &Label| label.schema == SCHEMA)
    }

    pub(super) fn write(&self, run: &Path) -> Result<(), Error> {
        let mut text = serde_json::to_string_pretty(self).expect("strings and numbers");
        text.push('\n');
        output::write(&file(run), text)
    }
}

/// Where it stands.
pub(super) fn file(run: &Path) -> PathBuf {
    if run.is_dir() {
        return run.join("run.json");
    }
    let name = run.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    run.with_file_name(format!("{name}.run.json"))
}

/// One that no other run has, here or elsewhere.
pub(super) fn identity() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    format!("{now:x}-{:x}-{:x}", process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}
