//! What is asked of the operating system, each as one safe function.

#[cfg(target_os = "linux")]
mod linux;
#[cfg(target_os = "linux")]
pub(crate) use linux::*;

#[cfg(not(target_os = "linux"))]
mod other;
#[cfg(not(target_os = "linux"))]
pub(crate) use other::*;

/// What the system has counted of a thread since its birth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Counters {
    /// Time on a CPU [ns].
    pub(crate) cpu: u64,
    /// Pages that had to be found, without and with reading from a disk.
    pub(crate) minor_faults: u64,
    pub(crate) major_faults: u64,
    /// How often it gave the CPU away: to wait, or because another took it.
    pub(crate) waits: u64,
    pub(crate) preemptions: u64,
}

/// So much of the stack is touched before the first cycle [bytes].
pub(crate) const STACK: usize = 256 * 1024;

/// Makes the system give the pages of the stack now.
#[inline(never)]
pub(crate) fn touch_stack() {
    let mut pages = [1u8; STACK];
    // Not left out: somebody might look.
    std::hint::black_box(&mut pages);
}
