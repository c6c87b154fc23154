//! One cycle of the bench's software: readings and a command in, voltages and a frame out.
//!
//! The [`Tick`] is the signal path; [`Safety`] decides whether torque is permitted. Both run in the same cycle: on time
//! in the real-time loop, as fast as possible in a simulation, with recorded inputs in a replay, with the same bits.
//! This module adds no signal path and uses plain `f64`.
//!
//! Without a command the set-point is brought to rest and held, and added torques end. A bench whose experiment has
//! ended, hangs or was cancelled is therefore held at rest under control. A stop disconnects the motors from commands,
//! controller and law in the same tick: the brake of supervision sets the voltages until the screw is at rest.

mod snapshot;
#[cfg(test)]
mod tests;

use crate::supervise::{
    Brake, Braking, ExternalFault, HomingFault, MachineFault, Refusal, Request, Role, Safety, SafetyInput,
    SafetyLimits, SafetyState,
};
use stickslip_core::Fields;
use stickslip_core::block::Block as _;
use stickslip_core::control::AxisControlInput;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::drive::{Delay, LONGEST_DELAY};
use stickslip_core::estimate::MotionObserver;
use stickslip_core::tick::{Measurement, Order, Tick, TickInput, TickOutput, TickState};

/// Outputs of the software in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Voltages<T> {
    /// For the servo amplifier's D/A converter.
    #[field(symbol = "u_servo", unit = "V")]
    pub servo_voltage: T,
    /// For the load amplifier's D/A converter.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_voltage: T,
}

/// Command of an experiment for a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Set-point, counted from the screw's zero once it is known.
    pub setpoint: Setpoint<f64>,
    /// Whether the position controller is on.
    pub control: bool,
    /// Whether the rendering law is on.
    pub render: bool,
    /// Torque added to the controller's [N m].
    pub added_torque: f64,
    /// Torque of the load motor added to the law's, against positive motion [N m].
    pub added_load_torque: f64,
    /// Number by which the experiment identifies the frame, from 1 on; 0: unused.
    pub mark: u32,
}

/// Frame of a tick for an experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Number of the tick since the start.
    pub cycle: u64,
    /// Screw angle by the encoder [rad], counted from the screw's zero once it is known.
    pub angle: f64,
    /// The command.
    pub command: Command,
    /// Readings at the start of the tick.
    pub measurement: Measurement<f64>,
    /// All signals of the software.
    pub signals: TickOutput<f64>,
    /// Safety state after this tick.
    pub safety: SafetyState,
}

/// Inputs of an external file in the next tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Whether the position is controlled.
    pub controls: bool,
    /// Whether the rendering law is on.
    pub renders: bool,
    /// A sample of the position controller begins: the torque computed from `input` becomes active when it ends.
    pub begins: bool,
    /// A sample ends, which may be the one that has just started.
    pub ends: bool,
    /// Inputs of a position controller.
    pub input: AxisControlInput<f64>,
    /// Estimated velocity of the screw, as a rendering law reads it [rad/s].
    pub estimated_velocity: f64,
    /// Torque of the load motor by its measured current, against positive motion [N m].
    pub measured_load_torque: f64,
    /// Torque reference of the drive in the tick before [N m].
    pub commanded_torque: f64,
}

/// Active torques of external files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExternalTorques {
    /// Of the drive [N m].
    pub torque: f64,
    /// Of the load motor, against positive motion [N m].
    pub load_torque: f64,
}

/// A change between two ticks, active from the next one on.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "it goes through rings by value; the core has no heap")]
pub enum Change {
    /// A request of the operator.
    Request(Request),
    /// Homing found the index at this encoder angle [rad].
    Homed(f64),
    /// Homing failed.
    HomingFailed(HomingFault),
    /// The machine behind a link failed.
    MachineFailed(MachineFault),
    /// The external file in this role failed.
    ForeignFailed(Role, ExternalFault),
    /// A new, complete set of parameters.
    Parameters(Parameters<f64>),
}

/// Parameters of the software: one set, active from the start of a tick on.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Parameters<T> {
    /// The signal path.
    pub tick: Tick<T>,
    /// Limits that stop the bench.
    pub safety: SafetyLimits<T>,
    /// Brake of the bench.
    pub brake: Brake<T>,
    /// Torque constant of the drive motor; 0 where its current is not known.
    #[field(symbol = "K_t", unit = "N m/A", range = 0.0..=100.0)]
    pub drive_torque_constant: T,
    /// Delay of the load amplifier.
    pub load_delay: Delay<T>,
}

