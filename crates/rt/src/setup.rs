//! Settings of the executive's thread, requested from the system before the first cycle. A refused setting is reported
//! with its effect and the command that corrects it; it is never an error.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

use crate::clock::{MonotonicClock, SPIN};
use crate::doctor;
use crate::floating_point::FloatingPoint;
use crate::system;

/// Requested settings of a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThreadSettings {
    /// Real-time priority, 1 … 99 (SCHED_FIFO), above all ordinary threads. `None`: ordinary thread with the finest
    /// timer available.
    pub priority: Option<u8>,
    /// Lock all memory of the process.
    pub lock_memory: bool,
    /// Prevent deep idle states between two cycles.
    pub shallow_idle: bool,
    /// CPU of the thread.
    pub cpu: Cpu,
}

/// CPU of a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cpu {
    /// Chosen by the system.
    Any,
    /// The last CPU isolated at boot; without one, chosen by the system.
    Isolated,
    /// This CPU only.
    Number(usize),
}

/// Excludes a CPU for the calling thread and all threads that it starts later. The CPU is left to an executive with
/// [`Cpu::Number`], which can still use it. Other processes are not excluded.
///
/// # Errors
/// There is no other CPU; the system does not support it.
pub fn keep_off(cpu: usize) -> io::Result<()> {
    system::keep_off(cpu)
}

/// Sets the real-time priority of the first thread of another process. Threads that it starts are ordinary. The process
/// must exist: its number may be reused afterwards.
///
/// # Errors
/// The system refuses it, or has no real-time priorities.
pub fn hurry(process: u32, priority: u8) -> io::Result<()> {
    system::set_priority_of(process, priority)
}

/// One setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ThreadSetting {
    /// Real-time priority (SCHED_FIFO).
    Priority(u8),
    /// Timers of an ordinary thread with a resolution of 1 ns.
    TimerSlack,
    /// Locked memory.
    LockedMemory,
    /// Shallow idle states only.
    ShallowIdle,
    /// This CPU only.
    OneCpu(usize),
    /// A CPU without other threads.
    IsolatedCpu,
    /// The standard control word: round to nearest, subnormal numbers enabled.
    FloatingPoint,
}

/// Outcome of a setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Requested setting.
    pub setting: ThreadSetting,
    /// Reason of the system if it refused.
    pub refused: Option<String>,
}

/// Outcomes of all settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Granted {
    /// In the order of the requests.
    pub outcomes: Vec<Outcome>,
}

impl ThreadSettings {
    /// An ordinary thread.
    pub const PLAIN: ThreadSettings =
        ThreadSettings { priority: None, lock_memory: false, shallow_idle: false, cpu: Cpu::Any };

    /// The clock for this period. A thread with a dedicated CPU spins before each deadline, for at most half of the
    /// period. It must also sleep: the system suspends a real-time thread that uses all of its CPU.
    pub fn clock(&self, period: Duration) -> MonotonicClock {
        let spin = if matches!(self.cpu, Cpu::Number(_)) { SPIN.min(period / 2) } else { Duration::ZERO };
        MonotonicClock { spin }
    }
}

impl Default for ThreadSettings {
    /// All settings: priority 80, locked memory, no deep sleep, an isolated CPU.
    fn default() -> Self {
        ThreadSettings { priority: Some(80), lock_memory: true, shallow_idle: true, cpu: Cpu::Isolated }
    }
}

impl ThreadSetting {
    /// Effect of a refusal.
    pub fn costs(self) -> &'static str {
        match self {
            ThreadSetting::Priority(_) => "Any other thread may delay a cycle, by milliseconds if the CPUs are busy.",
            ThreadSetting::TimerSlack => "The system may delay each wake-up, usually by 50 µs.",
            ThreadSetting::LockedMemory => {
                "Memory may be paged out; a cycle then waits until it is back, possibly from disk."
            }
            ThreadSetting::ShallowIdle => "Between two cycles the CPU may enter its deepest idle state.",
            ThreadSetting::OneCpu(_) => "The thread may move between CPUs and lose its cache contents.",
            ThreadSetting::IsolatedCpu => "Other threads and their interrupts share the CPU.",
            ThreadSetting::FloatingPoint => "A library had changed the rounding of this thread; it is standard again.",
        }
    }

    /// Command that corrects a refusal, if there is one.
    pub fn remedy(self) -> Option<String> {
        let capability = "sudo setcap cap_sys_nice,cap_ipc_lock+ep \"$(command -v stickslip)\"";
        match self {
            ThreadSetting::Priority(_) | ThreadSetting::LockedMemory => Some(capability.into()),
            ThreadSetting::ShallowIdle => Some(format!("sudo chmod o+w {LATENCY}")),
            ThreadSetting::TimerSlack | ThreadSetting::FloatingPoint => None,
            ThreadSetting::OneCpu(cpu) => Some(format!("taskset --cpu-list {cpu} stickslip …")),
            ThreadSetting::IsolatedCpu => Some(ISOLATE.into()),
        }
    }
}

