//! The moving parts, by a well-balanced splitting.
//!
//! All that is linear (masses, coupling, currents, servo lag) flows exactly, with the friction torques of the last
//! step held in it; in the middle of the step the friction is renewed, by a midpoint of the exponential bristle step,
//! and only its *change* kicks the velocities. A load at rest is then a fixed point of the scheme: it does not creep.
//! Second order; the coupling angle is a state and the screw angle an integral apart, so that no rounding of a large
//! angle disturbs the balance.

use super::Plant;
use crate::Fields;
use crate::block::Block;
use crate::drive::flow;
use crate::friction::{Contact, Friction, FrictionInput};
use crate::scalar::Scalar;
use crate::sensor::Pickups;

/// Linear states: twist, motor velocity, velocity, load current, motor torque.
const STATES: usize = 5;
/// Inputs held over a step: torque on the motor, torque on the load, winding voltage, motor torque aimed at.
const INPUTS: usize = 4;

/// The moving parts of the virtual machine, prepared for a step: motor, coupling, load, friction, currents.
///
/// The linear part flows exactly over half a step, friction acts in the middle as a midpoint of exponential bristle
/// steps, and only its change kicks the velocities, so that a load at rest does not creep.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Machine<T> {
    /// What it was prepared from.
    pub plant: Plant<T>,
    /// Tacho and accelerometer, prepared.
    pub pickups: Pickups<T>,
    /// How many steps a tick has.
    #[field(fixed)]
    pub steps: usize,
    /// √(f_tick/2): from a noise density to a standard deviation.
    #[field(unit = "√Hz")]
    pub noise_bandwidth_root: T,
    /// Flow over half a step, column by column: one a state and an input, each with the states and the gain in angle.
    #[field(unit = "1")]
    half_flow: [[T; STATES + 1]; STATES + INPUTS],
}

/// What the moving parts remember.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct MachineState<T> {
    /// Angle of the screw.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Velocity of the screw.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Twist of the coupling, φ_M − φ.
    #[field(symbol = "δ", unit = "rad")]
    pub twist: T,
    /// Velocity of the motor.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
    /// Current of the load motor.
    #[field(symbol = "i_L", unit = "A")]
    pub load_current: T,
    /// Torque of the drive motor.
    #[field(symbol = "M_M", unit = "N m")]
    pub motor_torque: T,
    /// Torque held against the motor: its friction.
    #[field(symbol = "M_R,M", unit = "N m")]
    pub motor_resistance: T,
    /// Torque held against the load: friction, less what acts from outside.
    #[field(symbol = "M_R", unit = "N m")]
    pub load_resistance: T,
    /// Deflection of the motor's bristles.
    #[field(symbol = "z_M", unit = "rad")]
    pub motor_deflection: T,
    /// Deflection of the screw's bristles.
    #[field(symbol = "z", unit = "rad")]
    pub screw_deflection: T,
    /// Deflection of the wheel's bristles.
    #[field(symbol = "z_W", unit = "rad")]
    pub wheel_deflection: T,
    /// Twist of the arm, φ_a − φ.
    #[field(symbol = "δ_a", unit = "rad")]
    pub arm_twist: T,
    /// Velocity of the arm.
    #[field(symbol = "Ω_a", unit = "rad/s")]
    pub arm_velocity: T,
}

/// What acts on the moving parts.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct MachineInput<T> {
    /// Input of the servo amplifier.
    #[field(symbol = "u_servo", unit = "V")]
    pub servo_voltage: T,
    /// Input of the load amplifier.
    #[field(symbol = "u_amp", unit = "V")]
    pub amplifier_voltage: T,
    /// External torque, with positive motion.
    #[field(symbol = "M_ext", unit = "N m")]
    pub external_torque: T,
}

/// True motion at the end of a step, for the instruments.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Motion<T> {
    /// Angle of the screw.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Velocity of the screw.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Mean acceleration of the screw over the step.
    #[field(symbol = "Ω̇", unit = "rad/s^2")]
    pub acceleration: T,
    /// Angle of the motor.
    #[field(symbol = "φ_M", unit = "rad")]
    pub motor_angle: T,
    /// Velocity of the motor.
    #[field(symbol = "Ω_M", unit = "rad/s")]
    pub motor_velocity: T,
    /// Current of the load motor.
    #[field(symbol = "i_L", unit = "A")]
    pub load_current: T,
}

/// Inputs held over a step, in the order of the columns.
#[derive(Clone, Copy)]
struct Held<T> {
    motor_resistance: T,
    load_resistance: T,
    voltage: T,
    torque: T,
}

