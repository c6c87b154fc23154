//! `cargo xtask bench`: ratios to named peers.

use crate::command::Cargo;
use crate::tree;

/// Runs the benchmarks whose name contains `name`, optimised as the released program.
pub(crate) fn bench(name: Option<&str>) -> Result<(), String> {
    let root = tree::root()?;
    let run = ["run", "--quiet", "--profile", "shipped", "--package", "stickslip-benches", "--"];
    Cargo::new(&root, &root).run(run.into_iter().chain(name))
}
