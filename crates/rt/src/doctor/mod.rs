//! What of a machine's set-up costs determinism, and the command that mends it.
//!
//! Everything is read from files of Linux below a folder, `/` or a made-up one. What a machine then does, only a
//! measurement tells.

mod cpu;
mod memory;
mod scheduler;
#[cfg(test)]
mod tests;

use std::fs;
use std::path::{Path, PathBuf};

use crate::setup::last_of;

/// One look at the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What was looked at.
    pub what: &'static str,
    /// What is there.
    pub found: String,
    /// Whether that costs anything.
    pub verdict: Verdict,
    /// What it costs, or would cost.
    pub costs: &'static str,
    /// The command that mends it, where there is one.
    pub mend: Option<String>,
}

/// Whether a finding costs determinism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As it should be.
    Good,
    /// It costs.
    Costs,
    /// The system does not say.
    Unknown,
}

/// All findings of the machine whose files are below `root`.
pub fn examine(root: &Path) -> Vec<Finding> {
    let files = Files::below(root);
    [scheduler::findings(&files), cpu::findings(&files), memory::findings(&files)].concat()
}

/// How much memory this process may lock [bytes], where that is limited as far as the files below `root` tell.
pub(crate) fn lockable(root: &Path) -> Option<u64> {
    scheduler::lockable(&Files::below(root)).unwrap_or(None)
}

impl Finding {
    fn good(what: &'static str, found: impl Into<String>, costs: &'static str) -> Self {
        Finding { what, found: found.into(), verdict: Verdict::Good, costs, mend: None }
    }

    fn costs(what: &'static str, found: impl Into<String>, costs: &'static str, mend: Option<String>) -> Self {
        Finding { what, found: found.into(), verdict: Verdict::Costs, costs, mend }
    }

    fn unknown(what: &'static str, costs: &'static str) -> Self {
        Finding { what, found: "the system does not say".into(), verdict: Verdict::Unknown, costs, mend: None }
    }
}

/// The files of a machine.
struct Files {
    root: PathBuf,
    /// The CPU that the executive gets: the last isolated one, else the last.
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

    /// A text without the space around it; `None` where there is none.
    fn read(&self, path: &str) -> Option<String> {
        fs::read_to_string(self.root.join(path)).ok().map(|text| text.trim().to_string())
    }

    /// A file of the executive's CPU.
    fn read_of_cpu(&self, path: &str) -> Option<String> {
        self.read(&format!("sys/devices/system/cpu/cpu{}/{path}", self.cpu))
    }
}
