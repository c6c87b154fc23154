//! Predictive control: a linear controller with limits over a horizon.

use super::linear::combine;
use super::position::{limit_and_integrate, within_limit};
use super::{ControllerInput, ControllerOutput, LinearController, LinearState, STATES};
use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// Samples of the horizon.
pub const HORIZON: usize = 20;
/// Interval in samples at which the velocity is checked: it changes slowly.
pub const STRIDE: usize = 4;
/// Number of checked velocities.
pub const SPEEDS: usize = HORIZON / STRIDE;
/// Causes of the course without limits: states and integral after this sample, its torque, velocity and acceleration of
/// the set-point, and the torque of compensation.
pub const CAUSES: usize = STATES + 5;
/// Iterations for the limits: rounds of this number of steps. Jumps of the set-point that require many times the torque
/// would need more; the rest is cut off.
const ROUNDS: usize = 5;
const AT_ONCE: usize = 8;
/// Over-relaxation of the iteration, the usual value.
const RELAXATION: f64 = 1.6;

/// Predictive control with the torque, its rate and the velocity within limits over a horizon.
///
/// Of all courses of the torque that keep the limits it takes the nearest to that of the linear controller on the
/// modelled drive, u⁰ (of a linear quadratic regulator: the one with the least cost over all time, with the regulator
/// itself after the horizon):
///
/// ```text
/// min ½·(U − U⁰)ᵀ·H·(U − U⁰)   over   |u + M_c| ≤ M_max,   |Δ(u + M_c)| ≤ T·dM_max,   |Ω| ≤ Ω_max
/// ```
///
/// and outputs its first torque. H = T⁻ᵀ·T⁻¹ with the closed loop's response T to an added torque. Where no limit is
/// active, U = U⁰ exactly: it *is* the linear controller. The quadratic program is solved by a fixed number of steps of
/// the alternating direction method of multipliers ([`LimitStep`], forty times) from a cold start, so that no error
/// passes to the next sample. The first torque always keeps torque limit and rate; the velocity is limited as far as
/// these two admit.
///
/// B. Kouvaritakis, J. A. Rossiter, J. Schuurmans, IEEE TAC 45 (2000) 1545; B. Stellato et al., Math. Prog. Comp. 12
/// (2020) 637. It ignores the motion after the horizon (20 samples): a long braking distance requires a set-point with
/// its own limits.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Predictive<T> {
    /// The linear controller, used where no limit is active.
    pub linear: LinearController<T>,
    /// Torque of each next sample without limits, a column for each cause; the first row is this sample's.
    #[field(unit = "1", range = -1e15..=1e15)]
    pub free_torque: [[T; HORIZON]; CAUSES],
    /// Velocity at each interval without limits, likewise.
    #[field(unit = "1", range = -1e15..=1e15)]
    pub free_velocity: [[T; SPEEDS]; CAUSES],
    /// Iteration for the limits.
    pub steps: LimitSteps<T>,
    /// Torque equivalent of a velocity in the iteration.
    #[field(unit = "N m s/rad", range = 0.0..=1e9, default = 1.0)]
    pub velocity_weight: T,
    /// Largest rate of the torque.
    #[field(symbol = "dM_max", unit = "N m/s", range = 1e-3..=1e9, default = 1e6)]
    pub torque_rate_limit: T,
    /// Largest velocity of the load.
    #[field(symbol = "Ω_max", unit = "rad/s", range = 1e-3..=1e6, default = 200.0)]
    pub speed_limit: T,
}

/// Limited quantities over the horizon: each torque, its change, and velocities.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Limited<T> {
    /// Torques.
    #[field(unit = "N m")]
    pub torque: [T; HORIZON],
    /// Their changes from sample to sample.
    #[field(unit = "N m")]
    pub change: [T; HORIZON],
    /// Velocities, in equivalent torques.
    #[field(unit = "N m")]
    pub velocity: [T; SPEEDS],
}

