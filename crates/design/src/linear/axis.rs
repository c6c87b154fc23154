//! The modelled axis of a position controller, with its delays, for small deviations.
//! `crates/stickslip/tests/laboratory/linear` compares it with the virtual bench.

use stickslip_core::block::Block as _;
use stickslip_core::control::{CurrentControl, CurrentControlInput, CurrentControlState, VelocityObserverState};
use stickslip_core::drive::{Arm, Delay, LONGEST_DELAY};
use stickslip_core::estimate::{
    DriveObserver, DriveObserverInput, DriveObserverState, DriveState, MotionEstimate, MotionObserver,
};
use stickslip_core::fields::Fields as _;
use stickslip_core::friction::Model as FrictionModel;
use stickslip_core::render::Law;
use stickslip_core::scalar::{Dual, Scalar};

use super::linearise::{count, keep, slopes};
use super::{Port, StateSpace};
use crate::{load_current_control, modelled_drive, motion_observer};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings, delay};

/// Longest step of the modelled machine [s].
const STEP: f64 = 25e-6;
/// |Ω| has no slope at exactly zero velocity [rad/s].
const CREEP: f64 = 1e-9;
/// Largest number of steps until bristles slide.
const BENDING: usize = 400_000;

/// Operating point of the linearisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operating {
    /// Load sliding at this velocity [rad/s]: its bristles are fully deflected.
    Sliding(f64),
    /// Load at rest on undeflected bristles. The drive motor's own friction is left out: it is small, and a controller
    /// must be stable with a slipping motor as well.
    Stuck,
}

/// Number of the inputs and outputs of an [`axis`].
pub mod port {
    /// Input: torque commanded of the drive motor [N m].
    pub const TORQUE: usize = 0;
    /// Input: torque against positive motion of the load [N m].
    pub const LOAD: usize = 1;
    /// Output: angle of the encoder, as if it had no counts [rad].
    pub const ANGLE: usize = 0;
    /// Output: velocity of the motor by the tacho [rad/s].
    pub const TACHO: usize = 1;
    /// Output: true velocity of the load [rad/s].
    pub const VELOCITY: usize = 2;
}

/// The modelled axis from commanded torque and load torque to encoder angle, tacho and load velocity, sampled with the
/// tick. A command written in one tick acts from the start of the next one: the tick's own delay is included.
///
/// Drive, coupling, friction, lags of servo amplifier and tacho, and the load motor held without current by its control
/// on the velocity observer: the delay of its voltage acts as damping. An elastic arm is included if the controller of
/// `settings` models one. Quantisation and noise have no slope.
///
/// # Errors
/// Errors of the design of observer and current control; a speed at which the bristles do not reach sliding.
pub fn axis(model: &Model<f64>, settings: &Settings<f64>, at: Operating) -> Result<StateSpace, Error> {
    // Only the command is delayed, not the load's torque.
    Ok(acting_at_once(model, settings, at)?.late_input(port::TORQUE)?.trimmed())
}

/// The same at the rate of the position controller: its torque acts one of its samples later and is held over the next.
///
/// # Errors
/// As [`axis`].
pub fn axis_under_control(model: &Model<f64>, settings: &Settings<f64>, at: Operating) -> Result<StateSpace, Error> {
    let slow = acting_at_once(model, settings, at)?.slower(settings.divider() as usize)?;
    Ok(slow.late_input(port::TORQUE)?.trimmed())
}

fn acting_at_once(model: &Model<f64>, settings: &Settings<f64>, at: Operating) -> Result<StateSpace, Error> {
    let axis = Axis::new(model, settings, at)?;
    let state = axis.state(at)?;
    let wide = Axis {
        machine: axis.machine.map(&mut Dual::of),
        steps: axis.steps,
        observer: axis.observer.map(&mut Dual::of),
        current: axis.current.map(&mut Dual::of),
        arm: axis.arm.map(&mut Dual::of),
        delays: axis.delays.map(|delay| delay.map(&mut Dual::of)),
        dt: Dual::of(axis.dt),
    };
    let has_model = !axis.observer.has_accelerometer();
    let followed = if has_model { count(&state.followed) } else { 0 };
    let is_late = axis.delays != [Delay::default(); 2];
    let waiting = if is_late { state.waiting.len() * LONGEST_DELAY } else { 0 };
    let fixed = count(&state.machine) + count(&state.observer) + count(&state.current) + 1 + state.arm.len();
    let states = fixed + followed + waiting;
    let torque = state.machine.drive.motor_torque;
    let system = slopes(states, 2, axis.dt, |mut seed| {
        let mut state = State {
            machine: state.machine.map(&mut seed),
            observer: state.observer.map(&mut seed),
            followed: state.followed.map(&mut |value| if has_model { seed(value) } else { Dual::of(value) }),
            current: state.current.map(&mut seed),
            voltage: seed(state.voltage),
            arm: state.arm.map(&mut seed),
            waiting: state.waiting.map(|past| past.map(|value| if is_late { seed(value) } else { Dual::of(value) })),
        };
        let (torque, load) = (seed(torque), seed(0.0));
        let (angle, velocity) = (state.machine.drive.angle, state.machine.drive.velocity);
        let outputs = [angle, wide.tick(&mut state, torque, load), velocity];
        let mut numbers = Vec::new();
        keep(&state.machine, &mut numbers);
        keep(&state.observer, &mut numbers);
        if has_model {
            keep(&state.followed, &mut numbers);
        }
        keep(&state.current, &mut numbers);
        numbers.push(state.voltage);
        numbers.extend(state.arm);
        if is_late {
            numbers.extend(state.waiting.into_iter().flatten());
        }
        numbers.extend(outputs);
        numbers
    })?;
    let system = if at == Operating::Stuck { anchored(system, &state.machine) } else { system };
    let port = |name: &str, unit: &str| Port::new(name, unit);
    Ok(system.named(
        vec![port("commanded_torque", "N m"), port("load_torque", "N m")],
        vec![port("measured_angle", "rad"), port("measured_motor_velocity", "rad/s"), port("velocity", "rad/s")],
    ))
}

