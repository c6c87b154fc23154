//! What the executive's thread asks of the system before its first cycle. A wish that is refused costs something and is
//! reported with the command that mends it; it is never a failure.

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

/// What the thread asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThreadSettings {
    /// Above all ordinary threads: SCHED_FIFO with this priority, 1 … 99. `None` leaves a plain thread, with the finest
    /// timer that it can have.
    pub priority: Option<u8>,
    /// Keep all memory of the process where it is.
    pub lock_memory: bool,
    /// Let no CPU sleep deeply between two cycles.
    pub shallow_idle: bool,
    /// Where to run.
    pub cpu: Cpu,
}

/// Where a thread runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cpu {
    /// Wherever the system puts it.
    Any,
    /// On the last CPU that was isolated at boot; anywhere where there is none.
    Isolated,
    /// On this one alone.
    Number(usize),
}

/// Keeps the calling thread, and all that it starts from now on, off a CPU: it is left to an executive that runs on it
/// alone ([`Cpu::Number`]), which goes there all the same. What else runs on the machine is not kept off.
///
/// # Errors
/// There is no other CPU; the system cannot do it.
pub fn keep_off(cpu: usize) -> io::Result<()> {
    system::keep_off(cpu)
}

/// Has the first thread of another process run before all ordinary ones as well, with this real-time priority; threads that
/// it starts are ordinary. The process must be there: its number may be another's afterwards.
///
/// # Errors
/// The system refuses it, or knows no such priorities.
pub fn hurry(process: u32, priority: u8) -> io::Result<()> {
    system::set_priority_of(process, priority)
}

/// One of the wishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ThreadSetting {
    /// SCHED_FIFO with this priority.
    Priority(u8),
    /// Timers of the plain thread to the nanosecond.
    TimerSlack,
    /// Memory that stays.
    LockedMemory,
    /// CPUs that wake quickly.
    ShallowIdle,
    /// This CPU alone.
    OneCpu(usize),
    /// A CPU that nothing else uses.
    IsolatedCpu,
    /// The standard control word: round to nearest, subnormal numbers kept.
    FloatingPoint,
}

/// What became of a wish.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// What was asked for.
    pub wish: ThreadSetting,
    /// What the system said, where it refused.
    pub refused: Option<String>,
}

/// What became of all wishes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Granted {
    /// In the order in which they were asked.
    pub outcomes: Vec<Outcome>,
}

impl ThreadSettings {
    /// A thread like any other.
    pub const PLAIN: ThreadSettings =
        ThreadSettings { priority: None, lock_memory: false, shallow_idle: false, cpu: Cpu::Any };

    /// The clock to wait on with this period: on a CPU of its own a thread spins before each deadline, which there
    /// takes time from nobody, but for no more than half of the period. It must sleep: the system stops a thread that
    /// takes all of its CPU.
    pub fn clock(&self, period: Duration) -> MonotonicClock {
        let spin = if matches!(self.cpu, Cpu::Number(_)) { SPIN.min(period / 2) } else { Duration::ZERO };
        MonotonicClock { spin }
    }
}

impl Default for ThreadSettings {
    /// All that helps: priority 80, locked memory, no deep sleep, an isolated CPU.
    fn default() -> Self {
        ThreadSettings { priority: Some(80), lock_memory: true, shallow_idle: true, cpu: Cpu::Isolated }
    }
}

impl ThreadSetting {
    /// What the refusal costs.
    pub fn costs(self) -> &'static str {
        match self {
            ThreadSetting::Priority(_) => {
                "Any other thread may delay a cycle, by milliseconds where the CPUs are busy."
            }
            ThreadSetting::TimerSlack => "The system may put off each wake-up, usually by 50 µs.",
            ThreadSetting::LockedMemory => {
                "Memory may be taken away; to find it again a cycle waits, for a disk if need be."
            }
            ThreadSetting::ShallowIdle => "Between two cycles the CPU may sleep as deeply as its idle states go.",
            ThreadSetting::OneCpu(_) => "The thread moves between CPUs and finds its caches cold.",
            ThreadSetting::IsolatedCpu => "Other threads and their interrupts share the CPU.",
            ThreadSetting::FloatingPoint => "A library had changed the rounding of this thread; it was set right.",
        }
    }

    /// The command that mends it, where there is one.
    pub fn mend(self) -> Option<String> {
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

/// While somebody holds it open, idle states are left within the time that was written to it.
const LATENCY: &str = "/dev/cpu_dma_latency";

/// How a CPU is isolated.
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
    /// Whether this was asked and granted.
    pub fn has(&self, wish: ThreadSetting) -> bool {
        self.granted().any(|outcome| outcome.wish == wish)
    }

    /// The real-time priority that was granted.
    pub fn priority(&self) -> Option<u8> {
        self.granted().find_map(|outcome| {
            if let ThreadSetting::Priority(priority) = outcome.wish { Some(priority) } else { None }
        })
    }

    /// What was granted.
    pub fn granted(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|outcome| outcome.refused.is_none())
    }

    /// What was refused.
    pub fn refused(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|outcome| outcome.refused.is_some())
    }

    fn note<T>(&mut self, wish: ThreadSetting, result: io::Result<T>) -> Option<T> {
        let refused = result.as_ref().err().map(ToString::to_string);
        self.outcomes.push(Outcome { wish, refused });
        result.ok()
    }
}

