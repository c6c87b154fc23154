//! The virtual bench eight times side by side, in the widest vectors that the processor has.
//!
//! One function, in a package of its own: it takes a third of the time in which all of the laboratory is compiled, and
//! would take it again for the laboratory's tests.

use multiversion::multiversion;
use stickslip_core::scalar::Lanes;
use stickslip_core::tick::{BenchInput, BenchState, TickOutput, VirtualBench};

/// Machines side by side: one vector of the widest registers.
pub const ABREAST: usize = 8;

/// A number of each of them.
pub type Wide = Lanes<f64, ABREAST>;

/// A tick of each bench, with the bits that it has alone; see [`VirtualBench::tick_of`]. How wide the vectors are is chosen
/// at run time by what the processor can do.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn tick(
    bench: &VirtualBench<Wide>,
    steps: usize,
    state: &mut BenchState<Wide>,
    input: &BenchInput<Wide>,
    dt: Wide,
) -> TickOutput<Wide> {
    bench.tick_of(steps, state, *input, dt)
}
