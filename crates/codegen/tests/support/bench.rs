//! The whole virtual bench as a block: software and ten steps of the virtual machine a tick.

use stickslip_core::Fields;
use stickslip_core::block::Block;
use stickslip_core::friction::{ElastoPlastic, Model};
use stickslip_core::plant::Plant;
use stickslip_core::render::Law;
use stickslip_core::scalar::Scalar;
use stickslip_core::tick::{BenchInput, BenchState, Tick, TickOutput, VirtualBench};

/// Plant steps a tick.
pub const STEPS: usize = 10;
/// Plant step [s].
pub const PLANT_STEP: f64 = 25e-6;

/// One tick of the bench; its step is a plant step.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Cycle<T> {
    /// Machine and software.
    pub bench: VirtualBench<T>,
}

impl<T: Scalar> Block<T> for Cycle<T> {
    type State = BenchState<T>;
    type Input = BenchInput<T>;
    type Output = TickOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut BenchState<T>, input: BenchInput<T>, dt: T) -> TickOutput<T> {
        self.bench.cycle(state, input, STEPS, dt)
    }
}

/// The bench with elasto-plastic friction and the paper's law.
pub fn bench() -> Cycle<f64> {
    let mut plant = Plant::<f64>::default();
    plant.screw_friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    plant.wheel.friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    let tick = Tick { law: Law::Paper(Default::default()), ..Tick::default() };
    Cycle { bench: VirtualBench { machine: plant.prepare(STEPS, PLANT_STEP), tick } }
}
