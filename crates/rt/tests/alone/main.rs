//! Tests that measure a thread of the executive; run them without other load.
#![allow(unsafe_code, reason = "a counting allocator, and pages returned to the system")]

mod allocation;
#[cfg(target_os = "linux")]
mod causes;
#[allow(unreachable_pub, reason = "support of tests")]
#[path = "../counting/mod.rs"]
mod counting;
