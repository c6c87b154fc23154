//! Fast simulation with access to the true state: the signal path closed over the machine.
//!
//! No homing, no supervision, no commands. Measuring code must not use it, since it has access to the true state. Over
//! [`Lanes`] several machines run in vector lanes, each with the same bits as alone.
//!
//! [`Lanes`]: stickslip_core::scalar::Lanes

mod lanes;

pub use lanes::{LANES, LaneNumber, vectors};
use stickslip_core::block::Block as _;
use stickslip_core::fields::Fields as _;
use stickslip_core::plant::{Glide, GlidingMachine, Noise, Plant, PlantInput};
use stickslip_core::tick::{BenchInput, BenchState, Order, Tick, TickOutput, VirtualBench};

use crate::integrator;
use stickslip_base::Error;
use stickslip_base::noise::{Normals, Ticks};
use stickslip_base::preset::Settings;

/// A machine under software, tick after tick; over lanes, one machine for each lane.
#[derive(Clone, Debug)]
pub struct FastBench<T = f64> {
    bench: VirtualBench<T>,
    glide: Glide<T>,
    state: BenchState<T>,
    /// Noise of each lane.
    normals: [Normals; LANES],
    ticks: Ticks,
    dt: f64,
    divider: u64,
    cycle: u64,
}

impl FastBench {
    /// A machine at rest, the position controller due every `divider` ticks, with the noise of a seed.
    ///
    /// # Errors
    /// Errors of the integrator.
    pub fn new(
        plant: &Plant<f64>,
        tick: Tick<f64>,
        settings: &Settings<f64>,
        divider: u64,
        seed: u64,
    ) -> Result<Self, Error> {
        let settings = with_jitter_step(settings, plant);
        let (dt, (steps, step)) = (settings.tick_time(), settings.plant_steps());
        let plant = &settings.plant_with_amplifier(plant);
        let parts = integrator::prepare(plant, steps, step)?;
        let GlidingMachine { short: machine, glide } = GlidingMachine::in_short_steps(parts, step);
        let bench = VirtualBench { machine, delays: settings.input_delays(plant)?, tick };
        let mut state = BenchState::default();
        // One tick at rest fills the pickups and gives the first readings.
        state.measurement = bench.machine.step(&mut state.plant, PlantInput::default(), dt);
        let ticks = Ticks::new(steps, step, plant.tick_jitter);
        Ok(FastBench { bench, glide, state, normals: [Normals::new(seed); LANES], ticks, dt, divider, cycle: 0 })
    }
}

impl FastBench {
    /// The same with long steps in steady sliding.
    #[must_use]
    pub fn in_long_steps(mut self) -> Self {
        let parts = self.bench.machine.parts;
        self.glide = GlidingMachine::new(parts, self.dt / parts.steps as f64).glide;
        self
    }
}

impl<T: LaneNumber> FastBench<T> {
    /// The next tick under an order, with its own schedule.
    pub fn tick(&mut self, order: Order<T>) -> TickOutput<T> {
        self.tick_with(&mut BenchInput { order, external_torque: T::of(0.0), noise: self.noise() })
    }

    /// The same with all inputs of the tick, and the noise as [`Normals::of_tick`] gives it; sets the schedule in them.
    pub(crate) fn tick_with(&mut self, input: &mut BenchInput<T>) -> TickOutput<T> {
        input.order.schedule(self.cycle, self.divider);
        let steps = self.ticks.steps(&self.normals[0], self.cycle);
        self.cycle += 1;
        T::tick(&self.bench, (steps, &self.glide), &mut self.state, input, T::of(self.dt))
    }

    /// The noise of all lanes, if it is the same.
    pub(crate) fn common_noise(&self) -> Option<Normals> {
        self.normals.iter().all(|normals| *normals == self.normals[0]).then_some(self.normals[0])
    }

    /// The noise of the next tick; neighbours of the same seed share it.
    pub(crate) fn noise(&self) -> Noise<T> {
        let [first, ..] = self.normals;
        let (mut last, mut drawn) = (first, first.of_tick(self.cycle).map(&mut T::of));
        let mut noise = drawn;
        for (lane, &normals) in self.normals.iter().enumerate().skip(1) {
            if normals != last {
                (last, drawn) = (normals, normals.of_tick(self.cycle).map(&mut T::of));
            }
            if normals != first {
                noise = noise.merge(&drawn, &mut |all: T, one| all.with_lane(lane, one.lane(lane)));
            }
        }
        noise
    }

    /// The true state of machine and software.
    pub fn true_state(&self) -> &BenchState<T> {
        &self.state
    }
}

/// Settings with a step of the virtual machine short enough for the jitter of its ticks.
fn with_jitter_step(settings: &Settings<f64>, plant: &Plant<f64>) -> Settings<f64> {
    let longest = if plant.tick_jitter > 0.0 { plant.tick_jitter } else { settings.plant_step };
    Settings { plant_step: settings.plant_step.min(longest), ..*settings }
}
