//! The whole virtual bench: software and ten steps of the virtual machine a tick.

use stickslip_core::friction::{ElastoPlastic, Model};
use stickslip_core::plant::{InputDelays, Plant, VirtualMachine};
use stickslip_core::render::Law;
use stickslip_core::tick::{Tick, VirtualBench};

/// Plant steps per tick.
pub const STEPS: usize = 10;
/// Tick [s].
pub const TICK: f64 = 250e-6;

/// The bench with elasto-plastic friction and the paper's law.
pub fn bench() -> VirtualBench<f64> {
    let mut plant = Plant::<f64>::default();
    plant.screw_friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    plant.wheel.friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    let tick = Tick { law: Law::Paper(Default::default()), ..Tick::default() };
    let machine = VirtualMachine { parts: plant.prepare(STEPS, TICK / STEPS as f64) };
    VirtualBench { machine, delays: InputDelays::default(), tick }
}
