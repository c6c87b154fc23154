//! The drive as a linear system, valid while nothing changes between stick and slip.
//!
//! At speeds far above the Stribeck velocity friction is a level and a slope; at rest, under torques far below breakaway,
//! it is the spring and damper of its bristles. In both the two-mass drive, its motors and its instruments are linear,
//!
//! ```text
//! δ̇ = Ω_M − Ω                          τ·Ṁ_M = k_u·u_servo − M_M           L·di/dt = u − R·i + K_L·Ω
//! J_M·Ω̇_M = M_M − M_C − M_R,M           J_L·Ω̇ = M_C − K_L·i − M_R           φ̇ = Ω
//! τ_T·ẇ = Ω_M − w                                       ȧ = ω·r,   ṙ = ω·(Ω̇ − a − 2ζ·r)
//! ```
//!
//! with w the velocity in the tacho and a the acceleration in the accelerometer, and flow exactly over a tick in which
//! the commands are held. If the load amplifier takes a torque, τ_L·di/dt = i_ref − i replaces the equation of the
//! current.

use stickslip_core::drive::flow;
use stickslip_core::scalar::Scalar;

use super::parameters::{Amplifiers, Index, PARAMETERS};

/// Twist, velocity of the motor, velocity, current, motor torque, angle, tacho, accelerometer and its rate.
pub(super) const STATES: usize = 9;
/// Index of the load's velocity among them.
pub(super) const LOAD_VELOCITY: usize = 2;
/// Servo voltage, command of the load amplifier, resistance on the motor, on the load.
const INPUTS: usize = 4;
/// Measured channels: angle [rad], tacho [V], accelerometer [V], current [A].
pub(super) const CHANNELS: usize = 4;

/// State of the contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Regime {
    /// All slide fast: the motor's own friction has this level [N m] and slope [N m s/rad].
    Sliding {
        /// Level, of the motion's sign.
        level: f64,
        /// Slope over the speed.
        slope: f64,
    },
    /// All stick.
    Stuck,
}

/// The linear system of a parameter set, prepared for a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response<T> {
    columns: [[T; STATES]; STATES + INPUTS],
}

/// Inputs over a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Acting<T> {
    /// At the servo amplifier [V].
    pub(super) servo_voltage: T,
    /// At the load motor's winding [V], or the reference of its current [A].
    pub(super) load_command: T,
    /// Friction of the motor that does not depend on speed [N m].
    pub(super) motor_resistance: T,
    /// The same of the load [N m].
    pub(super) load_resistance: T,
}

impl<T: Scalar> Response<T> {
    /// For these parameters over a tick of `dt` [s].
    pub(super) fn new(p: &[T; PARAMETERS], regime: Regime, amplifiers: Amplifiers, dt: f64) -> Self {
        const N: usize = STATES + INPUTS;
        let get = |index: Index| p[index as usize];
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let (c, d) = (get(Index::CouplingStiffness), get(Index::CouplingDamping));
        // Stiffness and damping of each mass against the frame.
        let [motor, load] = match regime {
            Regime::Sliding { slope, .. } => [[zero, T::of(slope)], [zero, get(Index::SlidingSlope)]],
            Regime::Stuck => [
                [get(Index::BrushStiffness), get(Index::BrushDamping)],
                [get(Index::BristleStiffness), get(Index::BristleDamping)],
            ],
        };
        let mut a = [[zero; N]; N];
        (a[0][1], a[0][2]) = (one, -one);
        let per = one / get(Index::MotorInertia);
        a[1] = [zero; N];
        (a[1][0], a[1][1], a[1][2]) = (-(c + motor[0]) * per, -(d + motor[1]) * per, d * per);
        (a[1][4], a[1][5], a[1][STATES + 2]) = (per, -motor[0] * per, -per);
        let per = one / get(Index::LoadInertia);
        let constant = get(Index::TorqueConstant);
        (a[2][0], a[2][1], a[2][2]) = (c * per, d * per, -(d + load[1]) * per);
        (a[2][3], a[2][5], a[2][STATES + 3]) = (-constant * per, -load[0] * per, -per);
        if amplifiers.take_torque {
            let per = one / get(Index::LoadLag);
            (a[3][3], a[3][STATES + 1]) = (-per, per);
        } else {
            let per = one / get(Index::Inductance);
            (a[3][2], a[3][3], a[3][STATES + 1]) = (constant * per, -get(Index::Resistance) * per, per);
        }
        let per = one / get(Index::ServoLag);
        (a[4][4], a[4][STATES]) = (-per, get(Index::TorquePerVolt) * per);
        a[5][2] = one;
        let per = one / get(Index::TachoLag);
        (a[6][1], a[6][6]) = (per, -per);
        let omega = get(Index::AccelerometerFrequency);
        a[7][8] = omega;
        for column in 0..N {
            a[8][column] = omega * a[2][column];
        }
        a[8][7] = -omega;
        a[8][8] = -T::of(2.0) * get(Index::AccelerometerDamping) * omega;
        let phi = flow(&a, T::of(dt));
        let mut columns = [[zero; STATES]; N];
        for (column, out) in columns.iter_mut().enumerate() {
            for (row, value) in out.iter_mut().enumerate() {
                *value = phi[row][column];
            }
        }
        Response { columns }
    }

    /// One tick.
    #[inline(always)]
    pub(super) fn step(&self, state: &mut [T; STATES], acting: Acting<T>) {
        let Acting { servo_voltage, load_command, motor_resistance, load_resistance } = acting;
        let inputs = [servo_voltage, load_command, motor_resistance, load_resistance];
        let mut sum = [T::of(0.0); STATES];
        for (column, value) in self.columns.iter().zip(state.iter().chain(&inputs)) {
            for row in 0..STATES {
                sum[row] += column[row] * *value;
            }
        }
        *state = sum;
    }
}