/// A course without limits, and the limits.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LimitStepInput<T> {
    /// The quantities of the course without limits.
    pub free: Limited<T>,
    /// Largest torque, change and velocity, in either direction.
    #[field(unit = "N m")]
    pub limits: [T; 3],
}

/// State of the iteration: the limited quantities plus the price of their limits.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LimitStepState<T> {
    /// Sum of both.
    pub point: Limited<T>,
}

/// One step of the alternating direction method of multipliers, in the form of Douglas and Rachford:
///
///   z = clamp(w),   V = R·Aᵀ·(2·z − w − f),   w⁺ = α·(f + A·V) + (1 − α)·z + w − z,   R = (H/ρ + Aᵀ·A)⁻¹
///
/// A: torques, their changes, and the resulting velocities.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LimitStep<T> {
    /// R, column by column.
    #[field(unit = "1", range = -1e15..=1e15)]
    pub resolvent: [[T; HORIZON]; HORIZON],
    /// Velocity k + 1 samples after a torque, in torques.
    #[field(unit = "1", range = -1e15..=1e15)]
    pub answer: [T; HORIZON],
}

/// A number of steps at once, so that their diagram and C code stay readable.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LimitSteps<T> {
    /// Each of them.
    pub step: LimitStep<T>,
}

/// Difference of the course to the one without limits.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LimitStepOutput<T> {
    /// Torque of each sample.
    #[field(unit = "N m")]
    pub moved: [T; HORIZON],
}

impl<T: Scalar> Limited<T> {
    /// A function of each element with its kind of limit.
    #[inline(always)]
    fn each(mut self, other: &Self, limits: &[T; 3], of: impl Fn(T, T, T) -> T) -> Self {
        for k in 0..HORIZON {
            self.torque[k] = of(self.torque[k], other.torque[k], limits[0]);
            self.change[k] = of(self.change[k], other.change[k], limits[1]);
        }
        for k in 0..SPEEDS {
            self.velocity[k] = of(self.velocity[k], other.velocity[k], limits[2]);
        }
        self
    }
}

impl<T: Scalar> LimitStep<T> {
    /// A·V.
    #[inline(always)]
    fn limited(&self, torque: [T; HORIZON]) -> Limited<T> {
        let mut change = torque;
        for k in 1..HORIZON {
            change[k] = torque[k] - torque[k - 1];
        }
        let mut velocity = [T::of(0.0); SPEEDS];
        for (j, velocity) in velocity.iter_mut().enumerate() {
            let last = (j + 1) * STRIDE - 1;
            for k in 0..=last {
                *velocity += self.answer[last - k] * torque[k];
            }
        }
        Limited { torque, change, velocity }
    }

    /// Aᵀ·b.
    #[inline(always)]
    fn gathered(&self, b: &Limited<T>) -> [T; HORIZON] {
        let mut sum = b.torque;
        for k in 0..HORIZON {
            sum[k] += b.change[k];
            if k + 1 < HORIZON {
                sum[k] -= b.change[k + 1];
            }
        }
        for (j, velocity) in b.velocity.iter().enumerate() {
            let last = (j + 1) * STRIDE - 1;
            for k in 0..=last {
                sum[k] += self.answer[last - k] * *velocity;
            }
        }
        sum
    }
}

impl<T: Scalar> Block<T> for LimitStep<T> {
    type State = LimitStepState<T>;
    type Input = LimitStepInput<T>;
    type Output = LimitStepOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, _dt: T) -> Self::Output {
        let LimitStepInput { free, limits } = input;
        let kept = state.point.each(&free, &limits, |point, _, limit| point.clamp(-limit, limit));
        // 2·z − w − f, which is exactly 0 where no limit is active.
        let price = state.point.each(&kept, &limits, |point, kept, _| point - kept);
        let wanted = kept.each(&price, &limits, |kept, price, _| kept - price);
        let wanted = wanted.each(&free, &limits, |wanted, free, _| wanted - free);
        let moved = combine([T::of(0.0); HORIZON], &self.resolvent, &self.gathered(&wanted));
        let reached = self.limited(moved).each(&free, &limits, |moved, free, _| free + moved);
        let relaxed = reached.each(&kept, &limits, |reached, kept, _| kept + T::of(RELAXATION) * (reached - kept));
        state.point = relaxed.each(&price, &limits, |relaxed, price, _| relaxed + price);
        LimitStepOutput { moved }
    }
}

