//! Lanes compiled for an instruction set: what a study runs.

use stickslip_core::block::Block;
use stickslip_core::friction::{Bend, ElastoPlastic, advance};
use stickslip_core::scalar::{Lanes, Scalar};
use stickslip_core::tick::{BenchInput, BenchState, TickOutput, VirtualBench};

/// One step of elasto-plastic friction: deflection and velocity in, deflection and torque out.
#[inline(always)]
pub fn elastic_step<T: Scalar>(model: &ElastoPlastic<T>, deflection: T, velocity: T, dt: T) -> (T, T) {
    advance(model, Bend { deflection, probe: deflection, velocity, dt })
}

macro_rules! kernels {
    ($module:ident, $features:literal, $lanes:literal) => {
        pub mod $module {
            use super::*;

            pub type Wide = Lanes<f64, $lanes>;

            #[target_feature(enable = $features)]
            #[inline(never)]
            pub fn exponential(x: &mut Wide) {
                *x = x.exp();
            }

            #[target_feature(enable = $features)]
            #[inline(never)]
            pub fn elastic(model: &ElastoPlastic<Wide>, deflection: &mut Wide, torque: &mut Wide, dt: &Wide) {
                (*deflection, *torque) = elastic_step(model, *deflection, *torque, *dt);
            }

            #[target_feature(enable = $features)]
            #[inline(never)]
            pub fn cycle(
                bench: &VirtualBench<Wide>,
                state: &mut BenchState<Wide>,
                input: &BenchInput<Wide>,
                output: &mut TickOutput<Wide>,
                dt: &Wide,
            ) {
                *output = bench.step(state, *input, *dt);
            }
        }
    };
}

// As many lanes as a study runs side by side: two of the narrower vectors, one of the wider.
kernels!(avx2_8, "avx2", 8);
kernels!(avx512_8, "avx512f,avx512dq,avx512vl", 8);
