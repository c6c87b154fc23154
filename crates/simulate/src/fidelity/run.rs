//! One machine in one scenario: the tick in lockstep, without homing and supervision.

use stickslip_core::control::reference::Generator;
use stickslip_core::drive::Arm;
use stickslip_core::plant::Plant;
use stickslip_core::render::{Law, RenderedArm};
use stickslip_core::tick::{BenchState, Order, Tick};

use super::machine::machine;
use super::scenario::{Course, Drive};
use super::{Cell, Role, Scenario};
use crate::fast_bench::{FastBench, LaneNumber};
use stickslip_base::preset::{Model, Settings};
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

/// A machine of a cell in a scenario, with a seed of noise.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    pub(super) cell: &'a Cell,
    pub(super) role: Role,
    pub(super) scenario: &'a Scenario,
    pub(super) seed: u64,
}

/// A run at its start.
pub(super) struct Run {
    role: Role,
    plant: Plant<f64>,
    settings: Settings<f64>,
    /// Whether the load's velocity is that of the law's observer.
    observes: bool,
    course: Course,
}

/// Machine and software at the start of a run; `None` where the supervision ends the measurement before its
/// correction.
///
/// # Errors
/// Errors of the software's design and of the integrator.
pub(super) fn start(job: &Job<'_>) -> Result<Option<(FastBench, Run)>, Error> {
    let Job { cell, role, scenario, seed } = *job;
    let plant = machine(cell, role);
    let settings = &cell.preset.bench;
    let course = scenario.course(&cell.preset)?;
    let control_divider = if course.every_tick { 1 } else { settings.divider() };
    let mut tick = software(cell, role, &course, control_divider)?;
    if let (Role::Rendered, true, Some(correct)) = (role, scenario.is_corrected(), cell.correct) {
        match correct(cell, &plant, settings, seed)? {
            Some(correction) => tick.correction = correction,
            None => return Ok(None),
        }
    }
    let observes = matches!(tick.law, Law::Bristle(_) | Law::Admittance(_));
    let bench = FastBench::new(&plant, tick, settings, control_divider, seed)?;
    Ok(Some((bench, Run { role, plant, settings: *settings, observes, course })))
}

/// Follows runs that started beside each other, each to its end, with the same numbers as alone.
pub(super) fn follow<T: LaneNumber>(mut bench: FastBench<T>, runs: &[&Run]) -> Vec<Trace> {
    let mut lanes: Vec<Lane<'_>> = runs.iter().enumerate().map(|(lane, run)| Lane::new(lane, run)).collect();
    let mut orders = Order { render: T::of(1.0), ..Order::default() };
    for cycle in 0..lanes.iter().map(|lane| lane.cycles).max().unwrap_or(0) {
        let mut any = false;
        for lane in lanes.iter_mut().filter(|lane| cycle < lane.cycles) {
            any = true;
            lane.before(cycle, bench.true_state(), &mut orders);
        }
        if !any {
            break;
        }
        let output = bench.tick(orders);
        for lane in lanes.iter_mut().filter(|lane| cycle < lane.cycles) {
            lane.after(cycle, bench.true_state(), output.estimated_velocity);
        }
    }
    lanes.into_iter().map(Lane::trace).collect()
}

/// A run in its lane.
struct Lane<'a> {
    lane: usize,
    run: &'a Run,
    setpoints: Option<Generator<'a>>,
    dt: f64,
    divider: u64,
    rest: u64,
    /// Ticks in all; at its end, those until then.
    cycles: u64,
    order: Order<f64>,
    /// Twist of the arm before the tick [rad].
    carried: f64,
    /// Sum of squared errors of the law's velocity.
    off: f64,
    trace: Trace,
}

impl<'a> Lane<'a> {
    fn new(lane: usize, run: &'a Run) -> Self {
        let Run { settings, course, .. } = run;
        let (dt, divider) = (settings.tick_time(), settings.divider());
        let rest = (course.rest * settings.tick_rate) as u64;
        let cycles = rest + (course.duration * settings.tick_rate) as u64;
        Lane {
            lane,
            run,
            setpoints: course.drive.setpoints(settings.tick_rate),
            dt,
            divider,
            rest,
            cycles,
            order: Order::default(),
            carried: 0.0,
            off: 0.0,
            trace: Trace::with_room(dt * divider as f64, (cycles / divider) as usize),
        }
    }

