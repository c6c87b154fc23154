//! One machine in one scenario: the tick in lockstep, without homing and supervision.

use stickslip_core::control::reference::Generator;
use stickslip_core::drive::Arm;
use stickslip_core::plant::MachineState;
use stickslip_core::render::{Law, RenderedArm};
use stickslip_core::tick::{Order, Tick};

use super::machine::machine;
use super::scenario::{Course, Drive};
use super::{Cell, Role, Scenario};
use crate::fast_bench::FastBench;
use stickslip_base::{Error, Preset};
use stickslip_design as design;

/// True course of a run, one value for each sample of the position controller.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Time between samples [s].
    pub period: f64,
    /// True angle of the screw [rad].
    pub angle: Vec<f64>,
    /// Set-point [rad]; 0 without position control.
    pub reference: Vec<f64>,
    /// Torque of the drive on the load [N m]: the true torque of its motor minus the motor's own friction.
    pub felt_torque: Vec<f64>,
    /// Resistance of the load [N m]: its true friction plus the true torque of the load motor.
    pub resisting_torque: Vec<f64>,
    /// True torque of the load motor, against positive motion [N m].
    pub load_torque: Vec<f64>,
    /// Twist of the arm, true or rendered [rad].
    pub arm_twist: Vec<f64>,
    /// Error of the law's velocity of the load when its torque starts to act, RMS [rad/s].
    pub velocity_error: f64,
    /// Whether it was completed: no fault of the supervision, all numbers finite.
    pub stable: bool,
}

/// Runs a machine of the cell in a scenario.
///
/// # Errors
/// Errors of the software's design and of the integrator.
pub(super) fn run(cell: &Cell, role: Role, scenario: &Scenario, seed: u64) -> Result<Trace, Error> {
    let plant = machine(cell, role);
    let settings = &cell.preset.bench;
    let course = scenario.course(&cell.preset)?;
    let (dt, divider) = (settings.tick_time(), settings.divider());
    let period = dt * divider as f64;
    let control_divider = if course.every_tick { 1 } else { divider };
    let mut tick = software(cell, role, &course, control_divider)?;
    if let (Role::Rendered, true, Some(correct)) = (role, scenario.is_corrected(), cell.correct) {
        match correct(cell, &plant, settings, seed)? {
            Some(correction) => tick.correction = correction,
            None => return Ok(Trace { period, ..Trace::default() }),
        }
    }
    let mut bench = FastBench::new(&plant, tick, settings, control_divider, seed)?;
    let mut setpoints = course.drive.setpoints(settings.tick_rate);
    let rest = (course.rest * settings.tick_rate) as u64;
    let cycles = rest + (course.duration * settings.tick_rate) as u64;
    let mut trace = Trace::with_room(period, (cycles / divider) as usize);
    let mut off = 0.0;
    for cycle in 0..cycles {
        let order = order(&course.drive, &mut setpoints, cycle.checked_sub(rest).map(|cycle| cycle as f64 * dt));
        // The software's state of an arm after a tick is that at its start; without an arm there is no twist.
        let carried = if plant.arm == Arm::Nothing { 0.0 } else { bench.true_state().plant.machine.arm_twist };
        let output = bench.tick(order);
        if (cycle + 1) % divider != 0 {
            continue;
        }
        let truth = bench.true_state();
        let parts = &truth.plant.machine;
        let expected = match tick.law {
            Law::Bristle(_) | Law::Admittance(_) => truth.tick.law.observer.drive.velocity,
            _ => output.estimated_velocity,
        };
        off += (expected - parts.velocity).powi(2);
        trace.push(parts, plant.load_motor.winding.torque_constant);
        trace.reference.push(order.reference.position);
        trace.arm_twist.push(if role == Role::Rendered { truth.tick.arm.twist } else { carried });
        // A fault of the supervision of a bench; written so that NaN is a fault.
        let following =
            order.control < 0.5 || (order.reference.position - parts.angle).abs() <= settings.safety.following_error;
        if !(following && parts.velocity.abs() <= settings.safety.speed) {
            trace.stable = false;
            break;
        }
        if course.drive.is_over(parts.angle) {
            break;
        }
    }
    trace.velocity_error = libm::sqrt(off / (trace.angle.len() as f64).max(1.0));
    Ok(trace)
}

/// The software of a machine in its role, the controller of the scenario due every `control_divider` ticks.
fn software(cell: &Cell, role: Role, course: &Course, control_divider: u64) -> Result<Tick<f64>, Error> {
    let Preset { model, bench: settings, .. } = &cell.preset;
    let mut tick = design::software(model, settings)?;
    tick.control = course.controller;
    tick.control_period = settings.tick_time() * control_divider as f64;
    tick.law = if role == Role::Rendered { cell.law } else { Law::Off };
    if role != Role::Rendered {
        tick.arm = RenderedArm::Nothing;
    }
    tick.current = design::load_current_control(&tick.law, model, settings)?;
    Ok(tick)
}

/// Order of a tick; no time [s] while the machine rests before the scenario.
fn order(drive: &Drive, setpoints: &mut Option<Generator<'_>>, time: Option<f64>) -> Order<f64> {
    let mut order = Order { render: 1.0, ..Order::default() };
    order.control = f64::from(u8::from(drive.controls()));
    if let Some(time) = time {
        order.added_torque = drive.torque(time);
        match (drive, setpoints) {
            (Drive::Staircase(staircase), _) => order.reference = staircase.at(time),
            (_, Some(generator)) => order.reference = generator.next(),
            _ => {}
        }
    }
    order
}

impl Trace {
    /// An empty trace with capacity for a number of samples.
    fn with_room(period: f64, samples: usize) -> Self {
        let column = || Vec::with_capacity(samples);
        Trace {
            period,
            angle: column(),
            reference: column(),
            felt_torque: column(),
            resisting_torque: column(),
            load_torque: column(),
            arm_twist: column(),
            velocity_error: 0.0,
            stable: true,
        }
    }

    /// Adds angle and torques of the machine, whose load motor has this torque constant [N m/A].
    fn push(&mut self, parts: &MachineState<f64>, torque_constant: f64) {
        self.angle.push(parts.angle);
        self.felt_torque.push(parts.motor_torque - parts.motor_resistance - parts.lost_torque);
        let load_torque = parts.load_current * torque_constant;
        self.resisting_torque.push(parts.load_resistance - parts.lost_torque + load_torque);
        self.load_torque.push(load_torque);
    }

    /// Chatter of the load motor: root mean square of its torque's change from sample to sample [N m].
    pub fn chatter(&self) -> f64 {
        let changes = self.load_torque.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        libm::sqrt(changes.sum::<f64>() / (self.load_torque.len() as f64 - 1.0).max(1.0))
    }
}
