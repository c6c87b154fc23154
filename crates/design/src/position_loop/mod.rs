//! The loop of a position controller over the modelled axis, and its stability margins.
//!
//! It is opened at the torque that the controller commands: L = controller × axis, both with the numbers of the running
//! bench and with the controller's sample of delay. A controller is analysed with a sliding and with a stuck load,
//! where the bristles change the axis: a loop tuned for one alone may hunt in the other.

mod delays;
mod price;
#[cfg(test)]
mod tests;
mod tune;

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix};
use stickslip_core::control::compensation::{Compensation, Hold};
use stickslip_core::control::reference::Setpoint;
use stickslip_core::control::{AxisControl, AxisControlInput, AxisControlState, PositionController};

use super::drive_observer::CONVERTER_NOISE;
pub use delays::check_delays;
pub use tune::{NOISE_LIMIT, Tuned, tune};

use crate::linear::{Margins, Operating, StateSpace, axis_under_control, linearise, port, size};
use stickslip_base::Error;
use stickslip_base::preset::{Model, Settings};

/// Inputs of position control, in the order of [`AxisControlInput`].
const REFERENCE: usize = 0;
const REFERENCE_VELOCITY: usize = 1;
const ANGLE: usize = 3;
const VELOCITY: usize = 4;

/// Robustness limit of the sensitivity peak on the modelled machine.
pub const SENSITIVITY_LIMIT: f64 = 1.8;
/// The same for each machine in the corners of its uncertainty.
pub const CORNER_LIMIT: f64 = 2.5;
/// Factors of load inertia and coupling stiffness at the corners.
pub const CORNERS: [f64; 2] = [0.8, 1.25];

/// A controller on the axis, about an operating point.
#[derive(Clone, Debug)]
pub struct PositionLoop {
    /// From commanded torque and load torque to angle, tacho and velocity.
    axis: StateSpace,
    /// From set-point, its derivatives, angle and tacho to the commanded torque.
    controller: StateSpace,
}

/// Margins and noise of a loop.
#[derive(Clone, Debug)]
pub struct LoopQuality {
    /// Its margins.
    pub margins: Margins,
    /// Whether it is stable.
    pub stable: bool,
    /// Poles of the closed loop, in z.
    pub poles: Vec<Complex<f64>>,
    /// Frequency from which on the load follows the set-point by less than 1/√2 [rad/s]; `None` if it always follows.
    pub bandwidth: Option<f64>,
    /// Noise of the commanded torque by counts and tacho [N m RMS]; infinite for an unstable loop.
    pub noise_torque: f64,
}

/// A machine with scaled inertia and stiffness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Regime of the load.
    pub at: Operating,
    /// Factor of the load inertia.
    pub load_inertia: f64,
    /// Factor of the coupling stiffness.
    pub coupling_stiffness: f64,
    /// Peak of the sensitivity; infinite for an unstable loop.
    pub sensitivity: f64,
}

impl PositionLoop {
    /// The loop of a controller, with its compensation if any, on the modelled axis.
    ///
    /// # Errors
    /// Errors of the axis' linearisation.
    pub fn new(
        control: impl Into<AxisControl<f64>>,
        model: &Model<f64>,
        settings: &Settings<f64>,
        at: Operating,
    ) -> Result<Self, Error> {
        let velocity = if let Operating::Sliding(velocity) = at { velocity } else { 0.0 };
        Self::over(axis_under_control(model, settings, at)?, control, velocity)
    }

    /// The loop over an axis sampled at the controller's rate, sliding at a velocity [rad/s].
    ///
    /// # Errors
    /// Errors of the controller's linearisation.
    pub fn over(axis: StateSpace, control: impl Into<AxisControl<f64>>, velocity: f64) -> Result<Self, Error> {
        let controller = Self::controller(control, axis.dt.unwrap_or_default(), velocity)?;
        Ok(PositionLoop { axis, controller })
    }

