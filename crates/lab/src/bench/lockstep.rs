//! The software of the bench in lockstep with its machine.

use stickslip_core::block::Block as _;
use stickslip_core::control::{ControllerInput, PositionController};
use stickslip_core::friction::Stribeck;
use stickslip_core::render::{Correction, Law};
use stickslip_core::supervise::{Safety, SafetyInput, SafetyState};
use stickslip_core::tick::{Measurement, Order, Tick, TickInput, TickOutput, TickState};

use super::io::{Io, Voltages};
use super::{Bench, Command, Frame};
use crate::preset::{Model, Settings};
use crate::{Error, design};

/// The software of the bench over a machine that it keeps step with: the software computes on the readings of the
/// tick's begin; what it wrote in the tick before acts meanwhile.
#[derive(Clone, Debug)]
pub struct LockstepBench<M> {
    pub(super) machine: M,
    model: Model<f64>,
    settings: Settings<f64>,
    tick: Tick<f64>,
    state: TickState<f64>,
    /// Readings at the begin of the tick.
    readings: Measurement<f64>,
    /// Computed in the last tick; the amplifiers get it now.
    voltages: Voltages<f64>,
    safety: Safety,
    cycle: u64,
    /// What a position controller would have read in the last tick.
    last: ControllerInput<f64>,
    divider: u64,
}

impl<M: Io> LockstepBench<M> {
    /// The software for what is believed and set, over a machine with these readings at rest.
    pub(super) fn over(
        model: &Model<f64>,
        settings: &Settings<f64>,
        machine: M,
        readings: Measurement<f64>,
    ) -> Result<Self, Error> {
        Ok(LockstepBench {
            machine,
            model: *model,
            settings: *settings,
            tick: design::software(model, settings)?,
            state: TickState::default(),
            readings,
            voltages: Voltages::default(),
            safety: Safety::new(settings.safety),
            cycle: 0,
            last: ControllerInput::default(),
            divider: settings.divider(),
        })
    }

    /// What the next tick computes on under this command: the software with its parameters, its state, what it reads.
    /// A replay or another processor that is given the same gives the same.
    pub fn next_tick(&self, command: &Command) -> (Tick<f64>, TickState<f64>, TickInput<f64>) {
        let reads = TickInput { measurement: self.readings, order: self.order(command) };
        (self.tick, self.state, reads)
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
        let model = &self.model;
        let per_current = |torque: f64, constant: f64| if constant > 0.0 { torque / constant } else { 0.0 };
        let input = SafetyInput {
            measured_angle: signals.measured_angle,
            measured_velocity: signals.measured_motor_velocity,
            drive_current: per_current(signals.commanded_torque, model.motor.torque_constant),
            load_current: per_current(signals.measured_load_torque, model.load_motor.torque_constant),
            // Without control there is nothing to follow.
            reference_position: if order.control > 0.5 { order.reference.position } else { signals.measured_angle },
        };
        if let SafetyState::Fault(fault) = self.safety.step(input, self.settings.tick_time()) {
            self.voltages = Voltages::default();
            self.state.commanded_torque = 0.0;
            self.state.computed_torque = 0.0;
            return Err(Error::BenchFault { cycle: self.cycle, reason: fault.to_string() });
        }
        Ok(())
    }
}

impl<M: Io> Bench for LockstepBench<M> {
    fn model(&self) -> &Model<f64> {
        &self.model
    }

    fn settings(&self) -> &Settings<f64> {
        &self.settings
    }

    fn step(&mut self, command: Command) -> Result<Frame, Error> {
        let order = self.order(&command);
        let reads = TickInput { measurement: self.readings, order };
        let signals = self.tick.step(&mut self.state, reads, self.settings.tick_time());
        let exchanged = self.machine.exchange(self.voltages);
        self.readings =
            exchanged.map_err(|fault| Error::BenchFault { cycle: self.cycle, reason: fault.to_string() })?;
        self.voltages = Voltages { servo_voltage: signals.servo_voltage, amplifier_voltage: signals.amplifier_voltage };
        let frame = Frame {
            cycle: self.cycle,
            angle: signals.measured_angle - self.safety.zero().unwrap_or(0.0),
            setpoint: command.setpoint,
            measurement: reads.measurement,
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
        let tick = &mut self.tick;
        tick.controller = controller;
        tick.control_period = self.settings.tick_time() * divider as f64;
        self.divider = divider;
        self.state.controller = controller.take_over(self.state.commanded_torque, self.last);
    }

    fn set_law(&mut self, law: Law<f64>) -> Result<(), Error> {
        let current = design::load_current_control(&law, self.model(), self.settings())?;
        // What the integrator held of the voltage drop, the new control may feed forward, or the other way round.
        let drop = self.state.law.torque / current.torque_constant;
        self.state.current.integral += (self.tick.current.resistance - current.resistance) * drop;
        self.tick.current = current;
        self.tick.law = law;
        self.state.law.swapped = 1.0;
        Ok(())
    }

    fn set_correction(&mut self, correction: Correction<f64>) {
        self.tick.correction = correction;
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.machine.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }

    fn learn_own(&mut self, own: Stribeck<f64>) {
        self.model.own = own;
    }
}
