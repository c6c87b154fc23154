//! Tests that start the program. They are one test program, which is linked once.
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