    /// From set-point, its derivatives, angle and tacho to the commanded torque, sampled with `dt` [s].
    fn controller(control: impl Into<AxisControl<f64>>, dt: f64, velocity: f64) -> Result<StateSpace, Error> {
        // A dead zone has no effect outside it.
        let mut control = AxisControl { hold: Hold::Nothing, ..control.into() };
        // Without a limit nearby the prediction is that of the controller itself.
        if let PositionController::Predictive(it) = control.controller {
            control.controller = PositionController::Linear(it.linear);
        }
        // Feedforward and slow adaptation are outside the loop; the sign in an observer of friction is within it.
        let slides = matches!(control.compensation, Compensation::FriedlandPark(_));
        let velocity = if slides { velocity } else { 0.0 };
        let reference = Setpoint { velocity, ..Setpoint::default() };
        let input = AxisControlInput { reference, measured_velocity: velocity, ..AxisControlInput::default() };
        // In the middle of its range, after one sample: no limit is near.
        let mut state = control.take_over(0.0, input, &AxisControlState::default(), None);
        (state.controller.pid.started, state.controller.linear.started) = (1.0, 1.0);
        Ok(linearise(&control, &state, &input, dt)?.trimmed())
    }

    /// The axis alone, from commanded torque and load torque.
    pub fn axis(&self) -> &StateSpace {
        &self.axis
    }

    /// The controller from angle and tacho to the commanded torque.
    fn back(&self) -> Result<StateSpace, Error> {
        self.controller.select(&[ANGLE, VELOCITY], &[0])
    }

    /// The loop gain L at the commanded torque: the loop closes with −1.
    ///
    /// # Errors
    /// Systems of inconsistent sizes.
    pub fn gain(&self) -> Result<StateSpace, Error> {
        let mut gain = self.axis.select(&[port::TORQUE], &[port::ANGLE, port::TACHO])?.then(&self.back()?)?;
        gain.c.neg_mut();
        gain.d.neg_mut();
        Ok(gain)
    }

    /// Response from a torque added to the commanded one to the angle, under control, at these frequencies [rad/s]:
    /// G/(1 + L).
    ///
    /// # Errors
    /// As [`gain`](Self::gain).
    pub fn torque_to_angle(&self, frequencies: &[f64]) -> Result<Vec<Complex<f64>>, Error> {
        let axis = self.axis.select(&[port::TORQUE], &[port::ANGLE])?;
        let loop_gain = self.gain()?.response(frequencies);
        let one = Complex::new(1.0, 0.0);
        Ok(axis.response(frequencies).into_iter().zip(loop_gain).map(|(axis, gain)| axis / (one + gain)).collect())
    }

    /// The closed loop: from set-point, its velocity, load torque, and disturbances of angle and tacho, to the angle
    /// and the commanded torque.
    ///
    /// # Errors
    /// As [`gain`](Self::gain).
    pub fn closed(&self) -> Result<StateSpace, Error> {
        // Both as one system: inputs are commanded torque, set-point and disturbances, outputs the controller's torque
        // and the angle; a connection closes the loop.
        let (axis, controller) = (&self.axis, &self.controller);
        let (n, m) = (axis.order(), controller.order());
        let column = |matrix: &DMatrix<f64>, j: usize| matrix.column(j).into_owned();
        let (outputs, direct) = (axis.c.rows(0, 2), axis.d.rows(0, 2));
        let [of_reference, of_velocity, of_angle, of_tacho] =
            [REFERENCE, REFERENCE_VELOCITY, ANGLE, VELOCITY].map(|j| column(&controller.b, j));
        let measured = DMatrix::from_columns(&[of_angle, of_tacho]);
        let weigh = DMatrix::from_columns(&[column(&controller.d, ANGLE), column(&controller.d, VELOCITY)]);
        let mut a = DMatrix::zeros(n + m, n + m);
        let mut b = DMatrix::zeros(n + m, 5);
        let mut torque = DMatrix::zeros(1, n + m);
        let mut torque_direct = DMatrix::zeros(1, 5);
        torque.view_mut((0, 0), (1, n)).copy_from(&(&weigh * outputs));
        torque.view_mut((0, n), (1, m)).copy_from(&controller.c);
        torque_direct[0] = controller.d[REFERENCE];
        torque_direct[1] = controller.d[REFERENCE_VELOCITY];
        torque_direct[2] = (&weigh * direct.column(port::LOAD))[0];
        (torque_direct[3], torque_direct[4]) = (weigh[0], weigh[1]);
        // The axis: its command is delayed by a sample, so that it has no feedthrough.
        let command = column(&axis.b, port::TORQUE);
        a.view_mut((0, 0), (n, n)).copy_from(&axis.a);
        let rows = a.view((0, 0), (n, n + m)) + &command * &torque;
        a.view_mut((0, 0), (n, n + m)).copy_from(&rows);
        b.view_mut((0, 2), (n, 1)).copy_from(&axis.b.column(port::LOAD));
        let rows = b.view((0, 0), (n, 5)) + &command * &torque_direct;
        b.view_mut((0, 0), (n, 5)).copy_from(&rows);
        a.view_mut((n, 0), (m, n)).copy_from(&(&measured * outputs));
        a.view_mut((n, n), (m, m)).copy_from(&controller.a);
        b.view_mut((n, 0), (m, 1)).copy_from(&of_reference);
        b.view_mut((n, 1), (m, 1)).copy_from(&of_velocity);
        b.view_mut((n, 2), (m, 1)).copy_from(&(&measured * direct.column(port::LOAD)));
        b.view_mut((n, 3), (m, 2)).copy_from(&measured);
        let mut c = DMatrix::zeros(2, n + m);
        c.view_mut((0, 0), (1, n)).copy_from(&axis.c.row(port::ANGLE));
        c.view_mut((1, 0), (1, n + m)).copy_from(&torque);
        let mut d = DMatrix::zeros(2, 5);
        d[(0, 2)] = axis.d[(port::ANGLE, port::LOAD)];
        d.view_mut((1, 0), (1, 5)).copy_from(&torque_direct);
        StateSpace::new(a, b, c, d, axis.dt)
    }

