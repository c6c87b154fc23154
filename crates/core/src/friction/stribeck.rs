//! The sliding curve: friction at constant speed.

use crate::Fields;
use crate::block::Block;
use crate::scalar::{Mask, Scalar};

/// How the breakaway torque falls to the kinetic torque as speed rises, with s = |Ω|/Ω_Strib.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "shape")]
pub enum Decay<T> {
    /// e^(−s), equation (1).
    Exponential,
    /// e^(−s²), Armstrong's form.
    Gaussian,
    /// e^(−s^δ).
    Power(Exponent<T>),
}

/// The exponent of [`Decay::Power`].
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Exponent<T> {
    /// Exponent of the speed: 1 is the exponential form, 2 the Gaussian; 0.5 … 1 is common for boundary lubrication.
    #[field(symbol = "δ", unit = "1", range = 0.1..=4.0, default = 1.0)]
    pub exponent: T,
}

/// The Stribeck curve, for Ω ≥ 0
///
/// ```text
/// M_R(Ω) = M_K + (M_S − M_K)·e^(−(Ω/Ω_Strib)^δ) + b·Ω
/// ```
///
/// Equation (1) of Henrichfreise, Starbek, Reuter with δ = 1. Coulomb friction is M_S = M_K with b = 0; viscous
/// friction adds b. It is a static curve: at rest use it within [`Static`](super::Static) or a bristle model.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Stribeck<T> {
    /// Torque at which the drive breaks away from rest. Below the kinetic torque on machines without a Stribeck drop.
    #[field(symbol = "M_S", unit = "N m", range = 1e-6..=200.0, default = 0.300)]
    pub breakaway_torque: T,
    /// Level of sliding friction before viscous friction dominates.
    #[field(symbol = "M_K", unit = "N m", range = 1e-6..=200.0, default = 0.180)]
    pub kinetic_torque: T,
    /// Speed at which the drop from breakaway to kinetic torque has fallen to 1/e.
    #[field(symbol = "Ω_Strib", unit = "rad/s", range = 1e-4..=1e3, default = 3.0)]
    pub stribeck_velocity: T,
    /// Viscous torque per speed, caused by the lubricant.
    #[field(symbol = "b", unit = "N m s/rad", range = 0.0..=50.0, default = 2.0e-4)]
    pub viscous_friction: T,
    /// Form in which the drop decreases with speed.
    pub decay: Decay<T>,
}

impl<T: Scalar> Stribeck<T> {
    /// The share of the drop that is left at a speed [rad/s]: 1 at rest, 0 far above the Stribeck velocity.
    #[inline(always)]
    fn drop(&self, speed: T) -> T {
        let s = speed / self.stribeck_velocity;
        match self.decay {
            Decay::Exponential => (-s).exp(),
            Decay::Gaussian => gaussian(s.barrier()),
            Decay::Power(Exponent { exponent }) => power(s.barrier(), exponent),
        }
    }

    /// Sliding level g(|Ω|) without the viscous part [N m].
    #[inline(always)]
    pub fn level(&self, speed: T) -> T {
        self.kinetic_torque + (self.breakaway_torque - self.kinetic_torque) * self.drop(speed)
    }

    /// Friction torque [N m] at a speed Ω ≥ 0 [rad/s], equation (1).
    #[inline(always)]
    pub fn magnitude(&self, speed: T) -> T {
        self.level(speed) + self.viscous_friction * speed
    }

    /// Friction torque [N m] at a velocity [rad/s], against it; 0 at rest and for NaN.
    #[inline(always)]
    pub fn torque(&self, velocity: T) -> T {
        let magnitude = self.magnitude(velocity.abs());
        velocity.gt(T::of(0.0)).select(magnitude, velocity.lt(T::of(0.0)).select(-magnitude, T::of(0.0)))
    }
}

/// Inputs of a Stribeck curve.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Speed<T> {
    /// Magnitude of the velocity.
    #[field(symbol = "|Ω|", unit = "rad/s", range = 0.0..=1e4)]
    pub speed: T,
}

/// Outputs of a Stribeck curve.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct FrictionTorque<T> {
    /// Magnitude of the friction torque.
    #[field(symbol = "M_R", unit = "N m")]
    pub torque: T,
}

impl<T: Scalar> Block<T> for Stribeck<T> {
    type State = ();
    type Input = Speed<T>;
    type Output = FrictionTorque<T>;

    #[inline(always)]
    fn step(&self, _state: &mut (), input: Speed<T>, _dt: T) -> FrictionTorque<T> {
        FrictionTorque { torque: self.magnitude(input.speed) }
    }
}

/// e^(−s²).
#[inline(always)]
fn gaussian<T: Scalar>(s: T) -> T {
    (-(s * s)).exp()
}

/// e^(−s^δ) for s ≥ 0.
#[inline(always)]
fn power<T: Scalar>(s: T, exponent: T) -> T {
    // ln needs s > 0; at rest the whole drop is left.
    let moving = s.gt(T::of(0.0));
    let power = (exponent * moving.select(s, T::of(1.0)).ln()).exp();
    moving.select((-power).exp(), T::of(1.0))
}

impl<T: Scalar> Stribeck<T> {
    /// The smallest sliding level over all speeds [N m].
    pub fn smallest_level(&self) -> T {
        self.breakaway_torque.min(self.kinetic_torque)
    }
}

/// Static friction with true stick: a set-valued law, solved by time stepping.
///
/// At rest it balances the torque that would move the load, up to the breakaway torque; in motion it is the Stribeck
/// curve. Within a step the torque is the one that brings the load to rest, limited to the curve (Moreau's time
/// stepping; no velocity band as in Karnopp's model, no regularised sign). Sticks exactly and has no presliding; where
/// presliding matters, use [`ElastoPlastic`](super::ElastoPlastic).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Static<T> {
    /// The sliding curve; its breakaway torque holds the load.
    pub sliding: Stribeck<T>,
}

impl<T: Scalar> Static<T> {
    /// Torque over a step [N m] without the viscous part: the arresting torque within ± the level at this speed.
    #[inline(always)]
    pub fn torque(&self, velocity: T, arrest: T) -> T {
        let level = self.sliding.level(velocity.abs());
        arrest.clamp(-level, level)
    }
}
