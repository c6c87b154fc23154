//! Feedforward of a Stribeck curve that is estimated while the drive runs.

use super::{CompensationInput, CompensationOutput, FrictionFeedforward, FrictionFeedforwardState};
use crate::Fields;
use crate::block::Block;
use crate::fields::Fields as _;
use crate::friction::{Bristles, Stribeck};
use crate::scalar::{Mask, Scalar};

/// No drive turns faster [rad/s], or takes more torque [N m]: a single such sample would spoil the estimate for long.
const BEYOND: f64 = 1e4;

/// Whether a drive can have this motion and torque.
#[inline(always)]
fn usual<T: Scalar>(input: &CompensationInput<T>) -> T::Mask {
    (input.measured_velocity.abs() + input.applied_torque.abs()).lt(T::of(BEYOND))
}

/// Recursive least squares for kinetic torque, Stribeck drop and viscous friction, and a feedforward of the estimate:
///
///   M_M − J·ω̇ = θ₁·sgn ω + θ₂·e^(−|ω|/Ω_Strib)·sgn ω + θ₃·ω,   M_K = θ₁, M_S = θ₁ + θ₂, b = θ₃
///
/// Both sides pass the same low-pass, which makes the acceleration a difference. The estimate is frozen while the drive
/// is slower than a multiple of the velocity's noise: there the sign is random, and bristles do not follow the curve.
/// It forgets slowly, its covariance is bounded, and the estimate stays within physical limits of friction. Ω_Strib is
/// not estimated.
///
/// K. J. Åström, B. Wittenmark, *Adaptive Control* (1995), chapter 2.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AdaptiveStribeck<T> {
    /// The initial curve; its Stribeck velocity is kept.
    pub friction: Stribeck<T>,
    /// The bristles under it.
    pub bristles: Bristles<T>,
    /// Preview from the sample to the action of its torque: 1.5 sampling times and the lag of the servo amplifier.
    #[field(symbol = "T_p", unit = "s", range = 0.0..=1.0, default = 1.8e-3)]
    pub preview: T,
    /// Inertia of motor and load side together.
    #[field(symbol = "J", unit = "kg m^2", range = 1e-9..=10.0, default = 1.01e-3)]
    pub inertia: T,
    /// Time constant of the low-pass.
    #[field(symbol = "τ", unit = "s", range = 1e-5..=10.0, default = 5e-3)]
    pub filter_time: T,
    /// Speed below which the estimate is frozen: at least 10 times the noise of the velocity.
    #[field(symbol = "Ω_f", unit = "rad/s", range = 1e-4..=1e3, default = 1.0)]
    pub freeze_velocity: T,
    /// Weight of a sample relative to the one after it.
    #[field(symbol = "λ", unit = "1", range = 0.9..=1.0, default = 0.9995)]
    pub forgetting: T,
    /// Initial covariance of the levels, per variance of the torque: 0.001 trusts the model as much as a thousand
    /// samples. That of the viscous torque is the same at ten Stribeck velocities. Ten times as much is the bound.
    #[field(symbol = "P₀", unit = "1", range = 1e-9..=1e3, default = 1e-3)]
    pub covariance: T,
    /// Largest torque of the compensation, and of each level.
    #[field(symbol = "M_c,max", unit = "N m", range = 0.0..=1e4, default = 1.4)]
    pub torque_limit: T,
}

/// State of the adaptive compensation.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct AdaptiveStribeckState<T> {
    /// Kinetic torque, drop from breakaway to kinetic torque, viscous friction.
    #[field(symbol = "θ", unit = "1")]
    pub estimate: [T; 3],
    /// Its covariance.
    #[field(symbol = "P", unit = "1")]
    pub covariance: [[T; 3]; 3],
    /// Low-pass of the regressors of the three estimates.
    #[field(unit = "1")]
    pub regressors: [T; 3],
    /// Low-pass of the motor's torque.
    #[field(unit = "N m")]
    pub torque: T,
    /// Low-pass of the velocity.
    #[field(unit = "rad/s")]
    pub velocity: T,
    /// State of the feedforward.
    pub feedforward: FrictionFeedforwardState<T>,
    /// Whether there was a sample before.
    #[field(unit = "1", flag)]
    pub started: T,
}

impl<T: Scalar> AdaptiveStribeck<T> {
    /// Starts from the initial curve, with low-passes in the steady state of the motion; returns the torque [N m].
    #[inline(always)]
    pub(super) fn begin(&self, state: &mut AdaptiveStribeckState<T>, input: CompensationInput<T>) -> T {
        *state = self.fresh(&input);
        self.feedforward(state.estimate).begin(&mut state.feedforward, input)
    }

