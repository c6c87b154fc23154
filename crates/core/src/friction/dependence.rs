//! Dependences of friction besides the velocity: direction, angle, load, time at rest, temperature.

use core::f64::consts::TAU;

use super::Contact;
use crate::Fields;
use crate::scalar::Scalar;

/// Difference between the two directions. All zero: none.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Direction<T> {
    /// Share by which friction is greater against positive motion and smaller against negative motion.
    #[field(symbol = "ε_C", unit = "1", range = -0.95..=0.95)]
    pub asymmetry: T,
    /// Share by which viscous friction is greater against positive motion and smaller against negative motion.
    #[field(symbol = "ε_b", unit = "1", range = -0.95..=0.95)]
    pub viscous_asymmetry: T,
    /// A constant torque against positive motion: weight, or the offset of an amplifier.
    #[field(symbol = "M_0", unit = "N m", range = -200.0..=200.0)]
    pub offset: T,
}

impl<T: Scalar> Direction<T> {
    /// Factor of the friction that acts with this sign.
    #[inline(always)]
    pub(super) fn factor(&self, signed: T) -> T {
        T::of(1.0) + signed.sign() * self.asymmetry
    }

    /// Factor of the viscous friction at a velocity.
    #[inline(always)]
    pub(super) fn viscous_factor(&self, velocity: T) -> T {
        T::of(1.0) + velocity.sign() * self.viscous_asymmetry
    }
}

/// Dependence on the angle of the screw.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "shape")]
pub enum Position<T> {
    /// None.
    Constant,
    /// Ripple over a revolution of the screw.
    Ripple(Ripple<T>),
}

/// Factor of friction: 1 + r·sin(n·φ + φ_0).
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Ripple<T> {
    /// Amplitude, as a share of the friction.
    #[field(symbol = "r", unit = "1", range = 0.0..=0.9, default = 0.05)]
    pub amplitude: T,
    /// Periods in a revolution of the screw.
    #[field(symbol = "n", unit = "1", range = 1.0..=1000.0, default = 1.0, whole)]
    pub periods: T,
    /// Phase at angle 0.
    #[field(symbol = "φ_0", unit = "rad", range = -7.0..=7.0)]
    pub phase: T,
}

/// Dependence on the torque that the contact carries: 1 + k·|M_C|.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Load<T> {
    /// Share by which friction rises per torque carried.
    #[field(symbol = "k", unit = "1/(N m)", range = 0.0..=100.0)]
    pub sensitivity: T,
}

/// Factor from angle and load.
#[inline(always)]
pub(super) fn factor<T: Scalar>(position: &Position<T>, load: &Load<T>, contact: &Contact<T>) -> T {
    let one = T::of(1.0);
    let load = one + load.sensitivity * contact.load.abs();
    match position {
        Position::Constant => load,
        Position::Ripple(ripple) => {
            // Whole turns are taken off first, so that the sine stays exact far from angle 0.
            let turns = contact.angle * T::of(1.0 / TAU);
            let within = (turns - turns.floor()) * T::of(TAU);
            load * (one + ripple.amplitude * (ripple.periods * within + ripple.phase).sin())
        }
    }
}

/// Dependence on the time at rest.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "shape")]
pub enum Rest<T> {
    /// None.
    Constant,
    /// Friction rises with the time at rest.
    Rising(Rising<T>),
}

/// Friction that rises with the time at rest and falls back when the contact slides:
///
/// ```text
/// 1 + r·θ/(θ + γ),   θ̇ = 1 − |Ω_s|·θ/φ_c
/// ```
///
/// θ is the age of the contact. At rest, θ is the time since the contact stopped, and the factor is that of
/// B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083. In sliding, θ decays over the
/// distance φ_c by the ageing law of J. Dieterich (1979) and A. Ruina (1983): at a constant speed θ = φ_c/|Ω|. Only the
/// sliding part of the velocity counts (Ω_s = Ω − ż), so that a load that vibrates on its bristles continues to age.
/// Ageing raises the strength, not the stiffness of the bristles: it does not move a load at rest and generates no
/// energy.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Rising<T> {
    /// Share by which friction is greater after a long rest.
    #[field(symbol = "r_θ", unit = "1", range = 0.0..=10.0, default = 0.3)]
    pub rise: T,
    /// Time at rest for half of the rise.
    #[field(symbol = "γ", unit = "s", range = 1e-4..=1e6, default = 5.0)]
    pub time: T,
    /// Sliding distance that renews the contact.
    #[field(symbol = "φ_c", unit = "rad", range = 1e-7..=100.0, default = 5e-3)]
    pub way: T,
}