/// While this file is open, the exit latency of idle states is limited to the time written to it.
const LATENCY: &str = "/dev/cpu_dma_latency";

/// Instruction to isolate a CPU.
pub(crate) const ISOLATE: &str = "add isolcpus=N nohz_full=N rcu_nocbs=N to GRUB_CMDLINE_LINUX in /etc/default/grub, \
                                  N the last CPU, then sudo update-grub && sudo reboot";

impl fmt::Display for ThreadSetting {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            ThreadSetting::Priority(priority) => write!(f, "real-time priority {priority}"),
            ThreadSetting::TimerSlack => f.write_str("exact timers"),
            ThreadSetting::LockedMemory => f.write_str("locked memory"),
            ThreadSetting::ShallowIdle => f.write_str("no deep sleep"),
            ThreadSetting::OneCpu(cpu) => write!(f, "CPU {cpu} alone"),
            ThreadSetting::IsolatedCpu => f.write_str("an isolated CPU"),
            ThreadSetting::FloatingPoint => f.write_str("standard floating point"),
        }
    }
}

impl Granted {
    /// Whether this setting was requested and granted.
    pub fn has(&self, setting: ThreadSetting) -> bool {
        self.granted().any(|outcome| outcome.setting == setting)
    }

    /// Granted real-time priority.
    pub fn priority(&self) -> Option<u8> {
        self.granted().find_map(|outcome| {
            if let ThreadSetting::Priority(priority) = outcome.setting { Some(priority) } else { None }
        })
    }

    /// Granted settings.
    pub fn granted(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|outcome| outcome.refused.is_none())
    }

    /// Refused settings.
    pub fn refused(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|outcome| outcome.refused.is_some())
    }

    fn note<T>(&mut self, setting: ThreadSetting, result: io::Result<T>) -> Option<T> {
        let refused = result.as_ref().err().map(ToString::to_string);
        self.outcomes.push(Outcome { setting, refused });
        result.ok()
    }
}

/// One line for each setting.
impl fmt::Display for Granted {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for Outcome { setting, refused } in &self.outcomes {
            match refused {
                None => writeln!(f, "{setting}: granted")?,
                Some(reason) => {
                    write!(f, "{setting}: refused ({reason}). {}", setting.costs())?;
                    setting.remedy().map_or(Ok(()), |remedy| write!(f, " Remedy: {remedy}"))?;
                    writeln!(f)?;
                }
            }
        }
        Ok(())
    }
}

/// Settings of the calling thread, active until this is dropped.
pub(crate) struct ActiveSettings {
    pub(crate) granted: Granted,
    memory: bool,
    _shallow_idle: Option<File>,
}

/// Number of threads that lock the memory of the process.
static HOLDERS: Mutex<usize> = Mutex::new(0);

fn holders() -> std::sync::MutexGuard<'static, usize> {
    HOLDERS.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Requests all settings for the calling thread, and touches its stack.
pub(crate) fn apply(settings: &ThreadSettings) -> ActiveSettings {
    let mut granted = Granted::default();
    let memory = settings.lock_memory && {
        let mut holders = holders();
        let locked = granted.note(ThreadSetting::LockedMemory, lock_memory()).is_some();
        *holders += usize::from(locked);
        locked
    };
    let shallow_idle =
        if settings.shallow_idle { granted.note(ThreadSetting::ShallowIdle, hold_latency()) } else { None };
    match settings.cpu {
        Cpu::Any => {}
        Cpu::Number(cpu) => {
            granted.note(ThreadSetting::OneCpu(cpu), system::pin(cpu));
        }
        Cpu::Isolated => {
            let isolated = fs::read_to_string("/sys/devices/system/cpu/isolated").unwrap_or_default();
            let none = || io::Error::other("no CPU was isolated at boot");
            granted.note(ThreadSetting::IsolatedCpu, last_of(&isolated).ok_or_else(none).and_then(system::pin));
        }
    }
    match settings.priority {
        Some(priority) => granted.note(ThreadSetting::Priority(priority), system::set_priority(priority)),
        None => granted.note(ThreadSetting::TimerSlack, system::set_timer_slack(1)),
    };
    if !FloatingPoint::standard().was_standard() {
        granted.note(
            ThreadSetting::FloatingPoint,
            Err::<(), _>(io::Error::other("the thread had a different rounding mode or flushed subnormal numbers")),
        );
    }
    system::touch_stack();
    ActiveSettings { granted, memory, _shallow_idle: shallow_idle }
}

