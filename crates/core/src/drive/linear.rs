//! The linear part of the drive: masses, coupling, current of the load motor, lag of the servo.
//!
//! Its flow over half a step of the well-balanced splitting is exact, with friction and voltages held. The virtual
//! machine and the model of the observer use the same flow.

use super::{TwoMass, Winding, flow};
use crate::scalar::Scalar;

/// Linear states: twist, motor velocity, velocity, load current, motor torque.
pub(crate) const STATES: usize = 5;
/// Inputs held over a step: torque on the motor, torque on the load, winding voltage, reference of the motor torque.
pub(crate) const INPUTS: usize = 4;

/// Flow over half a step: one column for each state and each input, with the new states and the change of angle.
pub(crate) type HalfFlow<T> = [[T; STATES + 1]; STATES + INPUTS];

/// The flow over half of `dt` [s] of a drive, its load motor and a servo amplifier of this lag [s].
pub(crate) fn half_flow<T: Scalar>(drive: &TwoMass<T>, winding: &Winding<T>, lag: T, dt: T) -> HalfFlow<T> {
    const N: usize = STATES + INPUTS + 1;
    const ANGLE: usize = N - 1;
    let (zero, one) = (T::of(0.0), T::of(1.0));
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
    let per_lag = one / lag;
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
    half_flow
}

/// New states and change of angle [rad] after half a step; `x` has states and inputs in the order of the columns.
#[inline(always)]
pub(crate) fn advance<T: Scalar>(half_flow: &HalfFlow<T>, x: [T; STATES + INPUTS]) -> [T; STATES + 1] {
    // Column by column: six independent sums, adjacent in memory, instead of six dependent chains. No iterators: in
    // builds with checks their steps are not inlined and take a third of the time of a simulation.
    let mut sum = half_flow[0];
    let mut row = 0;
    while row <= STATES {
        sum[row] *= x[0];
        row += 1;
    }
    let mut column = 1;
    while column < STATES + INPUTS {
        row = 0;
        while row <= STATES {
            sum[row] += half_flow[column][row] * x[column];
            row += 1;
        }
        column += 1;
    }
    sum
}