/// One line a wish.
impl fmt::Display for Granted {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for Outcome { wish, refused } in &self.outcomes {
            match refused {
                None => writeln!(f, "{wish}: granted")?,
                Some(reason) => {
                    write!(f, "{wish}: refused ({reason}). {}", wish.costs())?;
                    wish.mend().map_or(Ok(()), |mend| write!(f, " Mend: {mend}"))?;
                    writeln!(f)?;
                }
            }
        }
        Ok(())
    }
}

/// What holds for the calling thread until it is dropped.
pub(crate) struct Held {
    pub(crate) granted: Granted,
    memory: bool,
    _shallow_idle: Option<File>,
}

/// Threads that hold the memory of the process.
static HOLDERS: Mutex<usize> = Mutex::new(0);

fn holders() -> std::sync::MutexGuard<'static, usize> {
    HOLDERS.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Asks for everything on the calling thread, and touches its stack.
pub(crate) fn ask(wishes: &ThreadSettings) -> Held {
    let mut granted = Granted::default();
    let memory = wishes.lock_memory && {
        let mut holders = holders();
        let locked = granted.note(ThreadSetting::LockedMemory, lock_memory()).is_some();
        *holders += usize::from(locked);
        locked
    };
    let shallow_idle =
        if wishes.shallow_idle { granted.note(ThreadSetting::ShallowIdle, hold_latency()) } else { None };
    match wishes.cpu {
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
    match wishes.priority {
        Some(priority) => granted.note(ThreadSetting::Priority(priority), system::set_priority(priority)),
        None => granted.note(ThreadSetting::TimerSlack, system::set_timer_slack(1)),
    };
    if !FloatingPoint::standard().was_standard() {
        granted.note(
            ThreadSetting::FloatingPoint,
            Err::<(), _>(io::Error::other("the thread rounded or flushed otherwise")),
        );
    }
    system::touch_stack();
    Held { granted, memory, _shallow_idle: shallow_idle }
}

/// No idle state that is left later than at once.
fn hold_latency() -> io::Result<File> {
    let mut file = OpenOptions::new().write(true).open(LATENCY)?;
    file.write_all(&0i32.to_ne_bytes())?;
    Ok(file)
}

/// All of it, or none: below a limit the system would refuse memory that is asked for later, and the process would end.
fn lock_memory() -> io::Result<()> {
    match doctor::lockable(Path::new("/")) {
        Some(bytes) => Err(io::Error::other(format!("only {} MiB may be locked", bytes >> 20))),
        None => system::lock_memory(),
    }
}

impl Drop for Held {
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
    fn the_last_cpu_of_a_list_is_found() {
        assert_eq!(["2-3,5\n", "1-3\n", "7", "\n", ""].map(last_of), [Some(5), Some(3), Some(7), None, None]);
    }

    #[test]
    fn a_thread_with_a_cpu_of_its_own_spins_for_a_part_of_each_period_and_others_never() {
        let spin =
            |cpu, micros| ThreadSettings { cpu, ..ThreadSettings::PLAIN }.clock(Duration::from_micros(micros)).spin;
        assert_eq!(spin(Cpu::Number(1), 250), SPIN);
        assert_eq!(spin(Cpu::Number(1), 50), Duration::from_micros(25), "a part of it is slept");
        assert_eq!([Cpu::Any, Cpu::Isolated].map(|cpu| spin(cpu, 250)), [Duration::ZERO; 2]);
    }

    #[test]
    fn a_wish_that_cannot_be_granted_is_reported_with_its_price_and_its_remedy() {
        let wishes = ThreadSettings { priority: Some(0), cpu: Cpu::Number(100_000), ..ThreadSettings::PLAIN };
        let held = std::thread::spawn(move || ask(&wishes)).join().unwrap();
        assert_eq!(held.granted.refused().count(), 2, "{}", held.granted);
        let text = held.granted.to_string();
        assert!(text.contains("CPU 100000 alone: refused"), "{text}");
        assert!(text.contains("real-time priority 0: refused") && text.contains("Mend: sudo setcap cap_sys_nice"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_thread_that_keeps_off_a_cpu_hands_that_on_and_never_the_last_one() {
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
    fn a_plain_thread_gets_its_exact_timers_and_a_cpu_that_is_there() {
        let status = fs::read_to_string("/proc/thread-self/status").unwrap();
        let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
        let wishes = ThreadSettings { cpu: Cpu::Number(last_of(allowed).unwrap()), ..ThreadSettings::PLAIN };
        std::thread::spawn(move || {
            let held = ask(&wishes);
            assert_eq!(held.granted.refused().next(), None, "{}", held.granted);
            assert!(held.granted.has(ThreadSetting::TimerSlack));
            let slack = fs::read_to_string("/proc/thread-self/timerslack_ns").unwrap_or("1".into());
            assert_eq!(slack.trim(), "1");
        })
        .join()
        .unwrap();
    }
}