impl<T: Scalar> Rising<T> {
    #[inline(always)]
    fn factor(&self, age: T) -> T {
        T::of(1.0) + self.rise * (age / (age + self.time))
    }
}

impl<T: Scalar> Rest<T> {
    /// Factor of the holding torque at an age [s].
    #[inline(always)]
    pub(super) fn strength(&self, age: T) -> T {
        match self {
            Rest::Constant => T::of(1.0),
            Rest::Rising(rising) => rising.factor(age),
        }
    }

    /// Age [s] after a step of `dt` [s] with this sliding distance [rad]. The step is implicit: exact at rest and in
    /// steady sliding, and stable for any `dt`.
    #[inline(always)]
    pub(super) fn after(&self, age: T, way: T, dt: T) -> T {
        match self {
            Rest::Constant => age,
            Rest::Rising(rising) => (age + dt) / (T::of(1.0) + way.abs() / rising.way),
        }
    }

    /// Age [s] after long sliding at a constant speed [rad/s]; at rest 1e6 s (eleven days), the largest value.
    #[inline(always)]
    pub(super) fn steady_age(&self, speed: T) -> T {
        match self {
            Rest::Constant => T::of(0.0),
            Rest::Rising(rising) => rising.way / speed.max(T::of(1e-6) * rising.way),
        }
    }
}

/// Dependence on the temperature, which is constant during a run.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "shape")]
pub enum Temperature<T> {
    /// None.
    Constant,
    /// Friction falls as the contact warms up.
    Exponential(Warming<T>),
}

/// Factor of friction at another temperature than that of the identification: e^(−k_C·Δϑ), and e^(−k_b·Δϑ) for the
/// viscous part.
///
/// The slope at the reference is −k. The exponential is positive at any temperature and describes how lubricants thin.
/// A. Carvalho Bittencourt and S. Gunnarsson (J. Dyn. Sys., Meas., Control 134 (2012) 051013) found this fall of the
/// viscous part in the joint of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Warming<T> {
    /// Temperature above the reference.
    #[field(symbol = "Δϑ", unit = "K", range = -100.0..=200.0, default = 20.0)]
    pub temperature: T,
    /// Share per kelvin by which friction falls, except its viscous part.
    #[field(symbol = "k_C", unit = "1/K", range = -0.02..=0.02, default = 1e-3)]
    pub fall: T,
    /// Share per kelvin by which viscous friction falls.
    #[field(symbol = "k_b", unit = "1/K", range = -0.1..=0.1, default = 5e-3)]
    pub viscous_fall: T,
}

impl<T: Scalar> Temperature<T> {
    /// Factor of all friction, and additional factor of the viscous part.
    #[inline(always)]
    pub(super) fn factors(&self) -> (T, T) {
        match self {
            Temperature::Constant => (T::of(1.0), T::of(1.0)),
            Temperature::Exponential(Warming { temperature, fall, viscous_fall }) => {
                ((-(*fall * *temperature)).exp(), ((*fall - *viscous_fall) * *temperature).exp())
            }
        }
    }
}

/// Factors of time at rest and temperature in a step.
#[derive(Clone, Copy)]
pub(super) struct Condition<T> {
    /// Factor of the sliding level, by the age.
    pub(super) strength: T,
    /// Inverse of `strength`.
    pub(super) per_strength: T,
    /// Factor of all friction, by the temperature.
    pub(super) warmth: T,
    /// Additional factor of the viscous friction, by the temperature.
    pub(super) thinning: T,
}

impl<T: Scalar> Condition<T> {
    /// All factors are 1.
    #[inline(always)]
    pub(super) fn reference() -> Self {
        let one = T::of(1.0);
        Condition { strength: one, per_strength: one, warmth: one, thinning: one }
    }

    /// Factors at an age [s].
    #[inline(always)]
    pub(super) fn of(rest: &Rest<T>, temperature: &Temperature<T>, age: T) -> Self {
        let strength = rest.strength(age);
        let (warmth, thinning) = temperature.factors();
        Condition { strength, per_strength: T::of(1.0) / strength, warmth, thinning }
    }
}
