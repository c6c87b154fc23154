//! What holds a machine to its clock: run without other work beside it.

mod doctor;
#[cfg(unix)]
mod machines;
