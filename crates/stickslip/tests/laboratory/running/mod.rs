//! Tests of a running bench: faults, a long run, another build. One program, so that the long ones run at once.

#[path = "../../../examples/soak/crowd.rs"]
mod crowd;
mod kept_runs;
mod real_time;
mod safety;
#[path = "../../../examples/soak/soak.rs"]
mod soak;
mod soaked;
