//! The virtual bench in lockstep, faster than real time.

use stickslip_core::block::Block as _;
use stickslip_core::control::{ControllerInput, PositionController};
use stickslip_core::friction::Stribeck;
use stickslip_core::plant::{Plant, PlantInput, VirtualMachine};
use stickslip_core::render::Law;
use stickslip_core::supervise::{Safety, SafetyInput, SafetyState};
use stickslip_core::tick::{self, BenchInput, BenchState, Order, Tick, TickInput, TickOutput, TickState};

use super::{Bench, Command, Frame};
use crate::noise::Normals;
use crate::preset::{Model, Preset, Settings};
use crate::{Error, design, integrator};

/// The virtual machine behind the software of the bench.
#[derive(Clone, Debug)]
pub struct VirtualBench {
    preset: Preset<f64>,
    bench: tick::VirtualBench<f64>,
    state: BenchState<f64>,
    safety: Safety,
    normals: Normals,
    cycle: u64,
    /// What a position controller would have read in the last tick.
    last: ControllerInput<f64>,
    divider: u64,
}

impl VirtualBench {
    /// The bench of a preset, switched on and at rest.
    ///
    /// # Errors
    /// A step too long for the virtual machine; whatever the design of observer and current control refuses.
    pub fn new(preset: &Preset<f64>, seed: u64) -> Result<Self, Error> {
        let settings = &preset.bench;
        let (steps, step) = settings.plant_steps();
        let machine = VirtualMachine { parts: integrator::prepare(&preset.plant, steps, step)? };
        let mut state = BenchState::default();
        state.plant.machine.angle = preset.plant.start_angle;
        // One tick at rest fills the pickups and gives the first readings.
        state.measurement = machine.step(&mut state.plant, PlantInput::default(), settings.tick_time());
        Ok(VirtualBench {
            preset: *preset,
            bench: tick::VirtualBench { machine, tick: design::software(&preset.model, settings)? },
            state,
            safety: Safety::new(settings.safety),
            normals: Normals::new(seed),
            cycle: 0,
            last: ControllerInput::default(),
            divider: settings.divider(),
        })
    }

    /// The virtual machine as it truly is. Nothing that measures may ask for it.
    pub fn truth(&self) -> &Plant<f64> {
        &self.bench.machine.parts.plant
    }

    /// What the next tick computes on under this command: the software with its parameters, its state, what it reads.
    /// A replay or another processor that is given the same gives the same.
    pub fn next_tick(&self, command: &Command) -> (Tick<f64>, TickState<f64>, TickInput<f64>) {
        let reads = TickInput { measurement: self.state.measurement, order: self.order(command) };
        (self.bench.tick, self.state.tick, reads)
    }

    /// Order to the software for this tick.
    fn order(&self, command: &Command) -> Order<f64> {
        let flag = |on: bool| f64::from(u8::from(on));
        let on = self.safety.state().allows_torque();
        let mut setpoint = command.setpoint;
        setpoint.position += self.safety.zero().unwrap_or(0.0);
        let mut order = Order {
            reference: setpoint,
            control: flag(command.control && on),
            render: flag(command.render && on),
            added_torque: if on { command.added_torque } else { 0.0 },
            added_load_torque: if on { command.added_load_torque } else { 0.0 },
            ..Order::default()
        };
        order.schedule(self.cycle, self.divider);
        order
    }

    /// Judges a tick; a fault takes the torque away at once.
    fn supervise(&mut self, order: &Order<f64>, signals: &TickOutput<f64>) -> Result<(), Error> {
        let model = &self.preset.model;
        let per_current = |torque: f64, constant: f64| if constant > 0.0 { torque / constant } else { 0.0 };
        let input = SafetyInput {
            measured_angle: signals.measured_angle,
            measured_velocity: signals.measured_motor_velocity,
            drive_current: per_current(signals.commanded_torque, model.motor.torque_constant),
            load_current: per_current(signals.measured_load_torque, model.load_motor.torque_constant),
            // Without control there is nothing to follow.
            reference_position: if order.control > 0.5 { order.reference.position } else { signals.measured_angle },
        };
        if let SafetyState::Fault(fault) = self.safety.step(input, self.preset.bench.tick_time()) {
            self.state.servo_voltage = 0.0;
            self.state.amplifier_voltage = 0.0;
            self.state.tick.commanded_torque = 0.0;
            self.state.tick.computed_torque = 0.0;
            return Err(Error::BenchFault { cycle: self.cycle, reason: fault.to_string() });
        }
        Ok(())
    }
}

impl Bench for VirtualBench {
    fn model(&self) -> &Model<f64> {
        &self.preset.model
    }

    fn settings(&self) -> &Settings<f64> {
        &self.preset.bench
    }

    fn step(&mut self, command: Command) -> Result<Frame, Error> {
        let order = self.order(&command);
        let input = BenchInput { order, external_torque: 0.0, noise: self.normals.of_tick(self.cycle) };
        let measurement = self.state.measurement;
        let signals = self.bench.step(&mut self.state, input, self.preset.bench.tick_time());
        let frame = Frame {
            cycle: self.cycle,
            angle: signals.measured_angle - self.safety.zero().unwrap_or(0.0),
            setpoint: command.setpoint,
            measurement,
            signals,
        };
        self.last = ControllerInput {
            reference_position: order.reference.position,
            reference_velocity: order.reference.velocity,
            reference_acceleration: order.reference.acceleration,
            measured_angle: signals.measured_angle,
            measured_velocity: signals.measured_motor_velocity,
        };
        self.supervise(&order, &signals)?;
        self.cycle += 1;
        Ok(frame)
    }

    fn safety(&mut self) -> &mut Safety {
        &mut self.safety
    }

    fn set_controller(&mut self, controller: PositionController<f64>, divider: u64) {
        let tick = &mut self.bench.tick;
        tick.controller = controller;
        tick.control_period = self.preset.bench.tick_time() * divider as f64;
        self.divider = divider;
        self.state.tick.controller = controller.take_over(self.state.tick.commanded_torque, self.last);
    }

    fn set_law(&mut self, law: Law<f64>) {
        self.bench.tick.law = law;
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        if !(0.0..=1.0).contains(&preload) {
            return Err(Error::OutOfRange {
                name: "the preload of the friction wheel",
                value: preload,
                unit: "1",
                minimum: 0.0,
                maximum: 1.0,
                remedy: "0 releases the linings, 1 presses them on fully.",
            });
        }
        self.bench.machine.parts.plant.wheel.preload = preload;
        Ok(())
    }

    fn preload(&self) -> f64 {
        self.bench.machine.parts.plant.wheel.preload
    }

    fn learn_own(&mut self, own: Stribeck<f64>) {
        self.preset.model.own = own;
    }
}
