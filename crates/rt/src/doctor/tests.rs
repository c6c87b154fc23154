//! Each finding, on simulated computers, with every verdict.

use super::*;

/// A computer with these files.
pub(super) fn machine(files: &[(&str, &str)]) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a temporary folder");
    for (path, text) in files {
        let path = root.path().join(path);
        fs::create_dir_all(path.parent().expect("a file is in a folder")).expect("the folder takes folders");
        fs::write(path, text).expect("the folder takes files");
    }
    root
}

fn finding(what: &str, files: &[(&str, &str)]) -> Finding {
    let root = machine(files);
    let findings = examine(root.path()).into_iter().filter(|finding| finding.what == what).collect::<Vec<_>>();
    let [only] = &findings[..] else { panic!("{} findings are called {what}", findings.len()) };
    only.clone()
}

/// Checks verdict, part of the value and part of the remedy.
fn check(what: &str, files: &[(&str, &str)], verdict: Verdict, found: &str, remedy: &str) {
    let finding = finding(what, files);
    assert_eq!(finding.verdict, verdict, "{finding:?}");
    assert!(finding.found.contains(found), "{finding:?}");
    assert!(finding.costs.ends_with('.'), "{finding:?}");
    assert!(finding.remedy.clone().unwrap_or_default().contains(remedy), "{finding:?}");
    assert_eq!(finding.remedy.is_some(), !remedy.is_empty(), "{finding:?}");
}

use Verdict::{Costs, Good, Unknown};

#[test]
fn without_files_only_the_timer_tick_is_judged() {
    let root = machine(&[]);
    let judged: Vec<_> = examine(root.path()).into_iter().filter(|finding| finding.verdict != Unknown).collect();
    assert_eq!(judged.iter().map(|finding| finding.what).collect::<Vec<_>>(), ["timer tick"]);
    assert_eq!(examine(root.path()).len(), 14);
}

#[test]
fn the_kernel_is_real_time_or_not() {
    let version = |text| [("proc/version", text)];
    check("kernel", &version("Linux 6.12.1 (gcc) #1 SMP PREEMPT_RT Debian"), Good, "PREEMPT_RT", "");
    check(
        "kernel",
        &version("Linux 6.1.0 #1 SMP PREEMPT_DYNAMIC Debian"),
        Costs,
        "PREEMPT_DYNAMIC",
        "apt install linux",
    );
    check("kernel", &version("Linux 6.1.0 #1 SMP Debian"), Costs, "no preemption", "linux-image-rt");
    check("kernel", &[("proc/version", "Linux 5.10"), ("sys/kernel/realtime", "1\n")], Good, "real-time", "");
}

#[test]
fn a_hypervisor_shows_in_the_flags_or_in_its_folder() {
    let flags = |text| [("proc/cpuinfo", text)];
    check("machine", &flags("model name : X\nflags\t: fpu tsc hypervisor avx\n"), Costs, "virtual", "");
    check("machine", &flags("model name : X\nflags\t: fpu tsc avx\n"), Good, "no hypervisor", "");
    check("machine", &flags("Features : fp asimd\n"), Unknown, "", "");
    check("machine", &[("sys/hypervisor/type", "xen\n")], Costs, "xen", "");
}

#[test]
fn permission_for_a_priority_comes_by_limit_or_capability() {
    let limits = |priority: &str| {
        format!("Limit  Soft Limit  Hard Limit  Units\nMax realtime priority     {priority}      99\n")
    };
    let with = |priority: &str, capabilities: &str, verdict, found, remedy| {
        let files =
            [("proc/self/limits", &*limits(priority)), ("proc/self/status", &*format!("CapEff:\t{capabilities}\n"))];
        check("real-time priority", &files, verdict, found, remedy);
    };
    with("0", "0000000000000000", Costs, "not permitted", "setcap cap_sys_nice");
    with("0", "0000000000800000", Good, "permitted", "");
    with("95", "0000000000000000", Good, "up to 95", "");
}

#[test]
fn throttling_is_reported_where_it_starts_early() {
    let runtime =
        |text| [("proc/sys/kernel/sched_rt_runtime_us", text), ("proc/sys/kernel/sched_rt_period_us", "1000000")];
    check("real-time throttling", &runtime("950000\n"), Good, "95 %", "");
    check("real-time throttling", &runtime("-1\n"), Good, "off", "");
    check("real-time throttling", &runtime("500000\n"), Costs, "50 %", "sysctl");
}