/// The software of the bench, cycle after cycle.
#[derive(Clone, Debug)]
pub struct Software {
    parameters: Parameters<f64>,
    state: TickState<f64>,
    safety: Safety,
    tick_time: f64,
    cycle: u64,
    /// Ticks that were missed since the last one.
    missed: u64,
    /// Ticks without a command since the last one.
    silent: u64,
    /// Whether the position controller is to output NaN.
    spoilt: bool,
    /// Outputs of the last tick.
    voltages: Voltages<f64>,
    /// The command that was carried out last.
    command: Command,
    /// Inputs of a position controller in the last tick.
    last: AxisControlInput<f64>,
    /// References of the load current that have not acted yet, the newest first [A].
    asked: [f64; LONGEST_DELAY],
}

impl Software {
    /// Switched off, before its first tick, for ticks of this length [s].
    pub fn new(parameters: Parameters<f64>, tick_time: f64) -> Self {
        Software {
            parameters,
            state: TickState::default(),
            safety: Safety::new(parameters.safety, parameters.brake),
            tick_time,
            cycle: 0,
            missed: 0,
            silent: 0,
            spoilt: false,
            voltages: Voltages::default(),
            command: Command::default(),
            last: AxisControlInput::default(),
            asked: [0.0; LONGEST_DELAY],
        }
    }

    /// Its parameters.
    pub fn parameters(&self) -> &Parameters<f64> {
        &self.parameters
    }

    /// Number of the next tick.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// Outputs of the last tick: the amplifiers get them with the next one.
    pub fn voltages(&self) -> Voltages<f64> {
        self.voltages
    }

    /// Supervision.
    pub fn safety(&self) -> &Safety {
        &self.safety
    }

    /// Inputs of the next tick under this command: parameters, state, readings and order. A replay or another processor
    /// computes the same outputs from them.
    pub fn next_tick(
        &self,
        readings: Measurement<f64>,
        command: &Command,
    ) -> (Tick<f64>, TickState<f64>, TickInput<f64>) {
        (self.parameters.tick, self.state, TickInput { measurement: readings, order: self.order(command) })
    }

    /// Inputs of an external file in the next tick, with these readings and this command.
    pub fn sample(&self, readings: &Measurement<f64>, command: Option<&Command>) -> Sample {
        let order = command.map_or_else(|| self.order(&self.resting()), |command| self.order(command));
        let tick = &self.parameters.tick;
        // The tick will see the same readings from the same state.
        let mut state = self.state;
        let seen = tick.observe(&mut state, *readings, self.tick_time);
        Sample {
            controls: order.control > 0.5,
            renders: order.render > 0.5,
            begins: order.control_due > 0.5,
            ends: order.control_release > 0.5,
            input: AxisControlInput {
                reference: order.reference,
                measured_angle: seen.decoded.angle,
                measured_velocity: seen.motor_velocity,
            },
            estimated_velocity: seen.estimate.velocity,
            measured_load_torque: seen.current * tick.current.torque_constant,
            commanded_torque: state.law.motor_torque,
        }
    }

    /// One cycle on the readings at its start. Without a command the set-point comes to rest.
    pub fn step(&mut self, readings: Measurement<f64>, command: Option<Command>) -> Frame {
        self.step_with(readings, command, ExternalTorques::default())
    }

    /// As [`step`](Self::step), with the torques of external files. The command in the frame includes them, so that a
    /// record contains them.
    pub fn step_with(
        &mut self,
        readings: Measurement<f64>,
        command: Option<Command>,
        brought: ExternalTorques,
    ) -> Frame {
        self.listen(command.is_some());
        let mut command = command.unwrap_or_else(|| self.resting());
        command.added_torque += brought.torque;
        command.added_load_torque += brought.load_torque;
        let order = self.order(&command);
        let input = TickInput { measurement: readings, order };
        let mut signals = self.parameters.tick.step(&mut self.state, input, self.tick_time);
        if core::mem::take(&mut self.spoilt) {
            self.state.computed_torque = f64::NAN;
        }
        self.last = AxisControlInput {
            reference: order.reference,
            measured_angle: signals.measured_angle,
            measured_velocity: signals.measured_motor_velocity,
        };
        let safety = self.supervise(&order, &readings, &mut signals);
        self.voltages = Voltages { servo_voltage: signals.servo_voltage, amplifier_voltage: signals.amplifier_voltage };
        let frame = Frame {
            cycle: self.cycle,
            angle: signals.measured_angle - self.safety.zero().unwrap_or(0.0),
            command,
            measurement: readings,
            signals,
            safety,
        };
        // Without torque the command is discarded: the load may be moved before the next start.
        self.command = if frame.safety.allows_torque() { command } else { Command::default() };
        self.cycle += 1;
        frame
    }

