//! Tests in real time: they run without other work on the computer.

mod doctor;
#[cfg(unix)]
mod machines;
