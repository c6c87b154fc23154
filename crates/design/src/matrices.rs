//! A controller from its matrices.

use nalgebra::DMatrix;
use stickslip_core::control::{INPUTS, LinearController, STATES};

use stickslip_base::preset::ControllerMatrices;

/// Share of the largest singular value below which others are 0: an integrator among the states.
const SINGULAR: f64 = 1e-13;

/// The controller of these matrices.
///
/// When it is activated, its states have their steady values for the present motion:
///
///   (I − A)·S = B·V,   V: inputs per deviation, per velocity, per torque, per added torque
///
/// An integrator among the states has no steady value; it starts with the smallest solution, and the controller's own
/// integral has the rest of the torque.
pub fn linear_controller(matrices: &ControllerMatrices<f64>) -> LinearController<f64> {
    let ControllerMatrices { system, input, output, direct, integral_gain, sampling_time, torque_limit } = *matrices;
    let still = DMatrix::from_fn(STATES, STATES, |i, j| f64::from(u8::from(i == j)) - system[i][j]);
    let moved = DMatrix::from_fn(STATES, INPUTS, |i, j| input[i][j]);
    let mut motions = DMatrix::zeros(INPUTS, 4);
    motions[(0, 0)] = 1.0;
    (motions[(1, 1)], motions[(2, 1)], motions[(3, 1)]) = (1.0, sampling_time, 1.0);
    motions[(5, 2)] = 1.0;
    (motions[(6, 3)], motions[(7, 3)]) = (1.0, 1.0);
    let moved = moved * motions;
    let factors = still.clone().svd(true, true);
    let least = SINGULAR * factors.singular_values.max();
    // Elimination is more exact for very different units, and has no solution for an integrator.
    let solved =
        if factors.rank(least) == STATES { still.lu().solve(&moved) } else { factors.solve(&moved, least).ok() };
    let settled = solved.unwrap_or_else(|| DMatrix::zeros(STATES, 4));
    LinearController {
        system: std::array::from_fn(|j| std::array::from_fn(|i| system[i][j])),
        input: std::array::from_fn(|j| std::array::from_fn(|i| input[i][j])),
        output,
        direct,
        settled: std::array::from_fn(|j| std::array::from_fn(|i| settled[(i, j)])),
        integral_gain,
        sampling_time,
        torque_limit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_core::block::Block as _;
    use stickslip_core::control::{ControllerInput, Pid};

    /// A PID controller whose integral is a state.
    fn of_pid(pid: &Pid<f64>, dt: f64) -> LinearController<f64> {
        let mut matrices =
            ControllerMatrices { sampling_time: dt, torque_limit: pid.torque_limit, ..ControllerMatrices::default() };
        (matrices.system[0][0], matrices.input[0][0]) = (1.0, -pid.integral_gain * dt);
        matrices.output[0] = 1.0;
        matrices.direct[..4].copy_from_slice(&[-pid.proportional_gain, -pid.derivative_gain, 0.0, pid.derivative_gain]);
        linear_controller(&matrices)
    }

    #[test]
    fn a_pid_controller_by_its_matrices_has_the_torque_of_the_block_after_its_activation() {
        let (pid, dt) = (Pid::<f64> { torque_limit: 1e3, ..Pid::default() }, 1e-3);
        let stated = of_pid(&pid, dt);
        let input = |k: u32| ControllerInput {
            reference_position: 0.01 * libm::sin(0.1 * f64::from(k)),
            reference_velocity: libm::cos(0.1 * f64::from(k)),
            measured_angle: 0.01 * libm::sin(0.1 * f64::from(k) - 0.3),
            measured_velocity: libm::cos(0.13 * f64::from(k)),
            ..ControllerInput::default()
        };
        let (mut one, mut other) = (pid.take_over(0.3, input(0)), stated.take_over(0.3, input(0)));
        for k in 0..2000 {
            let expected = pid.step(&mut one, input(k), dt).torque;
            let torque = stated.step(&mut other, input(k), dt).torque;
            assert!(k > 0 || (torque - 0.3).abs() < 1e-12, "{torque}");
            assert!((torque - expected).abs() < 1e-9, "{k}: {torque} {expected}");
        }
    }
}
