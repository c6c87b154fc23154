//! Synchronization types of [`pages`](crate::pages), in one place: a test replaces them with those of loom.

#![expect(unsafe_code, reason = "a cell that two threads share")]

pub(crate) use std::sync::Arc;
pub(crate) use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// A cell with access through a raw pointer.
pub(crate) struct UnsafeCell<T>(std::cell::UnsafeCell<T>);

// SAFETY: access is only through the pointers, whose users guarantee the order; the contents move between threads, so
// they must be `Send`.
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