#[test]
fn a_single_cpu_and_a_missing_isolation_are_reported() {
    let online = |text| [("sys/devices/system/cpu/online", text)];
    check("CPUs", &online("0\n"), Costs, "one", "");
    check("CPUs", &online("0-3\n"), Good, "0-3", "");
    let isolated = |text| [("sys/devices/system/cpu/isolated", text)];
    check("isolated CPU", &isolated("\n"), Costs, "none", "isolcpus");
    check("isolated CPU", &isolated("3\n"), Good, "3", "");
    let tickless = |text| [("sys/devices/system/cpu/nohz_full", text)];
    check("timer tick", &tickless("3\n"), Good, "off on 3", "");
    check("timer tick", &tickless("(null)\n"), Costs, "every CPU", "nohz_full");
}

#[test]
fn speed_and_idle_states_of_the_executives_cpu_are_examined() {
    let cpu = |file: &str| format!("sys/devices/system/cpu/cpu2/{file}");
    let (online, governor) = (("sys/devices/system/cpu/online", "0-2"), cpu("cpufreq/scaling_governor"));
    check("CPU governor", &[online, (&governor, "powersave\n")], Costs, "powersave", "echo performance");
    check("CPU governor", &[online, (&governor, "performance\n")], Good, "performance", "");
    check("CPU governor", &[("sys/devices/system/cpu/online", "0-3"), (&governor, "powersave")], Unknown, "", "");

    let idle = |state: usize, file: &str| cpu(&format!("cpuidle/state{state}/{file}"));
    let (names, latencies) = ([idle(0, "name"), idle(1, "name")], [idle(0, "latency"), idle(1, "latency")]);
    let states = [online, (&*names[0], "POLL"), (&*names[1], "C6"), (&*latencies[0], "0"), (&*latencies[1], "133")];
    check("idle states", &states, Costs, "C6, 133 µs", "/cpu2/cpuidle/state*");
    let disabled = idle(1, "disable");
    check("idle states", &[&states[..], &[(&*disabled, "1")]].concat(), Good, "shallow", "");
}

#[test]
fn a_slow_clock_is_replaced_by_a_fast_one_if_there_is_one() {
    let folder = "sys/devices/system/clocksource/clocksource0";
    let (current, available) = (format!("{folder}/current_clocksource"), format!("{folder}/available_clocksource"));
    check("clock", &[(&current, "tsc\n")], Good, "tsc", "");
    check("clock", &[(&current, "hpet\n"), (&available, "tsc hpet acpi_pm\n")], Costs, "hpet", "echo tsc");
    check("clock", &[(&current, "acpi_pm\n"), (&available, "acpi_pm\n")], Costs, "acpi_pm", "");
}

#[test]
fn devices_that_interrupt_the_executives_cpu_are_named() {
    let table = |disk: &str| {
        format!(
            "           CPU0       CPU1\n 24:   1   0   IO-APIC  5-edge  acpi\n 36:   7   {disk}   PCI-MSIX  disk-req\n\
             LOC:   9   9   Local timer interrupts\n"
        )
    };
    let on = |isolated, table: &str, verdict, found, remedy| {
        let files = [("sys/devices/system/cpu/isolated", isolated), ("proc/interrupts", table)];
        check("interrupts", &files, verdict, found, remedy);
    };
    on(
        "1",
        &table("3071192"),
        Costs,
        "1 devices on CPU 1, most often disk-req 3071192",
        "/proc/irq/36/smp_affinity_list",
    );
    on("1", &table("0"), Good, "no device on CPU 1", "");
    on("0", &table("0"), Costs, "disk-req 7, acpi 1", "");
}

#[test]
fn memory_is_lockable_swapped_and_huge_or_not() {
    let limits = |text| ("proc/self/limits", text);
    let (little, all) = (
        limits("Max locked memory  8388608  8388608  bytes\n"),
        limits("Max locked memory  unlimited  unlimited  bytes\n"),
    );
    check("locked memory", &[little], Costs, "8 MiB", "setcap");
    check("locked memory", &[all], Good, "permitted", "");
    check("locked memory", &[little, ("proc/self/status", "CapEff:\t0000000000004000\n")], Good, "permitted", "");

    let swaps = |text| ("proc/swaps", text);
    let (none, some) = (swaps("Filename Type Size\n"), swaps("Filename Type Size\n/dev/sda2 partition 8000\n"));
    check("swap", &[little, none], Good, "none", "");
    check("swap", &[little, some], Costs, "on", "swapoff");
    check("swap", &[all, some], Good, "can be locked", "");

    let huge = |text| [("sys/kernel/mm/transparent_hugepage/enabled", text)];
    check("huge pages", &huge("[always] madvise never\n"), Costs, "always", "echo madvise");
    check("huge pages", &huge("always [madvise] never\n"), Good, "on request", "");
}
