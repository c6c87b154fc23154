//! Predictive control from a state feedback: its predicted course and the distance from its limits.

use nalgebra::{DMatrix, DVector};
use stickslip_core::control::{
    CAUSES, HORIZON, INPUTS, LimitStep, LimitSteps, LinearController, Predictive, SPEEDS, STATES, STRIDE,
};

use super::state_feedback;
use super::state_feedback::{ANGLE, TACHO, VELOCITY};
use stickslip_base::Error;
use stickslip_base::preset::{Model, PredictiveFeedback};

/// Weight of the distance from the limits against that from the course without limits, and scale of the velocities.
/// They determine the speed of the iteration, not its result; found by trial on `prototype`.
const PENALTY: f64 = 8.0;
const VELOCITIES: f64 = 5.0;

/// The configured predictive controller, sampled with `dt` [s].
///
/// # Errors
/// As [`state_feedback`].
pub fn predictive(choice: &PredictiveFeedback<f64>, model: &Model<f64>, dt: f64) -> Result<Predictive<f64>, Error> {
    let linear = state_feedback(&choice.feedback, model, dt)?;
    let course = Course { linear: &linear };
    let mut free_torque = [[0.0; HORIZON]; CAUSES];
    let mut free_velocity = [[0.0; SPEEDS]; CAUSES];
    for cause in 0..CAUSES {
        let (torque, velocity) = course.free(cause);
        free_torque[cause] = torque;
        free_velocity[cause] = std::array::from_fn(|k| velocity[(k + 1) * STRIDE - 1]);
    }
    // Response of the closed loop to an added torque: effect of this sample's torque on the later ones.
    let later = free_torque[STATES + 1];
    let answers = DMatrix::from_fn(HORIZON, HORIZON, |i, j| if i < j { 0.0 } else { later[i - j] });
    let singular = || Error::NotSolvable {
        what: "the course of a predictive controller",
        remedy: "Its state feedback has hardly any effect: increase the weight of deviations (bench.controller.feedback).",
    };
    let back = answers.try_inverse().ok_or_else(singular)?;
    let unscaled = course.answer();
    let speeds = |answer: &[f64; HORIZON]| {
        DMatrix::from_fn(
            SPEEDS,
            HORIZON,
            |j, k| if k < (j + 1) * STRIDE { answer[(j + 1) * STRIDE - 1 - k] } else { 0.0 },
        )
    };
    let size = speeds(&unscaled).singular_values().max();
    let velocity_weight = if size > 0.0 { VELOCITIES / size } else { 0.0 };
    let answer = unscaled.map(|value| velocity_weight * value);
    let change = DMatrix::from_fn(HORIZON, HORIZON, |i, j| match i.checked_sub(j) {
        Some(0) => 1.0,
        Some(1) => -1.0,
        _ => 0.0,
    });
    let speeds = speeds(&answer);
    let identity = DMatrix::<f64>::identity(HORIZON, HORIZON);
    let whole =
        back.transpose() * back / PENALTY + identity + change.transpose() * change + speeds.transpose() * speeds;
    let resolvent = whole.try_inverse().ok_or_else(singular)?;
    Ok(Predictive {
        linear,
        free_torque,
        free_velocity,
        steps: LimitSteps {
            step: LimitStep { resolvent: std::array::from_fn(|j| std::array::from_fn(|i| resolvent[(i, j)])), answer },
        },
        velocity_weight,
        torque_rate_limit: choice.torque_rate_limit,
        speed_limit: choice.speed_limit,
    })
}

/// The modelled drive under its controller, without disturbances.
struct Course<'a> {
    linear: &'a LinearController<f64>,
}

impl Course<'_> {
    /// Torques of this sample and the next ones, and velocities after each, from one cause.
    fn free(&self, cause: usize) -> ([f64; HORIZON], [f64; HORIZON]) {
        let linear = self.linear;
        let dt = linear.sampling_time;
        let unit = |index: usize| f64::from(u8::from(cause == index));
        let mut states = DVector::from_fn(STATES, |k, _| unit(k));
        let mut integral = unit(STATES);
        let mut torque = unit(STATES + 1);
        let (mut velocity, acceleration, added) = (unit(STATES + 2), unit(STATES + 3), unit(STATES + 4));
        let (mut torques, mut velocities) = ([0.0; HORIZON], [0.0; HORIZON]);
        for k in 0..HORIZON {
            torques[k] = torque;
            // Predicted encoder and tacho, and the way of the set-point until then.
            let way = dt * (velocity + 0.5 * dt * acceleration);
            velocity += dt * acceleration;
            let deviation = states[ANGLE] - way;
            let measured =
                DVector::from_row_slice(&[deviation, states[TACHO], way, velocity, acceleration, torque, added, added]);
            let demand = self.output().dot(&states) + self.direct().dot(&measured) + integral;
            integral -= linear.integral_gain * deviation * dt;
            states = self.system() * &states + self.input() * &measured;
            torque = demand;
            velocities[k] = states[VELOCITY];
        }
        (torques, velocities)
    }

    /// Velocity of the load k + 1 samples after a torque [rad/s per N m], without control.
    fn answer(&self) -> [f64; HORIZON] {
        // Measured values equal the predicted ones: the observer is the drive.
        let mut phi = self.system();
        let input = self.input();
        for (column, state) in [(0, ANGLE), (1, TACHO)] {
            let mut row = phi.column_mut(state);
            row += input.column(column);
        }
        let mut states = input.column(5).into_owned();
        std::array::from_fn(|_| {
            let velocity = states[VELOCITY];
            states = &phi * &states;
            velocity
        })
    }

    fn system(&self) -> DMatrix<f64> {
        DMatrix::from_fn(STATES, STATES, |i, j| self.linear.system[j][i])
    }

    fn input(&self) -> DMatrix<f64> {
        DMatrix::from_fn(STATES, INPUTS, |i, j| self.linear.input[j][i])
    }

    fn output(&self) -> DVector<f64> {
        DVector::from_row_slice(&self.linear.output)
    }

    fn direct(&self) -> DVector<f64> {
        DVector::from_row_slice(&self.linear.direct)
    }
}

#[cfg(test)]
mod tests;
