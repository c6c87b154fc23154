//! Every interleaving of the lock-free exchanges, by loom.
#![expect(unsafe_code, reason = "a design that must fail under loom")]

mod pages;
mod slot;

/// The atomics and cells of loom in place of those of std.
mod sync {
    pub(crate) use loom::cell::UnsafeCell;
    pub(crate) use loom::sync::Arc;
    pub(crate) use loom::sync::atomic::{AtomicU8, AtomicU64, Ordering};
}