    /// Replaces a tick that was missed, or whose readings were missed, while the machine went on: the number of the
    /// tick advances, the outputs stay.
    pub fn miss(&mut self) {
        self.cycle += 1;
        self.missed += 1;
    }

    /// Fault injection: the position controller outputs NaN.
    pub fn spoil_controller(&mut self) {
        self.spoilt = true;
    }

    /// Applies a change between two ticks.
    ///
    /// # Errors
    /// A request that the present state does not admit.
    pub fn change(&mut self, change: &Change) -> Result<(), Refusal> {
        let before = self.safety.zero().unwrap_or(0.0);
        match *change {
            Change::Request(request) => {
                self.safety.request(request)?;
                if request == Request::Acknowledge {
                    self.begin_anew();
                }
            }
            Change::Homed(index) => self.safety.homed(index),
            Change::HomingFailed(fault) => self.safety.homing_failed(fault),
            Change::MachineFailed(fault) => self.safety.machine_failed(fault),
            Change::ForeignFailed(role, fault) => self.safety.external_failed(role, fault),
            Change::Parameters(parameters) => self.enter(parameters),
        }
        // The held set-point counts from the screw's zero, which may just have been found or lost.
        self.command.setpoint.position -= self.safety.zero().unwrap_or(0.0) - before;
        Ok(())
    }

    /// Resets the state after a fault, which may have corrupted it. The decoder is kept if the zero is known, because
    /// the zero counts from it.
    fn begin_anew(&mut self) {
        let decoder = self.safety.zero().map(|_| self.state.decoder).unwrap_or_default();
        self.state = TickState { decoder, ..TickState::default() };
    }

    /// Sets the parameters from now on. A new controller or rendering law takes over without a bump: it starts with the
    /// torque of the previous one.
    fn enter(&mut self, parameters: Parameters<f64>) {
        let (before, now) = (&self.parameters.tick, &parameters.tick);
        if (now.control, now.control_period) != (before.control, before.control_period) {
            let (torque, last) = (self.state.commanded_torque, self.state.control);
            self.state.control = now.control.take_over(torque, self.last, &last, Some(&before.control));
        }
        if (now.law, now.current) != (before.law, before.current) {
            // The feedforward of the voltage drop changes with the resistance; the integral changes by the opposite
            // amount.
            let drop = self.state.law.torque / now.current.torque_constant;
            self.state.current.integral += (before.current.resistance - now.current.resistance) * drop;
            self.state.law.swapped = 1.0;
        }
        self.safety.set_limits(parameters.safety, parameters.brake);
        self.parameters = parameters;
    }

    /// Order to the tick.
    fn order(&self, command: &Command) -> Order<f64> {
        let flag = |on: bool| f64::from(u8::from(on));
        let on = self.safety.state().allows_torque();
        let control = command.control && on;
        let reference = if control {
            let position = command.setpoint.position + self.safety.zero().unwrap_or(0.0);
            Setpoint { position, ..command.setpoint }
        } else {
            // Without control the set-point is the position of the load: a controller that is switched on or replaced
            // starts there.
            Setpoint { position: self.last.measured_angle, ..Setpoint::default() }
        };
        let mut order = Order {
            reference,
            control: flag(control),
            render: flag(command.render && on),
            added_torque: if on { command.added_torque } else { 0.0 },
            added_load_torque: if on { command.added_load_torque } else { 0.0 },
            ..Order::default()
        };
        order.schedule(self.cycle, self.divider());
        order
    }

    /// Number of ticks in a sample of the position controller.
    fn divider(&self) -> u64 {
        // A sample is a whole number of ticks, up to rounding.
        libm::round(self.parameters.tick.control_period / self.tick_time).max(1.0) as u64
    }

