//! `cargo xtask bench`: ratios against named peers.

use std::process::Command;

/// Runs the benchmarks whose name contains `name`, optimised as what is handed on.
pub(crate) fn bench(name: Option<&str>) -> Result<(), String> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["run", "--quiet", "--profile", "shipped", "--package", "stickslip-benches", "--"]).args(name);
    let status = cargo.status().map_err(|error| format!("cannot start cargo ({error})"))?;
    if status.success() { Ok(()) } else { Err("the benchmarks did not run to their end".into()) }
}
