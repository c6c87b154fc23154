//! Linux.

#![expect(unsafe_code, reason = "system calls that std has not")]

use std::fs::File;
use std::io;
use std::mem::MaybeUninit;
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::{FileExt, OpenOptionsExt as _};
use std::path::Path;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use super::Counters;
use crate::clock::Nanoseconds;

const NANOS: u64 = 1_000_000_000;

/// Whether [`own_counters`] counts.
pub(crate) const COUNTS: bool = true;

/// A thread of this process, for the others.
pub(crate) type ThreadId = libc::pid_t;

fn result(status: libc::c_int) -> io::Result<()> {
    if status == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// Time of a clock [ns]; 0 of one that is not there.
fn time_of(clock: libc::clockid_t) -> Nanoseconds {
    let mut time = MaybeUninit::<libc::timespec>::zeroed();
    // SAFETY: the pointer is valid for one `timespec`, which is numbers: zero, or what the system wrote.
    let time = unsafe {
        libc::clock_gettime(clock, time.as_mut_ptr());
        time.assume_init()
    };
    time.tv_sec as u64 * NANOS + time.tv_nsec as u64
}

#[inline]
pub(crate) fn now() -> Nanoseconds {
    time_of(libc::CLOCK_MONOTONIC)
}

/// Sleeps until the monotonic clock is there.
pub(crate) fn sleep_until(deadline: Nanoseconds) {
    let time = libc::timespec { tv_sec: (deadline / NANOS) as _, tv_nsec: (deadline % NANOS) as _ };
    let interrupted = || {
        // SAFETY: `time` outlives the call; no remainder is asked for.
        unsafe {
            libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &time, std::ptr::null_mut())
                == libc::EINTR
        }
    };
    // A signal wakes too early; the deadline is absolute, so sleeping on is the same call.
    while interrupted() {}
}

/// The calling thread.
pub(crate) fn this_thread() -> ThreadId {
    // SAFETY: takes nothing and cannot fail.
    unsafe { libc::gettid() }
}

/// Of the calling thread, now: two system calls.
pub(crate) fn own_counters() -> Counters {
    let mut usage = MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: the pointer is valid for one `rusage`, which is numbers: zero, or what the system wrote.
    let usage = unsafe {
        libc::getrusage(libc::RUSAGE_THREAD, usage.as_mut_ptr());
        usage.assume_init()
    };
    Counters {
        cpu: time_of(libc::CLOCK_THREAD_CPUTIME_ID),
        minor_faults: usage.ru_minflt as u64,
        major_faults: usage.ru_majflt as u64,
        waits: usage.ru_nvcsw as u64,
        preemptions: usage.ru_nivcsw as u64,
    }
}

/// The counters of another thread of this process: its files stay open.
pub(crate) struct OtherThread {
    clock: libc::clockid_t,
    stat: File,
    status: File,
}

impl OtherThread {
    /// # Errors
    /// Where `/proc` is not there.
    pub(crate) fn open(thread: ThreadId) -> io::Result<Self> {
        let open = |file: &str| File::open(format!("/proc/self/task/{thread}/{file}"));
        // As clock_getcpuclockid(3) and the kernel have it: per thread, scheduler's time.
        Ok(OtherThread { clock: (!thread << 3) | 6, stat: open("stat")?, status: open("status")? })
    }

    /// # Errors
    /// When the thread has gone.
    pub(crate) fn counters(&self) -> io::Result<Counters> {
        let mut buffer = [0u8; 4096];
        let mut text = |file: &File| -> io::Result<String> {
            let length = file.read_at(&mut buffer, 0)?;
            Ok(String::from_utf8_lossy(&buffer[..length]).into_owned())
        };
        let garbled = || io::Error::from(io::ErrorKind::InvalidData);
        let stat = text(&self.stat)?;
        // The name in parentheses may hold anything; behind it the fields are counted from 3.
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
        let field = |number: usize| fields.get(number - 3).and_then(|text| text.parse().ok()).ok_or_else(garbled);
        let status = text(&self.status)?;
        let line = |name: &str| {
            let value = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
            value.and_then(|text| text.trim().parse().ok()).ok_or_else(garbled)
        };
        Ok(Counters {
            cpu: time_of(self.clock),
            minor_faults: field(10)?,
            major_faults: field(12)?,
            waits: line("voluntary_ctxt_switches")?,
            preemptions: line("nonvoluntary_ctxt_switches")?,
        })
    }
}

