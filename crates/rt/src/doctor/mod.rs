//! Settings of a computer that cost determinism, each with the command that corrects it.
//!
//! All findings come from Linux files below a folder, `/` or that of a test. The actual timing must be measured.

mod cpu;
mod memory;
pub mod network;
mod scheduler;
#[cfg(test)]
mod tests;

use std::fs;
use std::path::{Path, PathBuf};

use crate::setup::last_of;

/// Value of a setting that is unknown.
pub const NOT_REPORTED: &str = "not reported by the system";

/// One examined setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Name of the setting.
    pub what: &'static str,
    /// Present value.
    pub found: String,
    /// Whether the value costs determinism.
    pub verdict: Verdict,
    /// Effect of an unfavourable value.
    pub costs: &'static str,
    /// Command that corrects it, if there is one.
    pub remedy: Option<String>,
}

/// Whether a finding costs determinism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Favourable.
    Good,
    /// Unfavourable.
    Costs,
    /// Not reported by the system.
    Unknown,
}

/// All findings for the files below `root`.
pub fn examine(root: &Path) -> Vec<Finding> {
    let files = Files::below(root);
    [scheduler::findings(&files), cpu::findings(&files), memory::findings(&files)].concat()
}

/// Limit of the memory that this process may lock [bytes], if the files below `root` state one.
pub(crate) fn lockable(root: &Path) -> Option<u64> {
    scheduler::lockable(&Files::below(root)).unwrap_or(None)
}

impl Finding {
    /// A favourable setting.
    pub fn good(what: &'static str, found: impl Into<String>, costs: &'static str) -> Self {
        Finding { what, found: found.into(), verdict: Verdict::Good, costs, remedy: None }
    }

    /// An unfavourable setting.
    pub fn costs(what: &'static str, found: impl Into<String>, costs: &'static str, remedy: Option<String>) -> Self {
        Finding { what, found: found.into(), verdict: Verdict::Costs, costs, remedy }
    }

    /// A setting that the system does not report.
    pub fn unknown(what: &'static str, costs: &'static str) -> Self {
        Finding { what, found: NOT_REPORTED.into(), verdict: Verdict::Unknown, costs, remedy: None }
    }
}

/// The files of a computer.
struct Files {
    root: PathBuf,
    /// CPU of the executive: the last isolated one, else the last.
    cpu: usize,
}

impl Files {
    fn below(root: &Path) -> Self {
        let mut files = Files { root: root.into(), cpu: 0 };
        let last = |list| files.read(list).and_then(|list| last_of(&list));
        files.cpu =
            last("sys/devices/system/cpu/isolated").or_else(|| last("sys/devices/system/cpu/online")).unwrap_or(0);
        files
    }

    /// Trimmed text of a file; `None` without one.
    fn read(&self, path: &str) -> Option<String> {
        fs::read_to_string(self.root.join(path)).ok().map(|text| text.trim().to_string())
    }

    /// A file of the executive's CPU.
    fn read_of_cpu(&self, path: &str) -> Option<String> {
        self.read(&format!("sys/devices/system/cpu/cpu{}/{path}", self.cpu))
    }
}