/// Requests an exit latency of 0.
fn hold_latency() -> io::Result<File> {
    let mut file = OpenOptions::new().write(true).open(LATENCY)?;
    file.write_all(&0i32.to_ne_bytes())?;
    Ok(file)
}

/// All memory or none: with a limit the system would refuse later allocations, and the process would end.
fn lock_memory() -> io::Result<()> {
    match doctor::lockable(Path::new("/")) {
        Some(bytes) => Err(io::Error::other(format!("only {} MiB may be locked", bytes >> 20))),
        None => system::lock_memory(),
    }
}

impl Drop for ActiveSettings {
    fn drop(&mut self) {
        if self.memory {
            let mut holders = holders();
            *holders -= 1;
            if *holders == 0 {
                system::unlock_memory();
            }
        }
    }
}

/// The last CPU of a list such as `2-3,5`.
pub(crate) fn last_of(list: &str) -> Option<usize> {
    list.trim().rsplit([',', '-']).next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_cpu_of_a_list_is_read() {
        assert_eq!(["2-3,5\n", "1-3\n", "7", "\n", ""].map(last_of), [Some(5), Some(3), Some(7), None, None]);
    }

    #[test]
    fn only_a_thread_with_a_dedicated_cpu_spins() {
        let spin =
            |cpu, micros| ThreadSettings { cpu, ..ThreadSettings::PLAIN }.clock(Duration::from_micros(micros)).spin;
        assert_eq!(spin(Cpu::Number(1), 250), SPIN);
        assert_eq!(spin(Cpu::Number(1), 50), Duration::from_micros(25), "it sleeps for half of it");
        assert_eq!([Cpu::Any, Cpu::Isolated].map(|cpu| spin(cpu, 250)), [Duration::ZERO; 2]);
    }

    #[test]
    fn a_refused_setting_is_reported_with_its_effect_and_its_remedy() {
        let settings = ThreadSettings { priority: Some(0), cpu: Cpu::Number(100_000), ..ThreadSettings::PLAIN };
        let held = std::thread::spawn(move || apply(&settings)).join().unwrap();
        assert_eq!(held.granted.refused().count(), 2, "{}", held.granted);
        let text = held.granted.to_string();
        assert!(text.contains("CPU 100000 alone: refused"), "{text}");
        assert!(text.contains("real-time priority 0: refused") && text.contains("Remedy: sudo setcap cap_sys_nice"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn an_excluded_cpu_is_inherited_and_the_last_one_cannot_be_excluded() {
        let allowed = || {
            let status = fs::read_to_string("/proc/thread-self/status").unwrap();
            status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap().trim().to_owned()
        };
        let left = std::thread::spawn(move || {
            let mut left = Vec::new();
            while let Some(cpu) = last_of(&allowed()) {
                if keep_off(cpu).is_err() {
                    break;
                }
                left.push(cpu);
                let inherited = std::thread::spawn(allowed).join().unwrap();
                assert!(last_of(&inherited).unwrap() < cpu, "{inherited} after {cpu}");
            }
            assert!(last_of(&allowed()).is_some(), "one is left");
            left
        });
        let left = left.join().unwrap();
        assert!(left.windows(2).all(|pair| pair[1] < pair[0]), "{left:?}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn an_ordinary_thread_gets_exact_timers_and_an_existing_cpu() {
        let status = fs::read_to_string("/proc/thread-self/status").unwrap();
        let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
        let settings = ThreadSettings { cpu: Cpu::Number(last_of(allowed).unwrap()), ..ThreadSettings::PLAIN };
        std::thread::spawn(move || {
            let held = apply(&settings);
            assert_eq!(held.granted.refused().next(), None, "{}", held.granted);
            assert!(held.granted.has(ThreadSetting::TimerSlack));
            let slack = fs::read_to_string("/proc/thread-self/timerslack_ns").unwrap_or("1".into());
            assert_eq!(slack.trim(), "1");
        })
        .join()
        .unwrap();
    }
}
