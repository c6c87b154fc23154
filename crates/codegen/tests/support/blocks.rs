//! Small blocks with all features of a block.

use stickslip_core::Fields;
use stickslip_core::block::Block;
use stickslip_core::scalar::{Mask, Scalar};

/// Sliding friction.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct SlidingFriction<T> {
    /// Torque at which the drive breaks away from rest. Not /* nested */ in C.
    #[field(symbol = "M_S", unit = "N m", range = 1e-6..=200.0, default = 0.300)]
    pub breakaway_torque: T,
    /// Level that sliding friction settles to before viscous friction takes over.
    #[field(symbol = "M_K", unit = "N m", range = 1e-6..=200.0, default = 0.180)]
    pub kinetic_torque: T,
    /// Speed at which friction has dropped by 63 %.
    #[field(symbol = "Ω_Strib", unit = "rad/s", range = 1e-4..=1e3, default = 1.5)]
    pub stribeck_velocity: T,
    /// Slope at high speed.
    #[field(symbol = "b", unit = "N m s/rad", range = 0.0..=10.0, default = 1.2e-3)]
    pub viscous_friction: T,
}

impl<T: Scalar> Block<T> for SlidingFriction<T> {
    type State = ();
    type Input = T;
    type Output = T;

    fn step(&self, _state: &mut (), velocity: T, _dt: T) -> T {
        let speed = velocity.abs();
        let drop = (self.breakaway_torque - self.kinetic_torque) * (-(speed / self.stribeck_velocity)).exp();
        (self.kinetic_torque + drop) * velocity.sign() + self.viscous_friction * velocity
    }
}

/// First-order lag.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Lag<T> {
    /// Time constant; the name `double` is taken in C.
    #[field(symbol = "T_1", unit = "s", range = 1e-6..=1e3, default = 0.02)]
    pub double: T,
    /// Largest value.
    #[field(unit = "1", range = 0.0..=1e9, default = 20.0)]
    pub limit: T,
}

/// State of a lag.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LagState<T> {
    /// The value that lags behind.
    #[field(unit = "1", default = 0.25)]
    pub value: T,
}

impl<T: Scalar> Block<T> for Lag<T> {
    type State = LagState<T>;
    type Input = T;
    type Output = T;

    fn step(&self, state: &mut LagState<T>, input: T, dt: T) -> T {
        let share = dt / (self.double + dt);
        state.value = (state.value + share * (input - state.value)).clamp(-self.limit, self.limit);
        state.value
    }
}

/// Friction of several kinds.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub enum Holder<T> {
    /// None at all.
    Nothing,
    /// Static.
    Sliding(SlidingFriction<T>),
}

/// A mass with friction, lags in its path, and a swap of two numbers a step.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Nested<T> {
    /// What holds it.
    pub holder: Holder<T>,
    /// Lags one after the other.
    pub lags: [Lag<T>; 3],
    /// Moment of inertia.
    #[field(symbol = "J", unit = "kg m^2", range = 1e-6..=1.0, default = 1e-3)]
    pub inertia: T,
    /// Harmonic torque by angle.
    #[field(unit = "N m", range = -1.0..=1.0, default = 0.01)]
    pub ripple: [T; 2],
}

/// State of the mass.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NestedState<T> {
    /// The lags.
    pub lags: [LagState<T>; 3],
    /// Angle.
    #[field(symbol = "φ", unit = "rad")]
    pub angle: T,
    /// Velocity.
    #[field(symbol = "Ω", unit = "rad/s")]
    pub velocity: T,
    /// Exchanged each step.
    #[field(unit = "1", default = 1.0)]
    pub memory: [T; 2],
}

/// Input of the mass.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NestedInput<T> {
    /// Torque.
    #[field(symbol = "M", unit = "N m", range = -2.0..=2.0)]
    pub torque: T,
    /// Whether the torque acts.
    #[field(unit = "1", flag)]
    pub default: T,
}

/// Output of the mass.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct NestedOutput<T> {
    /// Velocity behind the lags.
    #[field(unit = "rad/s")]
    pub velocity: T,
    /// Encoder counts.
    #[field(unit = "counts")]
    pub counts: T,
    /// Last friction torque.
    #[field(unit = "N m")]
    pub friction_torque: T,
}

impl<T: Scalar> Block<T> for Nested<T> {
    type State = NestedState<T>;
    type Input = NestedInput<T>;
    type Output = NestedOutput<T>;

    fn step(&self, state: &mut NestedState<T>, input: NestedInput<T>, dt: T) -> NestedOutput<T> {
        let torque = input.default.gt(T::of(0.5)).select(input.torque, T::of(0.0));
        let dt_sub = dt * T::of(0.25);
        let mut friction_torque = T::of(0.0);
        for _ in 0..4 {
            friction_torque = match &self.holder {
                Holder::Nothing => T::of(0.0),
                Holder::Sliding(model) => model.run(&mut (), state.velocity, dt_sub),
            };
            let harmonic = self.ripple[0] * state.angle.sin() + self.ripple[1] * (state.angle * T::of(2.0)).cos();
            state.velocity += (torque - friction_torque - harmonic) / self.inertia * dt_sub;
            state.angle += state.velocity * dt_sub;
        }
        let mut velocity = state.velocity;
        for i in 0..3 {
            velocity = self.lags[i].run(&mut state.lags[i], velocity, dt);
        }
        state.memory = [state.memory[1], state.memory[0] + velocity * T::of(1e-3)];
        // A computed parameter and a state that is used twice: no existing struct holds them.
        let blended = Lag { double: self.lags[0].double * T::of(2.0), limit: state.memory[0].abs() + T::of(1.0) };
        let mut copy = LagState { value: state.memory[0] };
        let sum = blended.run(&mut copy, velocity, dt) + blended.run(&mut copy, velocity, dt);
        let moving = velocity.abs().gt(T::of(1e-3)) & !(velocity.abs().ge(T::of(1e3)));
        NestedOutput {
            velocity: (moving | input.default.lt(T::of(0.5))).select(velocity, sum),
            counts: (state.angle * T::of(40.0)).floor() + (state.memory[1] * T::of(7.0)).round(),
            friction_torque,
        }
    }
}
