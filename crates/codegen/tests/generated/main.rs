//! The generated C and diagrams. One program of tests, linked once.

mod clean;
mod diagram;
mod guards;
mod module;
#[path = "../support/mod.rs"]
mod support;