impl<T: Scalar> Machine<T> {
    /// Prepares the flow over half of `dt` [s].
    pub(super) fn new(plant: &Plant<T>, steps: usize, dt: T, noise_bandwidth_root: T) -> Self {
        const N: usize = STATES + INPUTS + 1;
        const ANGLE: usize = N - 1;
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let drive = &plant.drive;
        let winding = &plant.load_motor.winding;
        let mut a = [[zero; N]; N];
        // δ̇ = Ω_M − Ω
        a[0][1] = one;
        a[0][2] = -one;
        // J_M·Ω̇_M = M_M − c·δ − d·(Ω_M − Ω) − M_R,M
        let per_motor = one / drive.motor_inertia;
        a[1][0] = -drive.coupling_stiffness * per_motor;
        a[1][1] = -drive.coupling_damping * per_motor;
        a[1][2] = drive.coupling_damping * per_motor;
        a[1][4] = per_motor;
        a[1][STATES] = -per_motor;
        // J_L·Ω̇ = c·δ + d·(Ω_M − Ω) − K·i − M_R
        let per_load = one / drive.load_inertia;
        a[2][0] = drive.coupling_stiffness * per_load;
        a[2][1] = drive.coupling_damping * per_load;
        a[2][2] = -drive.coupling_damping * per_load;
        a[2][3] = -winding.torque_constant * per_load;
        a[2][STATES + 1] = -per_load;
        // L·di/dt = u − R·i + K·Ω
        let per_inductance = one / winding.inductance;
        a[3][2] = winding.torque_constant * per_inductance;
        a[3][3] = -winding.resistance * per_inductance;
        a[3][STATES + 2] = per_inductance;
        // τ·Ṁ_M = M_aim − M_M
        let per_lag = one / plant.servo.lag;
        a[4][4] = -per_lag;
        a[4][STATES + 3] = per_lag;
        // φ̇ = Ω
        a[ANGLE][2] = one;
        let phi = flow(&a, T::of(0.5) * dt);
        let mut half_flow = [[zero; STATES + 1]; STATES + INPUTS];
        for (column, out) in half_flow.iter_mut().enumerate() {
            for (row, source) in [0, 1, 2, 3, 4, ANGLE].into_iter().enumerate() {
                out[row] = phi[source][column];
            }
        }
        let pickups = Pickups::new(plant.tacho, plant.accelerometer, dt);
        Machine { plant: *plant, pickups, steps, noise_bandwidth_root, half_flow }
    }

    /// Half a step of all that is linear; `dt` [s] is the whole step.
    #[inline(always)]
    fn flow(&self, state: &mut MachineState<T>, held: Held<T>, dt: T) {
        let x = [
            state.twist,
            state.motor_velocity,
            state.velocity,
            state.load_current,
            state.motor_torque,
            held.motor_resistance,
            held.load_resistance,
            held.voltage,
            held.torque,
        ];
        // Column by column: six independent sums instead of six chains, side by side in memory.
        let mut sum = self.half_flow[0];
        for row in 0..=STATES {
            sum[row] *= x[0];
        }
        for column in 1..STATES + INPUTS {
            for row in 0..=STATES {
                sum[row] += self.half_flow[column][row] * x[column];
            }
        }
        let [twist, motor_velocity, velocity, load_current, motor_torque, way] = sum;
        state.arm_twist += T::of(0.5) * dt * state.arm_velocity - way;
        state.angle += way;
        state.twist = twist;
        state.motor_velocity = motor_velocity;
        state.velocity = velocity;
        state.load_current = load_current;
        state.motor_torque = motor_torque;
    }
}

/// A mass on which friction acts, in the middle of a step.
#[derive(Clone, Copy)]
struct Sliding<T> {
    inertia: T,
    velocity: T,
    angle: T,
    /// Torque that the contacts carry.
    load: T,
    /// Torque against positive motion that was held in the flow.
    held: T,
    /// Torque against positive motion from all that is no friction.
    others: T,
}

/// Predictor of several contacts on one mass: half a step at the velocity of the start. Leaves the deflections of the
/// middle in `contacts`, returns the velocity of the middle [rad/s]. A contact is its friction, a factor of its torque,
/// and its deflection.
#[inline(always)]
fn predict<T: Scalar, const N: usize>(mass: &Sliding<T>, contacts: &mut [(&Friction<T>, T, T); N], dt: T) -> T {
    let start = deflections(contacts);
    let half = T::of(0.5) * dt;
    let (middle, torque) = pass::<T, true, N>(mass, mass.velocity, contacts, start, start, half);
    for i in 0..N {
        contacts[i].2 = middle[i];
    }
    mass.velocity - (torque - mass.held) * half / mass.inertia
}

/// Corrector: the whole step at the velocity of the middle, α linear about the deflections of the middle. Leaves the deflections
/// of the end in `contacts`, returns the new velocity [rad/s] and the new torque to hold [N m].
#[inline(always)]
fn correct<T: Scalar, const N: usize>(
    mass: &Sliding<T>,
    middle: T,
    start: [T; N],
    contacts: &mut [(&Friction<T>, T, T); N],
    dt: T,
) -> (T, T) {
    let probe = deflections(contacts);
    let (ends, torque) = pass::<T, false, N>(mass, middle, contacts, start, probe, dt);
    for i in 0..N {
        contacts[i].2 = ends[i];
    }
    (mass.velocity - (torque - mass.held) * dt / mass.inertia, torque)
}

