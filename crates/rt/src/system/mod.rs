//! Calls of the operating system as safe functions.

#[cfg(target_os = "linux")]
mod linux;
#[cfg(target_os = "linux")]
pub(crate) use linux::*;

#[cfg(not(target_os = "linux"))]
mod other;
#[cfg(not(target_os = "linux"))]
pub(crate) use other::*;

/// Counters of a thread since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Counters {
    /// Time on a CPU [ns].
    pub(crate) cpu: u64,
    /// Page faults without and with disk access.
    pub(crate) minor_faults: u64,
    pub(crate) major_faults: u64,
    /// Voluntary and involuntary context switches.
    pub(crate) waits: u64,
    pub(crate) preemptions: u64,
}

/// Size of the stack that is touched before the first cycle [bytes].
pub(crate) const STACK: usize = 256 * 1024;

/// Makes the pages of the stack resident.
#[inline(never)]
pub(crate) fn touch_stack() {
    let mut pages = [1u8; STACK];
    // Prevents the compiler from removing the writes.
    std::hint::black_box(&mut pages);
}
