//! What watches a thread of the executive: run without other work beside it.
#![allow(unsafe_code, reason = "an allocator that counts, and pages that are taken back")]

mod allocation;
#[cfg(target_os = "linux")]
mod causes;
#[allow(unreachable_pub, reason = "support of tests")]
#[path = "../counting/mod.rs"]
mod counting;
