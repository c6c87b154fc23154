//! The whole bench in closed loop: its external inputs.

use stickslip::noise::Normals;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::friction::{ElastoPlastic, Model};
use stickslip_core::plant::{Plant, VirtualMachine};
use stickslip_core::render::Law;
use stickslip_core::tick::{BenchInput, Order, Tick, VirtualBench};

use super::run::{Record, Run, numbers};

/// Tick [s], and steps of the virtual machine in it.
const TICK: f64 = 250e-6;
const STEPS: usize = 10;

/// A bench with elasto-plastic friction that follows a sine under the paper's law, for a number of ticks.
pub fn bench(ticks: u64) -> (VirtualBench<f64>, Run) {
    let mut plant = Plant::default();
    plant.screw_friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    plant.wheel.friction.model = Model::ElastoPlastic(ElastoPlastic::default());
    let machine = VirtualMachine { parts: plant.prepare(STEPS, TICK / STEPS as f64) };
    let tick = Tick { law: Law::Paper(Default::default()), ..Tick::default() };
    let normals = Normals::new(1);
    let step = |cycle: u64| {
        let time = cycle as f64 * TICK;
        let position = 1.0 - libm::cos(5.0 * time);
        let velocity = 5.0 * libm::sin(5.0 * time);
        let reference = Setpoint { position, velocity, ..Setpoint::default() };
        let mut order = Order { reference, control: 1.0, render: 1.0, ..Order::default() };
        order.schedule(cycle, 4);
        Record::Step(numbers(&BenchInput { order, external_torque: 0.0, noise: normals.of_tick(cycle) }))
    };
    (
        VirtualBench { machine, delays: Default::default(), tick },
        Run { records: (0..ticks).map(step).collect(), dt: TICK },
    )
}
