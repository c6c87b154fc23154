//! A single test program, which is linked once; see the crate.
#![allow(unreachable_pub, reason = "a test has no users")]

mod agree;
mod bench;
mod own;
mod processor;
#[path = "../../../codegen/tests/support/mod.rs"]
mod support;
