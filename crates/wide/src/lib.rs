//! The virtual bench in the widest vectors of the processor: alone, and in eight vector lanes.
//!
//! These functions are a package because they take the longest to compile, for all vector widths: they are compiled
//! once.

use multiversion::multiversion;
use multiversion::target::match_target;
use stickslip_core::fields::Fields as _;
use stickslip_core::plant::{Glide, GlidingMachine, PlantInput, PlantState};
use stickslip_core::scalar::Lanes;
use stickslip_core::tick::{BenchInput, BenchState, Measurement, TickOutput, VirtualBench};

/// Number of lanes: one vector of the widest registers.
pub const LANES: usize = 8;

/// A number in each lane.
pub type Wide = Lanes<f64, LANES>;

/// A tick of each bench, with the same bits as alone; see [`VirtualBench::tick_of`]. The width of the vectors is chosen
/// at run time for the processor. x86 processors without AVX2 compute one lane after the other: vectors of two numbers
/// save nothing, and their code takes longest to compile.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub fn tick(
    bench: &VirtualBench<Wide>,
    steps: (usize, &Glide<Wide>),
    state: &mut BenchState<Wide>,
    input: &BenchInput<Wide>,
    dt: Wide,
) -> TickOutput<Wide> {
    match_target! {
        "x86_64+avx512f+avx512dq+avx512vl" => bench.tick_of(steps, state, *input, dt),
        "x86_64+avx2" => bench.tick_of(steps, state, *input, dt),
        "x86_64" => lane_by_lane(bench, steps, state, input, dt),
        _ => bench.tick_of(steps, state, *input, dt),
    }
}

/// A tick of one bench, with the contacts of its machine side by side; see [`VirtualBench::tick_of`].
#[multiversion(targets("x86_64+avx2"))]
pub fn tick_alone(
    bench: &VirtualBench<f64>,
    steps: (usize, &Glide<f64>),
    state: &mut BenchState<f64>,
    input: &BenchInput<f64>,
    dt: f64,
) -> TickOutput<f64> {
    bench.tick_of(steps, state, *input, dt)
}

/// Steps of one machine, with its contacts side by side; see [`GlidingMachine::take`].
#[multiversion(targets("x86_64+avx2"))]
pub fn take(
    machine: &GlidingMachine<f64>,
    steps: usize,
    state: &mut PlantState<f64>,
    input: &PlantInput<f64>,
    dt: f64,
) -> Measurement<f64> {
    machine.take(steps, state, *input, dt)
}

/// The same bits, one lane after the other.
pub fn lane_by_lane(
    bench: &VirtualBench<Wide>,
    (steps, glide): (usize, &Glide<Wide>),
    state: &mut BenchState<Wide>,
    input: &BenchInput<Wide>,
    dt: Wide,
) -> TickOutput<Wide> {
    let before = *state;
    let mut output = None;
    for lane in 0..LANES {
        let of = |value: Wide| value.0[lane];
        let mut one = before.map(&mut { of });
        let steps = (steps, &glide.map(&mut { of }));
        let result = bench.map(&mut { of }).tick_of(steps, &mut one, input.map(&mut { of }), of(dt));
        let mut put = |mut all: Wide, one: Wide| {
            all.0[lane] = one.0[lane];
            all
        };
        *state = state.merge(&one.map(&mut |value| Lanes([value; LANES])), &mut put);
        let result = result.map(&mut |value| Lanes([value; LANES]));
        output = Some(output.map_or(result, |all: TickOutput<Wide>| all.merge(&result, &mut put)));
    }
    output.expect("there are lanes")
}