    /// Its order for a tick.
    fn before<T: LaneNumber>(&mut self, cycle: u64, truth: &BenchState<T>, orders: &mut Order<T>) {
        let time = cycle.checked_sub(self.rest).map(|cycle| cycle as f64 * self.dt);
        self.order = order(&self.run.course.drive, &mut self.setpoints, time);
        let put = |all: &mut T, value| *all = all.with_lane(self.lane, value);
        put(&mut orders.control, self.order.control);
        put(&mut orders.added_torque, self.order.added_torque);
        put(&mut orders.reference.position, self.order.reference.position);
        put(&mut orders.reference.velocity, self.order.reference.velocity);
        put(&mut orders.reference.acceleration, self.order.reference.acceleration);
        // After a tick the software has the arm's twist at its start; without an arm the twist is zero.
        let has_arm = self.run.plant.arm != Arm::Nothing;
        self.carried = if has_arm { truth.plant.machine.arm_twist.lane(self.lane) } else { 0.0 };
    }

    /// Adds the state after a tick to the trace; ends on a fault or where the scenario is over.
    fn after<T: LaneNumber>(&mut self, cycle: u64, truth: &BenchState<T>, estimated_velocity: T) {
        if !(cycle + 1).is_multiple_of(self.divider) {
            return;
        }
        let Run { role, plant, settings, observes, course } = self.run;
        let of = |value: T| value.lane(self.lane);
        let (parts, law) = (&truth.plant.machine, &truth.tick.law.observer.drive);
        let (angle, velocity) = (of(parts.angle), of(parts.velocity));
        let expected = of(if *observes { law.velocity } else { estimated_velocity });
        self.off += (expected - velocity).powi(2);
        let Trace { felt_torque, resisting_torque, load_torque, arm_twist, .. } = &mut self.trace;
        felt_torque.push(of(parts.motor_torque) - of(parts.motor_resistance) - of(parts.lost_torque));
        let load = of(parts.load_current) * plant.load_motor.winding.torque_constant;
        resisting_torque.push(of(parts.load_resistance) - of(parts.lost_torque) + load);
        load_torque.push(load);
        arm_twist.push(if *role == Role::Rendered { of(truth.tick.arm.twist) } else { self.carried });
        self.trace.angle.push(angle);
        let Order { reference, control, .. } = self.order;
        self.trace.reference.push(reference.position);
        // A fault of the supervision of a bench; written so that NaN is a fault.
        let following = control < 0.5 || (reference.position - angle).abs() <= settings.safety.following_error;
        self.trace.stable = following && velocity.abs() <= settings.safety.speed;
        if !self.trace.stable || course.drive.is_over(angle) {
            self.cycles = cycle;
        }
    }

    fn trace(mut self) -> Trace {
        self.trace.velocity_error = libm::sqrt(self.off / (self.trace.angle.len() as f64).max(1.0));
        self.trace
    }
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
    if role != Role::Rendered {
        tick.observer = design::motion_observer(&unrendered(cell, role), settings)?;
    }
    Ok(tick)
}

/// The model of A or A0 for the observer: A has the desired friction, and the load motor of neither has a torque.
fn unrendered(cell: &Cell, role: Role) -> Model<f64> {
    let Preset { mut model, bench: settings, .. } = cell.preset;
    if role == Role::Desired {
        (model.own, model.own_bristles) = (settings.desired, settings.desired_bristles);
    }
    model.load_motor.torque_constant = 0.0;
    model
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

    /// Chatter of the load motor: root mean square of its torque's change from sample to sample [N m].
    pub fn chatter(&self) -> f64 {
        let changes = self.load_torque.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        libm::sqrt(changes.sum::<f64>() / (self.load_torque.len() as f64 - 1.0).max(1.0))
    }
}
