//! Scheduling: preemption of the kernel, permissions, hypervisor.

use super::{Files, Finding};
use crate::setup::ThreadSetting;

/// Bits of a set of capabilities.
pub(super) const NET_RAW: u32 = 13;
const IPC_LOCK: u32 = 14;
const SYS_NICE: u32 = 23;

pub(super) fn findings(files: &Files) -> Vec<Finding> {
    vec![kernel(files), hypervisor(files), priority(files), throttling(files)]
}

fn kernel(files: &Files) -> Finding {
    let (what, costs) =
        ("kernel", "Parts of the kernel that cannot be preempted delay a wake-up, rarely, by up to some milliseconds.");
    let Some(version) = files.read("proc/version") else { return Finding::unknown(what, costs) };
    if files.read("sys/kernel/realtime").as_deref() == Some("1") || version.contains("PREEMPT_RT") {
        return Finding::good(what, "real-time preemption (PREEMPT_RT)", costs);
    }
    let model = version.split_whitespace().find(|word| word.starts_with("PREEMPT")).unwrap_or("no preemption");
    let package = if cfg!(target_arch = "aarch64") { "linux-image-rt-arm64" } else { "linux-image-rt-amd64" };
    let remedy = format!("sudo apt install {package} && sudo reboot");
    Finding::costs(what, format!("{model}, not PREEMPT_RT"), costs, Some(remedy))
}

fn hypervisor(files: &Files) -> Finding {
    let (what, costs) = (
        "machine",
        "A virtual machine may pause for milliseconds without notice to its own system: maxima measured here are not \
         reliable.",
    );
    let named = files.read("sys/hypervisor/type").filter(|name| !name.is_empty());
    let cpuinfo = files.read("proc/cpuinfo").unwrap_or_default();
    let mut flags = cpuinfo.lines().filter(|line| line.starts_with("flags"));
    if named.is_some() || flags.clone().any(|line| line.split_whitespace().any(|flag| flag == "hypervisor")) {
        let kind = named.map(|name| format!(" ({name})")).unwrap_or_default();
        return Finding::costs(what, format!("virtual{kind}"), costs, None);
    }
    if flags.next().is_some() {
        Finding::good(what, "no hypervisor detected", costs)
    } else {
        Finding::unknown(what, costs)
    }
}

fn priority(files: &Files) -> Finding {
    let (what, setting) = ("real-time priority", ThreadSetting::Priority(80));
    match (capability(files, SYS_NICE), limit(files, "Max realtime priority")) {
        (Some(true), _) => Finding::good(what, "permitted", setting.costs()),
        (_, Some(limit)) if limit != "0" => Finding::good(what, format!("permitted up to {limit}"), setting.costs()),
        (None, None) => Finding::unknown(what, setting.costs()),
        _ => Finding::costs(what, "not permitted", setting.costs(), setting.remedy()),
    }
}

fn throttling(files: &Files) -> Finding {
    let (what, costs) = (
        "real-time throttling",
        "A real-time thread that runs for a larger share of each period is suspended until the next one.",
    );
    let number = |name: &str| files.read(&format!("proc/sys/kernel/{name}"))?.parse::<f64>().ok();
    let Some(runtime) = number("sched_rt_runtime_us") else { return Finding::unknown(what, costs) };
    let part = runtime / number("sched_rt_period_us").unwrap_or(1e6);
    if runtime < 0.0 {
        return Finding::good(what, "off", costs);
    }
    let threshold = format!("beyond {:.0} % of the time", 100.0 * part);
    // The default of 95 % keeps a computer usable while a real-time thread never sleeps.
    if part >= 0.95 {
        Finding::good(what, threshold, costs)
    } else {
        Finding::costs(what, threshold, costs, Some("sudo sysctl kernel.sched_rt_runtime_us=950000".into()))
    }
}

/// Whether the process has a capability.
pub(super) fn capability(files: &Files, bit: u32) -> Option<bool> {
    let status = files.read("proc/self/status")?;
    let set = status.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
    Some(u64::from_str_radix(set.trim(), 16).ok()? >> bit & 1 == 1)
}

/// The active soft limit.
fn limit(files: &Files, name: &str) -> Option<String> {
    let limits = files.read("proc/self/limits")?;
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next().map(String::from)
}

/// Limit of locked memory: `None` for unlimited, `Err` if the system does not report it.
pub(super) fn lockable(files: &Files) -> Result<Option<u64>, ()> {
    if capability(files, IPC_LOCK) == Some(true) {
        return Ok(None);
    }
    match limit(files, "Max locked memory").ok_or(())?.as_str() {
        "unlimited" => Ok(None),
        bytes => bytes.parse().map(Some).map_err(|_| ()),
    }
}
