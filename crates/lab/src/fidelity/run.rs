//! One machine in one scenario: the tick in lockstep, without homing and supervision.

use stickslip_core::block::Block as _;
use stickslip_core::control::reference::Generator;
use stickslip_core::plant::{PlantInput, VirtualMachine};
use stickslip_core::render::Law;
use stickslip_core::tick::{BenchInput, BenchState, Order, VirtualBench};

use super::machine::machine;
use super::scenario::{Drive, Plan};
use super::{Cell, Role, Scenario};
use crate::noise::Normals;
use crate::{Error, Watch, design, integrator};

/// What truly happened, once a sample of the position controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// Time between samples [s].
    pub period: f64,
    /// True angle of the screw [rad].
    pub angle: Vec<f64>,
    /// Set-point [rad]; 0 where nothing is controlled.
    pub reference: Vec<f64>,
    /// True torque of the drive motor [N m].
    pub drive_torque: Vec<f64>,
    /// True torque of the load motor, against positive motion [N m].
    pub load_torque: Vec<f64>,
    /// Whether it came to its end: no fault of the supervision, all numbers.
    pub stable: bool,
}

/// Runs a machine of the cell in a scenario.
pub(super) fn run(cell: &Cell, role: Role, scenario: &Scenario, seed: u64, watch: &Watch) -> Result<Trace, Error> {
    let settings = &cell.preset.bench;
    let plan = scenario.plan(&cell.preset)?;
    let (dt, divider) = (settings.tick_time(), settings.divider());
    let (steps, step) = settings.plant_steps();
    let plant = machine(cell, role);
    let machine = VirtualMachine { parts: integrator::prepare(&plant, steps, step)? };
    let mut tick = design::software(&cell.preset.model, settings)?;
    tick.controller = plan.controller;
    tick.law = if role == Role::Rendered { cell.law } else { Law::Off };
    let bench = VirtualBench { machine, tick };
    let mut state = BenchState::default();
    // One tick at rest fills the pickups and gives the first readings.
    state.measurement = bench.machine.step(&mut state.plant, PlantInput::default(), dt);

    let normals = Normals::new(seed);
    let mut setpoints = plan.setpoints(settings.tick_rate);
    let rest = (plan.rest * settings.tick_rate) as u64;
    let cycles = rest + (plan.duration * settings.tick_rate) as u64;
    let samples = (cycles / divider) as usize;
    let column = || Vec::with_capacity(samples);
    let period = dt * divider as f64;
    let mut trace = Trace {
        period,
        angle: column(),
        reference: column(),
        drive_torque: column(),
        load_torque: column(),
        stable: true,
    };
    for cycle in 0..cycles {
        let mut order = Order { render: 1.0, ..Order::default() };
        order.schedule(cycle, divider);
        let time = (cycle as f64 - rest as f64) * dt;
        if let Some(generator) = &mut setpoints {
            order.control = 1.0;
            if cycle >= rest {
                order.reference = generator.next();
            }
        } else {
            order.added_torque = plan.drive.torque(time);
        }
        let input = BenchInput { order, external_torque: 0.0, noise: normals.of_tick(cycle) };
        bench.step(&mut state, input, dt);
        if (cycle + 1) % divider != 0 {
            continue;
        }
        let parts = &state.plant.machine;
        trace.angle.push(parts.angle);
        trace.reference.push(order.reference.position);
        trace.drive_torque.push(parts.motor_torque);
        trace.load_torque.push(parts.load_current * plant.load_motor.winding.torque_constant);
        // What the supervision of a bench would stop; written so that a NaN is a fault.
        let following =
            order.control < 0.5 || (order.reference.position - parts.angle).abs() <= settings.safety.following_error;
        if !(following && parts.velocity.abs() <= settings.safety.speed) {
            trace.stable = false;
            break;
        }
        if plan.drive.is_over(parts.angle) {
            break;
        }
        if cycle % 1024 < divider {
            watch.check()?;
        }
    }
    Ok(trace)
}

impl Plan {
    /// The set-points, where the position is controlled.
    fn setpoints(&self, rate: f64) -> Option<Generator<'_>> {
        match self.drive {
            Drive::Position(reference) => Some(Generator::new(reference, rate)),
            _ => None,
        }
    }
}

impl Trace {
    /// How much the load motor chatters: root mean square of its torque's change from sample to sample [N m].
    pub fn chatter(&self) -> f64 {
        let changes = self.load_torque.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        libm::sqrt(changes.sum::<f64>() / (self.load_torque.len() as f64 - 1.0).max(1.0))
    }
}
