//! What [`pages`](crate::pages) is built on, in one place: its test puts loom's doubles here.

#![expect(unsafe_code, reason = "a cell that two threads share")]

pub(crate) use std::sync::Arc;
pub(crate) use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// A cell whose contents are reached through a raw pointer.
pub(crate) struct UnsafeCell<T>(std::cell::UnsafeCell<T>);

// SAFETY: nothing is reached but through the pointers, whose users answer for the order; the contents go to another
// thread, so they must be `Send`.
unsafe impl<T: Send> Sync for UnsafeCell<T> {}

impl<T> UnsafeCell<T> {
    pub(crate) fn new(value: T) -> Self {
        UnsafeCell(std::cell::UnsafeCell::new(value))
    }

    pub(crate) fn with<R>(&self, read: impl FnOnce(*const T) -> R) -> R {
        read(self.0.get())
    }

    pub(crate) fn with_mut<R>(&self, write: impl FnOnce(*mut T) -> R) -> R {
        write(self.0.get())
    }
}
