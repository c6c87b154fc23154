//! Systems without a supported real-time scheduler: an ordinary thread and sleep. Every setting is refused.

use std::convert::Infallible;
use std::io;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use super::Counters;
use crate::clock::Nanoseconds;

/// Whether [`own_counters`] counts.
pub(crate) const COUNTS: bool = false;

/// Identifier of a thread of this process.
pub(crate) type ThreadId = ();

fn refused() -> io::Error {
    io::Error::new(io::ErrorKind::Unsupported, "not supported on this system")
}

pub(crate) fn now() -> Nanoseconds {
    static FIRST: OnceLock<Instant> = OnceLock::new();
    // Plus 1 ns, so that no time is 0.
    FIRST.get_or_init(Instant::now).elapsed().as_nanos() as Nanoseconds + 1
}

pub(crate) fn sleep_until(deadline: Nanoseconds) {
    std::thread::sleep(Duration::from_nanos(deadline.saturating_sub(now())));
}

pub(crate) fn this_thread() -> ThreadId {}

/// No counters; not called, since there is no [`OtherThread`].
pub(crate) fn own_counters() -> Counters {
    Counters::default()
}

/// Counters of another thread are not available.
pub(crate) struct OtherThread(Infallible);

impl OtherThread {
    pub(crate) fn open((): ThreadId) -> io::Result<Self> {
        Err(refused())
    }

    pub(crate) fn counters(&self) -> io::Result<Counters> {
        match self.0 {}
    }
}

pub(crate) fn set_priority(_: u8) -> io::Result<()> {
    Err(refused())
}

pub(crate) fn set_priority_of(_: u32, _: u8) -> io::Result<()> {
    Err(refused())
}

pub(crate) fn pin(_: usize) -> io::Result<()> {
    Err(refused())
}

pub(crate) fn keep_off(_: usize) -> io::Result<()> {
    Err(refused())
}

pub(crate) fn lock_memory() -> io::Result<()> {
    Err(refused())
}

pub(crate) fn unlock_memory() {}

pub(crate) fn set_timer_slack(_: u64) -> io::Result<()> {
    Err(refused())
}

pub(crate) fn open_serial(_: &std::path::Path) -> io::Result<std::fs::File> {
    Err(refused())
}

/// Windows does so by default; other systems cannot.
pub(crate) fn report_closed_ports(_: &std::net::UdpSocket) -> io::Result<()> {
    Ok(())
}

/// Without a wake-up call: polls at short intervals.
pub(crate) fn wait_for_word(_: &std::sync::atomic::AtomicU64, _: u32, within: Duration) {
    std::thread::sleep(within.min(Duration::from_micros(50)));
}

pub(crate) fn wake_for_word(_: &std::sync::atomic::AtomicU64) {}
