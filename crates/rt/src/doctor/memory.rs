//! Memory: whether it stays, and in which pieces it comes.

use super::scheduler::lockable;
use super::{Files, Finding};
use crate::setup::ThreadSetting;

pub(super) fn findings(files: &Files) -> Vec<Finding> {
    vec![locking(files), swap(files), huge_pages(files)]
}

fn locking(files: &Files) -> Finding {
    let (what, wish) = ("locked memory", ThreadSetting::LockedMemory);
    match lockable(files) {
        Ok(None) => Finding::good(what, "permitted", wish.costs()),
        Ok(Some(bytes)) => Finding::costs(what, format!("{} MiB permitted", bytes >> 20), wish.costs(), wish.mend()),
        Err(()) => Finding::unknown(what, wish.costs()),
    }
}

fn swap(files: &Files) -> Finding {
    let (what, costs) = ("swap", "Memory that is not locked may be on a disk when a cycle needs it.");
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
        "The kernel gathers memory into large pages when it likes; a fault clears 2 MiB instead of 4 KiB.",
    );
    match files.read("sys/kernel/mm/transparent_hugepage/enabled") {
        None => Finding::unknown(what, costs),
        Some(choice) if choice.contains("[always]") => {
            let mend = "echo madvise | sudo tee /sys/kernel/mm/transparent_hugepage/enabled";
            Finding::costs(what, "unasked", costs, Some(mend.into()))
        }
        Some(_) => Finding::good(what, "only where asked for", costs),
    }
}
