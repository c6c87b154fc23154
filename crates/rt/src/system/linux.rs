//! System calls of Linux.

#![expect(unsafe_code, reason = "system calls that std lacks")]

use std::fs::File;
use std::io;
use std::mem::MaybeUninit;
use std::net::UdpSocket;
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

/// Identifier of a thread of this process.
pub(crate) type ThreadId = libc::pid_t;

fn result(status: libc::c_int) -> io::Result<()> {
    if status == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// Time of a clock [ns]; 0 if the clock does not exist.
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

/// Sleeps until the monotonic clock reaches the deadline.
pub(crate) fn sleep_until(deadline: Nanoseconds) {
    let time = libc::timespec { tv_sec: (deadline / NANOS) as _, tv_nsec: (deadline % NANOS) as _ };
    let interrupted = || {
        // SAFETY: `time` outlives the call; no remainder is requested.
        unsafe {
            libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &time, std::ptr::null_mut())
                == libc::EINTR
        }
    };
    // A signal wakes too early; the deadline is absolute, so the same call continues the sleep.
    while interrupted() {}
}

/// The calling thread.
pub(crate) fn this_thread() -> ThreadId {
    // SAFETY: takes nothing and cannot fail.
    unsafe { libc::gettid() }
}

/// Counters of the calling thread: two system calls.
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

/// Counters of another thread of this process; its files stay open.
pub(crate) struct OtherThread {
    clock: libc::clockid_t,
    stat: File,
    status: File,
}

impl OtherThread {
    /// # Errors
    /// `/proc` does not exist.
    pub(crate) fn open(thread: ThreadId) -> io::Result<Self> {
        let open = |file: &str| File::open(format!("/proc/self/task/{thread}/{file}"));
        // Identifier as in clock_getcpuclockid(3) and the kernel: per thread, scheduler time.
        Ok(OtherThread { clock: (!thread << 3) | 6, stat: open("stat")?, status: open("status")? })
    }

