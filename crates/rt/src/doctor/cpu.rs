//! CPU of the executive: speed, idle states, clock source, other users.

use super::{Files, Finding};
use crate::setup::{ISOLATE, ThreadSetting};

/// Maximum exit latency of a shallow idle state [µs].
const SHALLOW: u64 = 10;

pub(super) fn findings(files: &Files) -> Vec<Finding> {
    vec![count(files), isolation(files), tick(files), governor(files), idle(files), clock(files), interrupts(files)]
}

fn count(files: &Files) -> Finding {
    let (what, costs) = ("CPUs", "All other programs share the only CPU and stop while a cycle spins.");
    let Some(online) = files.read("sys/devices/system/cpu/online") else { return Finding::unknown(what, costs) };
    if online == "0" { Finding::costs(what, "one", costs, None) } else { Finding::good(what, online, costs) }
}

fn isolation(files: &Files) -> Finding {
    let (what, costs) = ("isolated CPU", ThreadSetting::IsolatedCpu.costs());
    match files.read("sys/devices/system/cpu/isolated").as_deref() {
        None => Finding::unknown(what, costs),
        Some("") => Finding::costs(what, "none", costs, Some(ISOLATE.into())),
        Some(list) => Finding::good(what, list, costs),
    }
}

fn tick(files: &Files) -> Finding {
    let (what, costs) = ("timer tick", "The tick interrupts a cycle for some microseconds.");
    let list = files.read("sys/devices/system/cpu/nohz_full").unwrap_or_default();
    if list.is_empty() || list == "(null)" {
        return Finding::costs(what, "on every CPU (no nohz_full)", costs, Some(ISOLATE.into()));
    }
    Finding::good(what, format!("off on {list} (nohz_full)"), costs)
}

fn governor(files: &Files) -> Finding {
    let (what, costs) =
        ("CPU governor", "The CPU clock slows down between two cycles, and the next cycle takes longer.");
    match files.read_of_cpu("cpufreq/scaling_governor") {
        None => Finding::unknown(what, costs),
        Some(name) if name == "performance" => Finding::good(what, name, costs),
        Some(name) => {
            let remedy = "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor";
            Finding::costs(what, name, costs, Some(remedy.into()))
        }
    }
}

fn idle(files: &Files) -> Finding {
    let (what, costs) = ("idle states", "The CPU takes this time to wake from its deepest idle state.");
    let state = |index: usize| {
        let read = |file: &str| files.read_of_cpu(&format!("cpuidle/state{index}/{file}"));
        let latency: u64 = read("latency")?.parse().ok()?;
        let disabled = read("disable").is_some_and(|flag| flag != "0");
        Some((index, read("name").unwrap_or_default(), latency, disabled))
    };
    let states: Vec<_> = (0..).map_while(state).collect();
    if states.is_empty() {
        return Finding::unknown(what, costs);
    }
    let deepest = states.into_iter().filter(|(_, _, latency, disabled)| !disabled && *latency > SHALLOW);
    match deepest.max_by_key(|(_, _, latency, _)| *latency) {
        None => Finding::good(what, "shallow states only", costs),
        Some((_, name, latency, _)) => {
            let folder = format!("/sys/devices/system/cpu/cpu{}/cpuidle", files.cpu);
            let remedy = format!(
                "for s in {folder}/state*; do [ $(cat $s/latency) -gt {SHALLOW} ] && echo 1 | sudo tee $s/disable; done"
            );
            Finding::costs(what, format!("down to {name}, {latency} µs"), costs, Some(remedy))
        }
    }
}

fn clock(files: &Files) -> Finding {
    const FOLDER: &str = "sys/devices/system/clocksource/clocksource0";
    let (what, costs) = ("clock", "Each read of this clock is a system call of about a microsecond.");
    let Some(name) = files.read(&format!("{FOLDER}/current_clocksource")) else { return Finding::unknown(what, costs) };
    if !["hpet", "acpi_pm", "pit", "jiffies", "refined-jiffies"].contains(&name.as_str()) {
        return Finding::good(what, name, costs);
    }
    let available = files.read(&format!("{FOLDER}/available_clocksource")).unwrap_or_default();
    let better = available.split_whitespace().find(|name| ["tsc", "kvm-clock", "arch_sys_counter"].contains(name));
    let remedy = better.map(|name| format!("echo {name} | sudo tee /{FOLDER}/current_clocksource"));
    Finding::costs(what, name, costs, remedy)
}

/// Interrupts of devices; timer and inter-processor interrupts belong to the kernel.
fn interrupts(files: &Files) -> Finding {
    let (what, costs) = ("interrupts", "Each interrupt takes some microseconds at an arbitrary time.");
    let Some(table) = files.read("proc/interrupts") else { return Finding::unknown(what, costs) };
    let column = table
        .lines()
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .position(|name| name.strip_prefix("CPU").and_then(|number| number.parse().ok()) == Some(files.cpu));
    let Some(column) = column else { return Finding::unknown(what, costs) };
    let device = |line: &str| {
        let mut words = line.split_whitespace();
        let number: u32 = words.next()?.strip_suffix(':')?.parse().ok()?;
        let count: u64 = line.split_whitespace().nth(column + 1)?.parse().ok()?;
        Some((count, number, line.split_whitespace().next_back()?.to_string()))
    };
    let mut devices: Vec<_> = table.lines().filter_map(device).filter(|(count, ..)| *count > 0).collect();
    devices.sort_by(|one, other| other.cmp(one));
    let Some((_, number, _)) = devices.first() else {
        return Finding::good(what, format!("no device on CPU {}", files.cpu), costs);
    };
    let worst: Vec<_> = devices.iter().take(3).map(|(count, _, name)| format!("{name} {count}")).collect();
    let summary = format!("{} devices on CPU {}, most often {}", devices.len(), files.cpu, worst.join(", "));
    // An interrupt can be moved only if there is another CPU.
    let other = (files.cpu > 0).then(|| format!("echo 0 | sudo tee /proc/irq/{number}/smp_affinity_list"));
    Finding::costs(what, summary, costs, other)
}