    /// The last command one tick later, decelerating to rest.
    fn resting(&self) -> Command {
        let Setpoint { position, velocity, .. } = self.command.setpoint;
        let most = self.safety.limits().stop_deceleration * self.tick_time;
        // Clamped, not by the sign of the velocity: the last step ends exactly at rest.
        let change = (-velocity).clamp(-most, most);
        let setpoint = Setpoint {
            position: position + (velocity + 0.5 * change) * self.tick_time,
            velocity: velocity + change,
            acceleration: change / self.tick_time,
        };
        Command { setpoint, added_torque: 0.0, added_load_torque: 0.0, mark: 0, ..self.command }
    }

    /// Checks for commands; after too long a gap the bench stops.
    fn listen(&mut self, commanded: bool) {
        self.silent = if commanded { 0 } else { self.silent + 1 };
        let limit = self.parameters.safety.command_time;
        if limit > 0.0 && self.silent as f64 * self.tick_time > limit {
            self.safety.abandoned();
        }
    }

    /// Supervises a tick. If it stops the bench, the brake sets the voltages, or they are 0.
    fn supervise(
        &mut self,
        order: &Order<f64>,
        readings: &Measurement<f64>,
        signals: &mut TickOutput<f64>,
    ) -> SafetyState {
        let tick = &self.parameters.tick;
        let current = |torque: f64, constant: f64| if constant > 0.0 { torque / constant } else { 0.0 };
        let (drive, load) = (self.parameters.drive_torque_constant, tick.current.torque_constant);
        let most = tick.current.current_limit;
        let missed = core::mem::take(&mut self.missed);
        let asked = current(signals.difference_torque, load).clamp(-most, most);
        // A reference that has not acted yet does not count. A missed tick holds it.
        let asked_load_current = self.parameters.load_delay.next(&mut self.asked, asked);
        let acceleration = match &tick.observer {
            MotionObserver::Accelerometer(observer) => {
                Some(readings.accelerometer_voltage / tick.scaling.accelerometer * observer.screw_ratio)
            }
            MotionObserver::Model(_) => None,
        };
        let input = SafetyInput {
            measured_angle: signals.measured_angle,
            index: (signals.index > 0.5).then_some(signals.index_angle),
            measured_velocity: signals.measured_motor_velocity,
            acceleration,
            drive_current: current(signals.commanded_torque, drive),
            load_current: current(signals.measured_load_torque, load),
            asked_load_current,
            // Without control there is nothing to follow.
            reference_position: if order.control > 0.5 { order.reference.position } else { signals.measured_angle },
            broken: self.broken(signals),
            missed,
        };
        let state = self.safety.step(input, (1 + missed) as f64 * self.tick_time);
        if let SafetyState::Stopping(_) | SafetyState::Fault(_) = state {
            self.hold_back(signals, self.safety.braking());
        }
        state
    }

    /// Disconnects the motors from commands, controller and law.
    fn hold_back(&mut self, signals: &mut TickOutput<f64>, braking: Option<Braking>) {
        let Tick { scaling, current, .. } = &self.parameters.tick;
        let Braking { torque, shorted } = braking.unwrap_or(Braking { torque: 0.0, shorted: true });
        signals.servo_voltage = (torque / scaling.torque_per_volt).clamp(-scaling.servo_limit, scaling.servo_limit);
        signals.commanded_torque = signals.servo_voltage * scaling.torque_per_volt;
        // From the next tick on the order requests no current. In this tick the voltage for the law's torque still
        // acts, unless it is cut here.
        if shorted || !signals.amplifier_voltage.is_finite() {
            signals.amplifier_voltage = 0.0;
            self.state.law.torque = 0.0;
        }
        self.state.law.voltage = signals.amplifier_voltage * current.amplifier_gain;
        self.state.law.motor_torque = signals.commanded_torque;
        self.state.commanded_torque = 0.0;
        self.state.computed_torque = 0.0;
    }

    /// The block with a non-finite output, if any: the tick does not pass it to the drive, and supervision stops the
    /// bench.
    fn broken(&self, signals: &TickOutput<f64>) -> Option<&'static str> {
        let torque = self.state.computed_torque + self.state.commanded_torque;
        [
            (signals.estimated_velocity, "velocity observer"),
            (torque, "position controller"),
            (signals.difference_torque, "rendering law"),
            (signals.amplifier_voltage, "current control"),
        ]
        .into_iter()
        .find_map(|(value, block)| (!value.is_finite()).then_some(block))
    }
}
