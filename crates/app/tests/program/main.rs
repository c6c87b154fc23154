//! The program as its users start it. One program of tests, linked once.
#![expect(clippy::unwrap_used, reason = "tests")]

mod calibrate;
mod command_line;
mod examples;
#[cfg(unix)]
mod guide;
mod identify;
#[cfg(target_os = "linux")]
mod load;
mod protocol;
mod recordings;
mod report;
mod runs;
mod served;
mod workflow;