/// Not `array::map`, which stays a call where a number is wide.
#[inline(always)]
fn deflections<T: Scalar, const N: usize>(contacts: &[(&Friction<T>, T, T); N]) -> [T; N] {
    let mut out = [T::of(0.0); N];
    for i in 0..N {
        out[i] = contacts[i].2;
    }
    out
}

/// One evaluation of all contacts over `dt`: the new deflections and the torque.
#[inline(always)]
fn pass<T: Scalar, const PREDICTS: bool, const N: usize>(
    mass: &Sliding<T>,
    velocity: T,
    contacts: &[(&Friction<T>, T, T); N],
    start: [T; N],
    probe: [T; N],
    dt: T,
) -> ([T; N], T) {
    // Friction that would bring the mass to rest within dt; each contact takes up what it can.
    let mut arrest = mass.held + mass.velocity * mass.inertia / dt - mass.others;
    let mut total = mass.others;
    let mut ends = start;
    for i in 0..N {
        let (friction, factor, _) = contacts[i];
        // A contact without load takes up nothing: its share of the arrest is divided by a factor that is not 0.
        let share = arrest / factor.max(T::of(1e-12));
        let contact = Contact { velocity, angle: mass.angle, load: mass.load, arrest: share };
        let (end, torque) = if PREDICTS {
            friction.predict(start[i], contact, dt)
        } else {
            let end = friction.run(&mut (), FrictionInput { deflection: start[i], probe: probe[i], contact }, dt);
            (end.deflection, end.torque)
        };
        ends[i] = end;
        arrest -= factor * torque;
        total += factor * torque;
    }
    (ends, total)
}

impl<T: Scalar> Block<T> for Machine<T> {
    type State = MachineState<T>;
    type Input = MachineInput<T>;
    type Output = Motion<T>;

    #[inline(always)]
    fn step(&self, state: &mut MachineState<T>, input: MachineInput<T>, dt: T) -> Motion<T> {
        let plant = &self.plant;
        let start = state.velocity;
        let (ripple, induced) = plant.load_motor.ripple.of(&plant.load_motor.winding, state);
        let winding = &plant.load_motor.winding;
        let held = Held {
            motor_resistance: state.motor_resistance,
            load_resistance: state.load_resistance,
            voltage: induced
                + plant.load_motor.amplifier.voltage(input.amplifier_voltage, winding, state.load_current, start),
            torque: plant.servo.torque(input.servo_voltage, &plant.motor, state.motor_velocity),
        };
        self.flow(state, held, dt);

        let coupling = plant.drive.coupling_stiffness * state.twist
            + plant.drive.coupling_damping * (state.motor_velocity - state.velocity);
        let mut brushes = [(&plant.motor_friction, T::of(1.0), state.motor_deflection)];
        let motor = Sliding {
            inertia: plant.drive.motor_inertia,
            velocity: state.motor_velocity,
            angle: state.angle + state.twist,
            load: state.motor_torque,
            held: held.motor_resistance,
            others: T::of(0.0),
        };
        let (arm, arm_velocity) = plant.arm.kick(state.arm_twist, state.arm_velocity, state.velocity, dt);
        let mut contacts = [
            (&plant.screw_friction, T::of(1.0), state.screw_deflection),
            (&plant.wheel.friction, plant.wheel.preload, state.wheel_deflection),
        ];
        let load = Sliding {
            inertia: plant.drive.load_inertia,
            velocity: state.velocity,
            angle: state.angle,
            load: coupling,
            held: held.load_resistance,
            others: ripple - input.external_torque - arm,
        };
        // Both predictors before both correctors: each chain of dependent operations is long, these are independent.
        let (brush_start, contact_start) = (deflections(&brushes), deflections(&contacts));
        let motor_middle = predict(&motor, &mut brushes, dt);
        let load_middle = predict(&load, &mut contacts, dt);
        (state.motor_velocity, state.motor_resistance) = correct(&motor, motor_middle, brush_start, &mut brushes, dt);
        (state.velocity, state.load_resistance) = correct(&load, load_middle, contact_start, &mut contacts, dt);
        [(_, _, state.motor_deflection)] = brushes;
        [(_, _, state.screw_deflection), (_, _, state.wheel_deflection)] = contacts;
        state.arm_velocity = arm_velocity;

        self.flow(state, held, dt);
        Motion {
            angle: state.angle,
            velocity: state.velocity,
            acceleration: (state.velocity - start) / dt,
            motor_angle: state.angle + state.twist,
            motor_velocity: state.motor_velocity,
            load_current: state.load_current,
        }
    }
}
