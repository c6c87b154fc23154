//! Any linear controller of the position: state feedback with an observer, or other matrices.

use super::position::{limit_and_integrate, within_limit};
use super::{ControllerInput, ControllerOutput, finite_or};
use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// States of a [`LinearController`]; those that a design does not need have rows and columns of 0.
pub const STATES: usize = 9;
/// Inputs of the states, see [`LinearController`].
pub const INPUTS: usize = 8;

/// A linear controller that uses the active torque:
///
///   x⁺ = A·x + B·v,   M = cᵀ·x + dᵀ·v + I,   İ = K_i·(r − φ),   v = (φ − r, ω, Δr, ṙ, r̈, M₋, M_c₋, M_c)
///
/// Δr is the change of the set-point since the sample before, M₋ the controller's own torque, limited, that is active
/// until the next sample: an observer among the states uses the torque that the drive gets, so it does not wind up.
/// M_c₋ is the compensation of friction added to it, M_c that added to the computed torque: without it an observer
/// would treat the compensation as a load. No absolute angle is an input, so that the control is the same far from the
/// origin, also in single precision. The torque is limited; at the limit the integral moves only back. A non-finite
/// input gives no torque and leaves the states unchanged.
///
/// The matrices are designed for one sampling time, from the parameters of the controller. They are in the units of the
/// states, and stored column by column: the effects of one state or input on all states are adjacent.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LinearController<T> {
    /// From each state to all states.
    #[field(symbol = "A", unit = "1", range = -1e15..=1e15)]
    pub system: [[T; STATES]; STATES],
    /// From each input to all states.
    #[field(symbol = "B", unit = "1", range = -1e15..=1e15)]
    pub input: [[T; STATES]; INPUTS],
    /// From the states to the torque.
    #[field(symbol = "c", unit = "1", range = -1e15..=1e15)]
    pub output: [T; STATES],
    /// From the inputs to the torque.
    #[field(symbol = "d", unit = "1", range = -1e15..=1e15)]
    pub direct: [T; INPUTS],
    /// Initial states for a bumpless transfer: per deviation of the angle, per velocity, per torque, per added torque.
    #[field(symbol = "S", unit = "1", range = -1e15..=1e15)]
    pub settled: [[T; STATES]; 4],
    /// Torque per deviation of the position and time.
    #[field(symbol = "K_i", unit = "N m/(rad s)", range = 0.0..=1e8)]
    pub integral_gain: T,
    /// Sampling time of the design.
    #[field(symbol = "T", unit = "s", range = 1e-6..=1.0, default = 1e-3)]
    pub sampling_time: T,
    /// Largest torque of the drive.
    #[field(symbol = "M_max", unit = "N m", range = 1e-6..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of a linear controller.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LinearState<T> {
    /// Its states; an angle among them is counted from the set-point of the sample before.
    #[field(symbol = "x", unit = "1")]
    pub states: [T; STATES],
    /// Integral part of the torque.
    #[field(symbol = "I", unit = "N m")]
    pub integral: T,
    /// Torque of the sample before, active in this one.
    #[field(symbol = "M_M", unit = "N m")]
    pub torque: T,
    /// Torque that was added to it, active in this one.
    #[field(symbol = "M_c", unit = "N m")]
    pub added_torque: T,
    /// Set-point of the sample before.
    #[field(symbol = "r", unit = "rad")]
    pub reference: T,
    /// Whether there was a sample before.
    #[field(unit = "1", flag)]
    pub started: T,
}

impl<T: Scalar> LinearController<T> {
    /// Inputs of the states.
    #[inline(always)]
    pub(super) fn inputs(&self, state: &LinearState<T>, input: &ControllerInput<T>) -> [T; INPUTS] {
        let gone = input.reference_position - state.reference;
        // The distance to the first set-point is that of its velocity.
        let steady = self.sampling_time * input.reference_velocity;
        [
            input.measured_angle - input.reference_position,
            input.measured_velocity,
            state.started.gt(T::of(0.5)).select(gone, steady),
            input.reference_velocity,
            input.reference_acceleration,
            state.torque,
            state.added_torque,
            input.added_torque,
        ]
    }

