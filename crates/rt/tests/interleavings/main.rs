//! Loom tests of the lock-free exchanges.
#![expect(unsafe_code, reason = "a wrong design that must fail under loom")]

#[expect(clippy::module_inception, reason = "the source of the crate within the file of its tests")]
mod pages;
#[expect(clippy::module_inception, reason = "the source of the crate within the file of its tests")]
mod slot;

/// The atomics and cells of loom in place of those of std.
mod sync {
    pub(crate) use loom::cell::UnsafeCell;
    pub(crate) use loom::sync::Arc;
    pub(crate) use loom::sync::atomic::{AtomicU8, AtomicU64, Ordering};
}