/// SCHED_FIFO for the calling thread; threads that it starts do not inherit it.
pub(crate) fn set_priority(priority: u8) -> io::Result<()> {
    set_priority_of(0, priority)
}

/// The same for the first thread of a process; 0 is the calling thread.
pub(crate) fn set_priority_of(process: u32, priority: u8) -> io::Result<()> {
    let process = process.try_into().map_err(|_| io::Error::from_raw_os_error(libc::ESRCH))?;
    let parameters = libc::sched_param { sched_priority: priority.into() };
    // SAFETY: `parameters` outlives the call.
    result(unsafe { libc::sched_setscheduler(process, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &parameters) })
}

/// Runs the calling thread on this CPU alone.
pub(crate) fn pin(cpu: usize) -> io::Result<()> {
    // SAFETY: a `cpu_set_t` is bits, of which zero is none; CPU_SET is given an index within it.
    let set = unsafe {
        let mut set = MaybeUninit::<libc::cpu_set_t>::zeroed().assume_init();
        if cpu >= 8 * size_of_val(&set) {
            return Err(io::Error::from_raw_os_error(libc::EINVAL));
        }
        libc::CPU_SET(cpu, &mut set);
        set
    };
    // SAFETY: the pointer is valid for the size that is given; 0 is the calling thread.
    result(unsafe { libc::sched_setaffinity(0, size_of_val(&set), &set) })
}

/// Runs the calling thread, and those that it starts from now on, on all CPUs but this one.
pub(crate) fn keep_off(cpu: usize) -> io::Result<()> {
    // SAFETY: a `cpu_set_t` is bits, of which zero is none; the pointer is valid for the size that is given, CPU_CLR is
    // given an index within it; 0 is the calling thread.
    unsafe {
        let mut set = MaybeUninit::<libc::cpu_set_t>::zeroed().assume_init();
        result(libc::sched_getaffinity(0, size_of_val(&set), &mut set))?;
        if cpu < 8 * size_of_val(&set) {
            libc::CPU_CLR(cpu, &mut set);
        }
        // Refused by the system where none is left.
        result(libc::sched_setaffinity(0, size_of_val(&set), &set))
    }
}

/// Keeps all pages of the process in memory, those to come as well.
pub(crate) fn lock_memory() -> io::Result<()> {
    // SAFETY: flags alone; changes no contents.
    result(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
}

/// Lets the system page again.
pub(crate) fn unlock_memory() {
    // SAFETY: takes nothing; changes no contents.
    unsafe { libc::munlockall() };
}

/// How long the system may put off a wake-up of the calling thread.
pub(crate) fn set_timer_slack(nanoseconds: u64) -> io::Result<()> {
    // SAFETY: this request takes a number.
    result(unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, nanoseconds as libc::c_ulong) })
}

/// A terminal without its habits: no echo, no lines, no control characters.
pub(crate) fn open_serial(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    let port = options.read(true).write(true).custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY).open(path)?;
    let mut settings = MaybeUninit::<libc::termios>::zeroed();
    // SAFETY: the descriptor is open as long as `port`, and the pointer is valid for one `termios`.
    result(unsafe { libc::tcgetattr(port.as_raw_fd(), settings.as_mut_ptr()) })?;
    // SAFETY: `settings` is numbers, filled above, which the one call changes and the other reads.
    result(unsafe {
        libc::cfmakeraw(settings.as_mut_ptr());
        libc::tcsetattr(port.as_raw_fd(), libc::TCSANOW, settings.as_ptr())
    })?;
    Ok(port)
}

/// The lower half of a word, on which a process can wait.
fn lower(word: &AtomicU64) -> *mut u32 {
    word.as_ptr().cast::<u32>().wrapping_add(usize::from(cfg!(target_endian = "big")))
}

/// Waits until somebody wakes, also from another process, unless the lower half of the word is another.
pub(crate) fn wait_for_word(word: &AtomicU64, value: u32, within: Duration) {
    let time = libc::timespec { tv_sec: within.as_secs() as _, tv_nsec: within.subsec_nanos() as _ };
    // SAFETY: the kernel reads the half of a word that lives, and a `timespec`. What it says does not matter: whoever
    // waits looks at the word again.
    unsafe { libc::syscall(libc::SYS_futex, lower(word), libc::FUTEX_WAIT, value, &raw const time) };
}

/// Wakes whoever waits.
pub(crate) fn wake_for_word(word: &AtomicU64) {
    // SAFETY: the kernel takes the address alone.
    unsafe { libc::syscall(libc::SYS_futex, lower(word), libc::FUTEX_WAKE, 1) };
}