/// Counts the angle of a stuck load from the anchor of its bristles. This point does not move while they stick: as a
/// state it would be uncontrollable and would never decay.
fn anchored(mut system: StateSpace, machine: &DriveObserverState<f64>) -> StateSpace {
    let [mut of_angle, mut of_deflection] = [*machine; 2];
    of_angle.drive.angle = f64::NAN;
    of_deflection.drive.load_memory.deflection = f64::NAN;
    let [angle, deflection] = [of_angle, of_deflection].map(|marked| {
        let (mut index, mut state) = (0, 0);
        marked.map(&mut |value: f64| {
            if value.is_nan() {
                state = index;
            }
            index += 1;
            value
        });
        state
    });
    // φ = z + anchor: the angle moves as the deflection does, and the anchor's own row is left out.
    let follows = system.a.column(angle).into_owned();
    let mut with_deflection = system.a.column_mut(deflection);
    with_deflection += follows;
    let of_angle = system.c.column(angle).into_owned();
    let mut with_deflection = system.c.column_mut(deflection);
    with_deflection += of_angle;
    let others: Vec<usize> = (0..system.order()).filter(|&i| i != angle).collect();
    StateSpace {
        a: system.a.select_rows(&others).select_columns(&others),
        b: system.b.select_rows(&others),
        c: system.c.select_columns(&others),
        ..system
    }
}

/// The modelled machine, and the parts of the software that act without a position controller.
struct Axis<T> {
    /// Drive and pickups, without correction.
    machine: DriveObserver<T>,
    /// Steps of the machine in a tick.
    steps: usize,
    observer: MotionObserver<T>,
    current: CurrentControl<T>,
    arm: Arm<T>,
    /// Delays of the drive motor's torque and of the load motor's voltage.
    delays: [Delay<T>; 2],
    dt: T,
}

/// The whole state.
#[derive(Clone, Copy)]
struct State<T: Scalar> {
    machine: DriveObserverState<T>,
    observer: VelocityObserverState<T>,
    /// Of the observer with a model.
    followed: DriveObserverState<T>,
    current: CurrentControlState<T>,
    /// Voltage of the load motor, computed in the tick before.
    voltage: T,
    /// Twist of an arm and its rate.
    arm: [T; 2],
    /// Torques of the drive motor and voltages of the load motor that have not acted yet.
    waiting: [[T; LONGEST_DELAY]; 2],
}

impl Axis<f64> {
    fn new(model: &Model<f64>, settings: &Settings<f64>, at: Operating) -> Result<Self, Error> {
        let mut model = *model;
        if at == Operating::Stuck {
            model.motor_friction.model = FrictionModel::Nothing;
        }
        let arm = settings.controller.arm();
        model.drive.load_inertia += arm.rigid_inertia();
        let dt = settings.tick_time();
        let steps = (dt / STEP - 1e-9).ceil().max(1.0) as usize;
        let late = [
            ("delay of the servo amplifier in the model", model.servo_delay),
            ("delay of the load amplifier in the model", model.load_amplifier.delay),
        ];
        let [servo, load] = late.map(|(name, time)| delay(name, time, dt));
        Ok(Axis {
            machine: modelled_drive(&settings.model_with_amplifier(&model), dt / steps as f64)?,
            steps,
            observer: motion_observer(&model, settings)?,
            current: load_current_control(&Law::Off, &model, settings)?,
            arm,
            delays: [servo?, load?],
            dt,
        })
    }

