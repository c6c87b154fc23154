//! The laboratory by its public interface: experiments, studies, running benches, XCP. One program, linked once.
#![expect(clippy::unwrap_used, reason = "tests")]

mod ahead;
mod calibrated;
mod calibration;
mod coverage;
mod experiments;
mod fidelity;
mod fuzz;
mod integrator;
mod integrator_stability;
mod late_drives;
mod linear;
#[cfg(unix)]
mod loaded;
mod margins;
mod mdf;
mod measurement;
mod prediction;
mod running;
mod without_accelerometer;
mod xcp;