impl<T: Scalar> Block<T> for LimitSteps<T> {
    type State = LimitStepState<T>;
    type Input = LimitStepInput<T>;
    type Output = LimitStepOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let mut output = LimitStepOutput { moved: [T::of(0.0); HORIZON] };
        for _ in 0..AT_ONCE {
            output = self.step.run(state, input, dt);
        }
        output
    }
}

impl<T: Scalar> Predictive<T> {
    /// The state from which the next step with this input gives this torque [N m], as far as the limits admit it.
    #[inline(always)]
    pub fn take_over(&self, torque: T, input: ControllerInput<T>) -> LinearState<T> {
        self.linear.take_over(torque, input)
    }

    /// Difference of the first torque to the one without limits [N m], from the causes of the course and the torque
    /// that is active until it acts [N m].
    #[inline(always)]
    fn first_move(&self, causes: &[T; CAUSES], before: T, dt: T) -> T {
        let zero = T::of(0.0);
        // Limits hold for the sum of both torques.
        let added = causes[CAUSES - 1];
        let mut torque = combine([zero; HORIZON], &self.free_torque, causes);
        for torque in &mut torque {
            *torque += added;
        }
        let mut change = torque;
        for k in 1..HORIZON {
            change[k] = torque[k] - torque[k - 1];
        }
        change[0] = torque[0] - before;
        let mut velocity = combine([zero; SPEEDS], &self.free_velocity, causes);
        for velocity in &mut velocity {
            *velocity = self.velocity_weight * *velocity;
        }
        let free = Limited { torque, change, velocity };
        let speed_limit = self.velocity_weight * self.speed_limit;
        let limits = [self.linear.torque_limit, dt * self.torque_rate_limit, speed_limit];
        let mut state = LimitStepState { point: free };
        let mut first = zero;
        for _ in 0..ROUNDS {
            first = self.steps.run(&mut state, LimitStepInput { free, limits }, dt).moved[0];
        }
        first
    }
}

impl<T: Scalar> Block<T> for Predictive<T> {
    type State = LinearState<T>;
    type Input = ControllerInput<T>;
    type Output = ControllerOutput<T>;

    // Out of line: long, and not active in every tick.
    #[inline(never)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let linear = &self.linear;
        let inputs = linear.inputs(state, &input);
        let demand = linear.direct(&state.states, &inputs) + state.integral;
        let increment = linear.increment(&input, dt);
        let moved = linear.moved(&state.states, &inputs);
        let mut causes = [T::of(0.0); CAUSES];
        causes[..STATES].copy_from_slice(&moved);
        causes[STATES] = state.integral + increment;
        causes[STATES + 1] = demand;
        causes[STATES + 2] = input.reference_velocity;
        causes[STATES + 3] = input.reference_acceleration;
        causes[STATES + 4] = input.added_torque;
        let before = state.torque + state.added_torque;
        let wanted = demand + self.first_move(&causes, before, dt);
        // After any iteration: the rate first, then the torque, as in the drive's amplifier.
        let (change, rest) = (dt * self.torque_rate_limit, before - input.added_torque);
        let wanted = wanted.clamp(rest - change, rest + change);
        let given = within_limit(wanted, linear.torque_limit, input.added_torque);
        // Where a limit reduces the torque, the integral moves only back.
        let increment = ((demand - given) * increment).le(T::of(0.0)).select(increment, T::of(0.0));
        let (torque, integral) = limit_and_integrate(&input, given, linear.torque_limit, state.integral, increment);
        state.advance(moved, integral, torque, &input);
        ControllerOutput { torque }
    }
}