    /// The steady state, in which only the angle changes.
    fn state(&self, at: Operating) -> Result<State<f64>, Error> {
        let velocity = match at {
            Operating::Sliding(velocity) => velocity,
            Operating::Stuck => CREEP,
        };
        let mut machine = DriveObserverState { started: 1.0, ..DriveObserverState::default() };
        let drive = &mut machine.drive;
        (drive.velocity, drive.motor_velocity) = (velocity, velocity);
        // At rest the load motor's current is 0, behind either kind of amplifier.
        let voltage = -self.machine.model.winding.torque_constant * velocity;
        if matches!(at, Operating::Sliding(_)) {
            machine = self.bent(machine, voltage)?;
        }
        machine.tacho = velocity;
        let observer = VelocityObserverState { velocity, ..VelocityObserverState::at(0.0) };
        Ok(State {
            machine,
            observer,
            followed: machine,
            current: CurrentControlState::default(),
            voltage,
            arm: [0.0; 2],
            waiting: [[machine.drive.motor_torque; LONGEST_DELAY], [voltage; LONGEST_DELAY]],
        })
    }

    /// The bristles after long sliding, with their torques.
    fn bent(&self, mut machine: DriveObserverState<f64>, voltage: f64) -> Result<DriveObserverState<f64>, Error> {
        let step = self.dt / self.steps as f64;
        let velocity = machine.drive.velocity;
        let input = DriveObserverInput { voltage, ..DriveObserverInput::default() };
        for _ in 0..BENDING {
            let before = machine.drive;
            self.machine.follow(&mut machine, &input, step, |_, _| {});
            let now = machine.drive;
            let torque = now.load_resistance + now.motor_resistance;
            machine.drive = DriveState {
                angle: 0.0,
                velocity,
                motor_velocity: velocity,
                load_current: 0.0,
                twist: now.load_resistance / self.machine.model.drive.coupling_stiffness,
                motor_torque: torque,
                ..now
            };
            let bend = |drive: &DriveState<f64>| [drive.load_memory.deflection, drive.motor_memory.deflection];
            let (bent, earlier) = (bend(&now), bend(&before));
            let changed = (bent[0] - earlier[0]).abs() + (bent[1] - earlier[1]).abs();
            let settled = (now.load_resistance - before.load_resistance).abs() <= 1e-14 * now.load_resistance.abs();
            if settled && changed <= 1e-13 * (bent[0].abs() + bent[1].abs()) {
                machine.acceleration = 0.0;
                machine.acceleration_rate = 0.0;
                return Ok(machine);
            }
        }
        Err(Error::OutOfRange {
            name: "the velocity at which the load slides",
            value: velocity,
            unit: "rad/s",
            minimum: 1e-3,
            maximum: 1e3,
            remedy: "Use a speed at which the load slides instead of creeping.",
        })
    }
}

impl<T: Scalar> Axis<T> {
    /// One tick with the torque command of the servo amplifier [N m] and the torque against the load [N m]. Returns the
    /// velocity of the motor as the position controller reads it [rad/s].
    fn tick(&self, state: &mut State<T>, motor_torque: T, load_torque: T) -> T {
        let machine = &mut state.machine;
        let readings = DriveObserverInput {
            angle: machine.drive.angle,
            motor_velocity: machine.tacho,
            acceleration: machine.acceleration,
            current: machine.drive.load_current,
            motor_torque,
            voltage: state.voltage,
            estimated_velocity: T::of(0.0),
        };
        let states = (&mut state.observer, &mut state.followed);
        let MotionEstimate { screw: estimate, motor_velocity } =
            self.observer.observe(states, false, readings, self.dt);
        let demand = CurrentControlInput {
            reference_current: T::of(0.0),
            measured_current: machine.drive.load_current,
            estimated_velocity: estimate.velocity,
        };
        let voltage = self.current.run(&mut state.current, demand, self.dt).voltage;
        machine.residual = load_torque;
        let [torques, voltages] = &mut state.waiting;
        let input = DriveObserverInput {
            motor_torque: self.delays[0].next(torques, motor_torque),
            voltage: self.delays[1].next(voltages, state.voltage),
            ..DriveObserverInput::default()
        };
        let step = self.dt / T::of(self.steps as f64);
        for _ in 0..self.steps {
            let Arm::Elastic(arm) = &self.arm else {
                self.machine.follow(machine, &input, step, |_, _| {});
                continue;
            };
            // The torque of an arm on the carriage acts at the middle of the step, as in the virtual machine.
            let (half, before) = (T::of(0.5) * step, machine.drive.velocity);
            let [twist, rate] = &mut state.arm;
            *twist += half * *rate;
            let torque = arm.torque(*twist, *rate);
            machine.residual = load_torque - torque;
            self.machine.follow(machine, &input, step, |_, _| {});
            *rate = *rate - torque * step / arm.inertia - (machine.drive.velocity - before);
            *twist += half * *rate;
        }
        state.voltage = voltage;
        motor_velocity
    }
}