    /// The torque without its integral part [N m].
    #[inline(always)]
    pub(super) fn direct(&self, states: &[T; STATES], inputs: &[T; INPUTS]) -> T {
        dot(&self.output, states) + dot(&self.direct, inputs)
    }

    /// The state from which the next step with this input gives this torque [N m], as far as the limit admits it. The
    /// observed states are those of a long steady motion.
    #[inline(always)]
    pub fn take_over(&self, torque: T, input: ControllerInput<T>) -> LinearState<T> {
        let input = input.finite();
        let torque = within_limit(finite_or(torque, T::of(0.0)), self.torque_limit, input.added_torque);
        let added_torque = finite_or(input.added_torque, T::of(0.0));
        let motion = [input.measured_angle - input.reference_position, input.measured_velocity, torque, added_torque];
        let states = combine([T::of(0.0); STATES], &self.settled, &motion);
        let mut state = LinearState { states, torque, added_torque, ..LinearState::default() };
        state.integral = torque - self.direct(&state.states, &self.inputs(&state, &input));
        state
    }
}

impl<T: Scalar> Block<T> for LinearController<T> {
    type State = LinearState<T>;
    type Input = ControllerInput<T>;
    type Output = ControllerOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let inputs = self.inputs(state, &input);
        let demand = self.direct(&state.states, &inputs) + state.integral;
        let increment = self.increment(&input, dt);
        let (torque, integral) = limit_and_integrate(&input, demand, self.torque_limit, state.integral, increment);
        let moved = self.moved(&state.states, &inputs);
        state.advance(moved, integral, torque, &input);
        ControllerOutput { torque }
    }
}

impl<T: Scalar> LinearController<T> {
    /// Increment of the integral in a sample [N m].
    #[inline(always)]
    pub(super) fn increment(&self, input: &ControllerInput<T>, dt: T) -> T {
        self.integral_gain * (input.reference_position - input.measured_angle) * dt
    }

    /// The states a sample later.
    #[inline(always)]
    pub(super) fn moved(&self, states: &[T; STATES], inputs: &[T; INPUTS]) -> [T; STATES] {
        let moved = combine([T::of(0.0); STATES], &self.system, states);
        combine(moved, &self.input, inputs)
    }
}

impl<T: Scalar> LinearState<T> {
    /// Goes on to the next sample; results of a non-finite input are discarded.
    #[inline(always)]
    pub(super) fn advance(&mut self, moved: [T; STATES], integral: T, torque: T, input: &ControllerInput<T>) {
        let valid = input.valid();
        for (state, moved) in self.states.iter_mut().zip(moved) {
            *state = valid.select(moved, *state);
        }
        self.integral = integral;
        self.torque = torque;
        self.added_torque = valid.select(input.added_torque, T::of(0.0));
        self.reference = valid.select(input.reference_position, self.reference);
        // The motion of the set-point over a gap is unknown.
        self.started = valid.select(T::of(1.0), T::of(0.0));
    }
}

/// `sum` plus the weighted sum of all columns.
#[inline(always)]
pub(super) fn combine<T: Scalar, const N: usize, const M: usize>(
    mut sum: [T; M],
    columns: &[[T; M]; N],
    weights: &[T; N],
) -> [T; M] {
    for (column, weight) in columns.iter().zip(weights) {
        for row in 0..M {
            sum[row] += column[row] * *weight;
        }
    }
    sum
}

/// ∑ aᵢ·bᵢ, in order.
#[inline(always)]
fn dot<T: Scalar, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    let mut sum = a[0] * b[0];
    for index in 1..N {
        sum += a[index] * b[index];
    }
    sum
}