    /// # Errors
    /// The thread has ended.
    pub(crate) fn counters(&self) -> io::Result<Counters> {
        let mut buffer = [0u8; 4096];
        let mut text = |file: &File| -> io::Result<String> {
            let length = file.read_at(&mut buffer, 0)?;
            Ok(String::from_utf8_lossy(&buffer[..length]).into_owned())
        };
        let invalid = || io::Error::from(io::ErrorKind::InvalidData);
        let stat = text(&self.stat)?;
        // The name in parentheses may contain any character; the fields after it are numbered from 3.
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
        let field = |number: usize| fields.get(number - 3).and_then(|text| text.parse().ok()).ok_or_else(invalid);
        let status = text(&self.status)?;
        let line = |name: &str| {
            let value = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
            value.and_then(|text| text.trim().parse().ok()).ok_or_else(invalid)
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

/// SCHED_FIFO for the first thread of a process; 0 is the calling thread.
pub(crate) fn set_priority_of(process: u32, priority: u8) -> io::Result<()> {
    let process = process.try_into().map_err(|_| io::Error::from_raw_os_error(libc::ESRCH))?;
    let parameters = libc::sched_param { sched_priority: priority.into() };
    // SAFETY: `parameters` outlives the call.
    result(unsafe { libc::sched_setscheduler(process, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &parameters) })
}

/// Runs the calling thread on this CPU only.
pub(crate) fn pin(cpu: usize) -> io::Result<()> {
    // SAFETY: a `cpu_set_t` is bits, of which zero is none; the index of CPU_SET is within it.
    let set = unsafe {
        let mut set = MaybeUninit::<libc::cpu_set_t>::zeroed().assume_init();
        if cpu >= 8 * size_of_val(&set) {
            return Err(io::Error::from_raw_os_error(libc::EINVAL));
        }
        libc::CPU_SET(cpu, &mut set);
        set
    };
    // SAFETY: the pointer is valid for the given size; 0 is the calling thread.
    result(unsafe { libc::sched_setaffinity(0, size_of_val(&set), &set) })
}

/// Excludes this CPU for the calling thread and the threads that it starts later.
pub(crate) fn keep_off(cpu: usize) -> io::Result<()> {
    // SAFETY: a `cpu_set_t` is bits, of which zero is none; the pointer is valid for the given size, the index of
    // CPU_CLR is within it; 0 is the calling thread.
    unsafe {
        let mut set = MaybeUninit::<libc::cpu_set_t>::zeroed().assume_init();
        result(libc::sched_getaffinity(0, size_of_val(&set), &mut set))?;
        if cpu < 8 * size_of_val(&set) {
            libc::CPU_CLR(cpu, &mut set);
        }
        // The system refuses an empty set.
        result(libc::sched_setaffinity(0, size_of_val(&set), &set))
    }
}

/// Locks all present and future pages of the process in memory.
pub(crate) fn lock_memory() -> io::Result<()> {
    // SAFETY: only flags; changes no contents.
    result(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
}

/// Unlocks the memory of the process.
pub(crate) fn unlock_memory() {
    // SAFETY: takes nothing; changes no contents.
    unsafe { libc::munlockall() };
}

/// Sets the time by which the system may delay a wake-up of the calling thread.
pub(crate) fn set_timer_slack(nanoseconds: u64) -> io::Result<()> {
    // SAFETY: this request takes a number.
    result(unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, nanoseconds as libc::c_ulong) })
}

/// Opens a terminal in raw mode: no echo, no line editing, no control characters.
pub(crate) fn open_serial(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    let port = options.read(true).write(true).custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY).open(path)?;
    let mut settings = MaybeUninit::<libc::termios>::zeroed();
    // SAFETY: the descriptor is open as long as `port`, and the pointer is valid for one `termios`.
    result(unsafe { libc::tcgetattr(port.as_raw_fd(), settings.as_mut_ptr()) })?;
    // SAFETY: `settings` is numbers, filled above; the first call changes them, the second reads them.
    result(unsafe {
        libc::cfmakeraw(settings.as_mut_ptr());
        libc::tcsetattr(port.as_raw_fd(), libc::TCSANOW, settings.as_ptr())
    })?;
    Ok(port)
}

/// Makes a socket without a peer report a closed port of a receiver.
pub(crate) fn report_closed_ports(socket: &UdpSocket) -> io::Result<()> {
    let (level, option) = match socket.local_addr()?.is_ipv4() {
        true => (libc::IPPROTO_IP, libc::IP_RECVERR),
        false => (libc::IPPROTO_IPV6, libc::IPV6_RECVERR),
    };
    let on: libc::c_int = 1;
    // SAFETY: the descriptor is open as long as `socket`; the pointer is valid for the given size.
    result(unsafe {
        libc::setsockopt(socket.as_raw_fd(), level, option, (&raw const on).cast(), size_of_val(&on) as libc::socklen_t)
    })
}

/// The lower half of a word, used as a futex.
fn lower(word: &AtomicU64) -> *mut u32 {
    word.as_ptr().cast::<u32>().wrapping_add(usize::from(cfg!(target_endian = "big")))
}

/// Waits until woken, also from another process, unless the lower half of the word differs from `value`.
pub(crate) fn wait_for_word(word: &AtomicU64, value: u32, within: Duration) {
    let time = libc::timespec { tv_sec: within.as_secs() as _, tv_nsec: within.subsec_nanos() as _ };
    // SAFETY: the kernel reads half of a live word and a `timespec`. The result is not needed: the caller checks the
    // word again.
    unsafe { libc::syscall(libc::SYS_futex, lower(word), libc::FUTEX_WAIT, value, &raw const time) };
}

/// Wakes a waiter.
pub(crate) fn wake_for_word(word: &AtomicU64) {
    // SAFETY: the kernel uses only the address.
    unsafe { libc::syscall(libc::SYS_futex, lower(word), libc::FUTEX_WAKE, 1) };
}