    #[inline(always)]
    fn fresh(&self, input: &CompensationInput<T>) -> AdaptiveStribeckState<T> {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let Stribeck { breakaway_torque, kinetic_torque, viscous_friction, stribeck_velocity, .. } = self.friction;
        let (level, fast) = (self.covariance, T::of(10.0) * stribeck_velocity);
        let usual = usual(input);
        let velocity = usual.select(input.measured_velocity, zero);
        AdaptiveStribeckState {
            estimate: [kinetic_torque, breakaway_torque - kinetic_torque, viscous_friction],
            covariance: [[level, zero, zero], [zero, level, zero], [zero, zero, level / (fast * fast)]],
            regressors: self.regressors(velocity),
            torque: usual.select(input.applied_torque, zero),
            velocity,
            feedforward: FrictionFeedforwardState::default(),
            started: one,
        }
    }

    /// Regressors of the three estimates at a velocity [rad/s].
    #[inline(always)]
    fn regressors(&self, velocity: T) -> [T; 3] {
        let side = velocity.sign();
        [side, (-velocity.abs() / self.friction.stribeck_velocity).exp() * side, velocity]
    }

    /// Feedforward of the friction with these three numbers.
    #[inline(always)]
    fn feedforward(&self, [kinetic_torque, drop, viscous_friction]: [T; 3]) -> FrictionFeedforward<T> {
        let breakaway_torque = kinetic_torque + drop;
        let sliding = Stribeck { breakaway_torque, kinetic_torque, viscous_friction, ..self.friction };
        FrictionFeedforward {
            friction: self.bristles.under(sliding),
            preview: self.preview,
            torque_limit: self.torque_limit,
        }
    }

    /// Updates the low-passes by a sample; returns the friction torque [N m].
    #[inline(always)]
    fn filter(&self, state: &mut AdaptiveStribeckState<T>, input: &CompensationInput<T>, dt: T) -> T {
        let velocity = input.measured_velocity;
        let share = dt / (self.filter_time + dt);
        for (low, now) in state.regressors.iter_mut().zip(self.regressors(velocity)) {
            *low += share * (now - *low);
        }
        state.torque += share * (input.applied_torque - state.torque);
        let before = state.velocity;
        state.velocity += share * (velocity - before);
        state.torque - self.inertia / dt * (state.velocity - before)
    }

    /// Updates the estimate by a sample.
    #[inline(always)]
    fn learn(&self, state: &mut AdaptiveStribeckState<T>, friction: T) {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let (phi, p) = (state.regressors, state.covariance);
        let dot = |a: [T; 3], b: [T; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let pushed = p.map(|row| dot(row, phi));
        let scale = one / (self.forgetting + dot(phi, pushed));
        let error = friction - dot(phi, state.estimate);
        for (value, gain) in state.estimate.iter_mut().zip(pushed) {
            *value += scale * gain * error;
        }
        // With little motion, forgetting makes the covariance grow without bound.
        let fast = T::of(10.0) * self.friction.stribeck_velocity;
        let trace = p[0][0] + p[1][1] + fast * fast * p[2][2];
        let room = (trace / self.forgetting).le(T::of(30.0) * self.covariance);
        let forgotten = room.select(one / self.forgetting, one);
        for i in 0..3 {
            for j in 0..3 {
                state.covariance[i][j] = forgotten * (p[i][j] - scale * pushed[i] * pushed[j]);
            }
        }
        let level = state.estimate[0].clamp(T::of(1e-6), self.torque_limit);
        let drop = state.estimate[1].clamp(zero, T::of(1.5) * level);
        state.estimate = [level, drop, state.estimate[2].max(zero)];
    }
}

impl<T: Scalar> Block<T> for AdaptiveStribeck<T> {
    type State = AdaptiveStribeckState<T>;
    type Input = CompensationInput<T>;
    type Output = CompensationOutput<T>;

    #[inline(always)]
    fn step(&self, state: &mut Self::State, input: Self::Input, dt: T) -> Self::Output {
        let fresh = self.fresh(&input);
        let started = state.started.gt(T::of(0.5));
        *state = state.merge(&fresh, &mut |running, fresh| started.select(running, fresh));
        let valid = usual(&input);
        let mut next = *state;
        let friction = self.filter(&mut next, &input, dt);
        let mut learnt = next;
        self.learn(&mut learnt, friction);
        let fast = next.velocity.abs().gt(self.freeze_velocity);
        let next = learnt.merge(&next, &mut |yes, no| fast.select(yes, no));
        *state = next.merge(state, &mut |yes, no| valid.select(yes, no));

        self.feedforward(state.estimate).run(&mut state.feedforward, input, dt)
    }
}
