//! Who may run when: the kernel's preemption, permissions, and the machine below.

use super::{Files, Finding};
use crate::setup::ThreadSetting;

/// Bits of a set of capabilities.
const IPC_LOCK: u32 = 14;
const SYS_NICE: u32 = 23;

pub(super) fn findings(files: &Files) -> Vec<Finding> {
    vec![kernel(files), hypervisor(files), priority(files), throttling(files)]
}

fn kernel(files: &Files) -> Finding {
    let (what, costs) =
        ("kernel", "Parts of the kernel that nothing interrupts delay a wake-up, rarely, by up to milliseconds.");
    let Some(version) = files.read("proc/version") else { return Finding::unknown(what, costs) };
    if files.read("sys/kernel/realtime").as_deref() == Some("1") || version.contains("PREEMPT_RT") {
        return Finding::good(what, "real-time preemption (PREEMPT_RT)", costs);
    }
    let model = version.split_whitespace().find(|word| word.starts_with("PREEMPT")).unwrap_or("no preemption");
    let package = if cfg!(target_arch = "aarch64") { "linux-image-rt-arm64" } else { "linux-image-rt-amd64" };
    let mend = format!("sudo apt install {package} && sudo reboot");
    Finding::costs(what, format!("{model}, not PREEMPT_RT"), costs, Some(mend))
}

fn hypervisor(files: &Files) -> Finding {
    let (what, costs) = (
        "machine",
        "It may stand still for milliseconds, unseen by its own system: no maximum holds that is measured here.",
    );
    let named = files.read("sys/hypervisor/type").filter(|name| !name.is_empty());
    let cpuinfo = files.read("proc/cpuinfo").unwrap_or_default();
    let mut flags = cpuinfo.lines().filter(|line| line.starts_with("flags"));
    if named.is_some() || flags.clone().any(|line| line.split_whitespace().any(|flag| flag == "hypervisor")) {
        let kind = named.map(|name| format!(" ({name})")).unwrap_or_default();
        return Finding::costs(what, format!("virtual{kind}"), costs, None);
    }
    if flags.next().is_some() {
        Finding::good(what, "no hypervisor shows", costs)
    } else {
        Finding::unknown(what, costs)
    }
}

fn priority(files: &Files) -> Finding {
    let (what, wish) = ("real-time priority", ThreadSetting::Priority(80));
    match (capability(files, SYS_NICE), limit(files, "Max realtime priority")) {
        (Some(true), _) => Finding::good(what, "permitted", wish.costs()),
        (_, Some(limit)) if limit != "0" => Finding::good(what, format!("permitted up to {limit}"), wish.costs()),
        (None, None) => Finding::unknown(what, wish.costs()),
        _ => Finding::costs(what, "not permitted", wish.costs(), wish.mend()),
    }
}

fn throttling(files: &Files) -> Finding {
    let (what, costs) = (
        "real-time throttling",
        "A real-time thread that spins or computes for more of each period is stopped until the next.",
    );
    let number = |name: &str| files.read(&format!("proc/sys/kernel/{name}"))?.parse::<f64>().ok();
    let Some(runtime) = number("sched_rt_runtime_us") else { return Finding::unknown(what, costs) };
    let part = runtime / number("sched_rt_period_us").unwrap_or(1e6);
    if runtime < 0.0 {
        return Finding::good(what, "off", costs);
    }
    let found = format!("beyond {:.0} % of the time", 100.0 * part);
    // The usual 95 % keep a machine alive whose real-time thread does not end.
    if part >= 0.95 {
        Finding::good(what, found, costs)
    } else {
        Finding::costs(what, found, costs, Some("sudo sysctl kernel.sched_rt_runtime_us=950000".into()))
    }
}

/// Whether the process has it.
fn capability(files: &Files, bit: u32) -> Option<bool> {
    let status = files.read("proc/self/status")?;
    let set = status.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
    Some(u64::from_str_radix(set.trim(), 16).ok()? >> bit & 1 == 1)
}

/// The soft limit in force.
fn limit(files: &Files, name: &str) -> Option<String> {
    let limits = files.read("proc/self/limits")?;
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next().map(String::from)
}

/// How much memory may be locked: `None` is all of it. `Err` where the system does not say.
pub(super) fn lockable(files: &Files) -> Result<Option<u64>, ()> {
    if capability(files, IPC_LOCK) == Some(true) {
        return Ok(None);
    }
    match limit(files, "Max locked memory").ok_or(())?.as_str() {
        "unlimited" => Ok(None),
        bytes => bytes.parse().map(Some).map_err(|_| ()),
    }
}
