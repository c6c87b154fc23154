//! Tests in real time: they run without other work on the computer.

mod doctor;
#[cfg(target_os = "linux")]
mod drives;
#[cfg(unix)]
mod machines;
