//! Memory: locking, swap and huge pages.

use super::scheduler::lockable;
use super::{Files, Finding};
use crate::setup::ThreadSetting;

pub(super) fn findings(files: &Files) -> Vec<Finding> {
    vec![locking(files), swap(files), huge_pages(files)]
}

fn locking(files: &Files) -> Finding {
    let (what, setting) = ("locked memory", ThreadSetting::LockedMemory);
    match lockable(files) {
        Ok(None) => Finding::good(what, "permitted", setting.costs()),
        Ok(Some(bytes)) => {
            Finding::costs(what, format!("{} MiB permitted", bytes >> 20), setting.costs(), setting.remedy())
        }
        Err(()) => Finding::unknown(what, setting.costs()),
    }
}

fn swap(files: &Files) -> Finding {
    let (what, costs) = ("swap", "Memory that is not locked may be on disk when a cycle needs it.");
    let Some(table) = files.read("proc/swaps") else { return Finding::unknown(what, costs) };
    let places = table.lines().count().saturating_sub(1);
    match (places, lockable(files)) {
        (0, _) => Finding::good(what, "none", costs),
        (_, Ok(None)) => Finding::good(what, "on, but memory can be locked", costs),
        _ => Finding::costs(what, "on", costs, Some("sudo swapoff --all".into())),
    }
}

fn huge_pages(files: &Files) -> Finding {
    let (what, costs) = (
        "huge pages",
        "The kernel may merge memory into large pages at any time; a page fault then clears 2 MiB instead of 4 KiB.",
    );
    match files.read("sys/kernel/mm/transparent_hugepage/enabled") {
        None => Finding::unknown(what, costs),
        Some(choice) if choice.contains("[always]") => {
            let remedy = "echo madvise | sudo tee /sys/kernel/mm/transparent_hugepage/enabled";
            Finding::costs(what, "always", costs, Some(remedy.into()))
        }
        Some(_) => Finding::good(what, "only on request", costs),
    }
}