    /// Margins and noise of the loop.
    ///
    /// # Errors
    /// As [`StateSpace::poles`].
    pub fn quality(&self, model: &Model<f64>) -> Result<LoopQuality, Error> {
        let (gain, closed) = (self.gain()?, self.closed()?);
        let stable = closed.is_stable()?;
        let noise_torque = if stable { noise_torque(&closed, model)? } else { f64::INFINITY };
        let follows = closed.channel(0, 0)?;
        let frequencies = gain.frequencies()?;
        let response = follows.response(&frequencies);
        let low = |value: &Complex<f64>| size(*value) < std::f64::consts::FRAC_1_SQRT_2;
        let bandwidth = response.iter().position(low).map(|k| frequencies[k]);
        Ok(LoopQuality { margins: gain.margins()?, stable, poles: closed.poles()?, bandwidth, noise_torque })
    }
}

/// Noise of the commanded torque of a stable closed loop by counts and tacho [N m RMS].
fn noise_torque(closed: &StateSpace, model: &Model<f64>) -> Result<f64, Error> {
    // A moving load passes all angles between two counts: 1/12 of a count's square.
    let count = TAU / model.encoder.counts_per_revolution / 12f64.sqrt();
    let tacho = libm::hypot(model.tacho_noise, CONVERTER_NOISE) / model.scaling.tacho;
    let mut noisy = closed.select(&[3, 4], &[1])?;
    for (j, deviation) in [count, tacho].into_iter().enumerate() {
        noisy.b.column_mut(j).scale_mut(deviation);
        noisy.d.column_mut(j).scale_mut(deviation);
    }
    let direct: f64 = noisy.d.iter().map(|value| value * value).sum();
    Ok(libm::sqrt(noisy.noise()?[0] + direct))
}

/// The corners of load inertia and coupling stiffness, with the load sliding and stuck, the worst first.
///
/// # Errors
/// As [`PositionLoop::new`].
pub fn corners(
    control: impl Into<AxisControl<f64>>,
    model: &Model<f64>,
    settings: &Settings<f64>,
    operating: &[Operating],
) -> Result<Vec<Corner>, Error> {
    let control = control.into();
    let mut corners = Vec::new();
    for &at in operating {
        for load_inertia in CORNERS {
            for coupling_stiffness in CORNERS {
                let mut off = *model;
                off.drive.load_inertia *= load_inertia;
                off.drive.coupling_stiffness *= coupling_stiffness;
                let closes = PositionLoop::new(control, &off, settings, at)?;
                let stable = closes.closed()?.is_stable()?;
                let peak = if stable { closes.gain()?.margins()?.sensitivity.value } else { f64::INFINITY };
                corners.push(Corner { at, load_inertia, coupling_stiffness, sensitivity: peak });
            }
        }
    }
    corners.sort_by(|one, other| other.sensitivity.total_cmp(&one.sensitivity));
    Ok(corners)
}
