//! Bristle models: friction with a state, the mean deflection z of the contact's bristles.
//!
//! A model states its physics once, as the four functions of [`Bristle`]; [`rate`] (for reference solvers and
//! linearisation) and [`advance`] (for the plant's splitting integrator and the tick) are written once over them.

use core::f64::consts::PI;

use super::Stribeck;
use super::dependence::Condition;
use crate::Fields;
use crate::fields::{Relation, at_most};
use crate::scalar::kernel::{cosine, sine};
use crate::scalar::{Mask, Scalar};

/// The four functions of a bristle model.
pub trait Bristle<T: Scalar> {
    /// Sliding level g [N m] at a speed ≥ 0 [rad/s], without the viscous part.
    fn sliding(&self, speed: T) -> T;
    /// Sliding share of the motion at a deflection [rad] and a velocity [rad/s]; `level` is the sliding level [N m].
    fn release(&self, deflection: T, velocity: T, level: T) -> Release<T>;
    /// Damping σ₁ of the bristles [N m s/rad] at a velocity [rad/s].
    fn damping(&self, velocity: T) -> T;
    /// Stiffness σ₀ of the bristles [N m/rad].
    fn stiffness(&self) -> T;
    /// Deflection at the end of a step [rad], limited to what a motion from `start` [rad] can reach at this sliding
    /// level [N m]. Default: `end`, without a limit.
    #[inline(always)]
    fn within_reach(&self, _level: T, _start: T, end: T) -> T {
        end
    }
}

/// Sliding share of a motion, and its slope over the deflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Release<T> {
    /// Share α: 0 elastic … 1 sliding.
    pub share: T,
    /// z·∂α/∂z.
    pub slope: T,
}

impl<T: Scalar> Release<T> {
    /// All of the motion slides, for any deflection.
    #[inline(always)]
    pub fn sliding() -> Self {
        Release { share: T::of(1.0), slope: T::of(0.0) }
    }
}

/// ż [rad/s] = Ω − α·σ₀·|Ω|·z/g(|Ω|), and the bristle torque σ₀·z + σ₁·ż [N m].
#[inline(always)]
pub fn rate<T: Scalar>(model: &impl Bristle<T>, deflection: T, velocity: T) -> (T, T) {
    let speed = velocity.abs();
    let level = model.sliding(speed);
    let slide = model.release(deflection, velocity, level).share * (model.stiffness() * speed / level);
    let rate = velocity - slide * deflection;
    (rate, model.stiffness() * deflection + model.damping(velocity) * rate)
}

/// A step of bristles at a constant velocity.
#[derive(Clone, Copy, Debug)]
pub struct Bend<T> {
    /// Deflection at the start [rad].
    pub deflection: T,
    /// Deflection about which the release is linearised [rad]: that in the middle of the step if known, otherwise that
    /// at its start.
    pub probe: T,
    /// Velocity [rad/s].
    pub velocity: T,
    /// Duration [s].
    pub dt: T,
}

/// One step with the velocity held: the new deflection [rad] and the mean bristle torque [N m]; b·Ω is added outside.
///
/// With α(z)·z linear about the probe z_p and k = σ₀·|Ω|/g the bristles relax exponentially, so that the step is stable
/// for any stiffness and any `dt`, and follows the steep release of elasto-plastic bristles at any speed
/// (exponential Rosenbrock; Hochbruck & Ostermann, Acta Numerica 19 (2010) 209):
///
/// ```text
/// ż = Ω + k·z_p²·α′ − λ·z,   λ = k·(α + z_p·α′),   x = λ·dt
/// z⁺ = z + ż·dt·φ₁(x),   mean z = z + ż·dt·φ₂(x),   φ₁ = (1 − e^(−x))/x,   φ₂ = (1 − φ₁)/x
/// ```
#[inline(always)]
pub fn advance<T: Scalar>(model: &impl Bristle<T>, bend: Bend<T>) -> (T, T) {
    relax::<T, false>(model, bend, &Condition::reference())
}

/// As [`advance`], but of first order, for a predictor: φ₁ = 1/(1 + x) and φ₂ = φ₁/2 need no exponential and are
/// equally stable.
#[inline(always)]
pub fn predict<T: Scalar>(model: &impl Bristle<T>, bend: Bend<T>) -> (T, T) {
    relax::<T, true>(model, bend, &Condition::reference())
}

/// One step under a condition of the contact. Its strength multiplies the sliding level, and in proportion the
/// deflections at which the contact releases.
#[inline(always)]
pub(super) fn relax<T: Scalar, const PREDICTS: bool>(
    model: &impl Bristle<T>,
    bend: Bend<T>,
    condition: &Condition<T>,
) -> (T, T) {
    let Bend { deflection, probe, velocity, dt } = bend;
    let speed = velocity.abs();
    let level = model.sliding(speed);
    let release = model.release(probe * condition.per_strength, velocity, level);
    let level = level * condition.strength;
    // Independent of the release, so that the processor computes both at the same time.
    let quick = model.stiffness() * speed / level;
    let decay = (release.share + release.slope) * quick;
    let rate = velocity + release.slope * quick * probe - decay * deflection;
    let (phi1, phi2) = if PREDICTS { rational_phi(decay * dt) } else { phi(decay * dt) };
    let mean_rate = rate * phi1;
    let mean = deflection + rate * dt * phi2;
    let end = model.within_reach(level, deflection, deflection + mean_rate * dt);
    (end, model.stiffness() * mean + model.damping(velocity) * mean_rate)
}

/// φ₁ and φ₂ of −x for x ≥ 0.
#[inline(always)]
pub(super) fn phi<T: Scalar>(x: T) -> (T, T) {
    let one = T::of(1.0);
    // For small x the quotients cancel: there the series up to x⁴/6!. At x = 1/128 its error is 6e-15, that of the
    // quotients 2e-12.
    let small = x.lt(T::of(0.007_812_5));
    let mut series = T::of(1.0 / 720.0);
    for factorial in [120.0, 24.0, 6.0, 2.0] {
        series = T::of(1.0 / factorial) - x * series;
    }
    let inverse = one / small.select(one, x);
    let quotient = (one - (-x).exp()) * inverse;
    (small.select(one - x * series, quotient), small.select(series, (one - quotient) * inverse))
}

/// φ₁ and φ₂ of −x to first order.
#[inline(always)]
pub(super) fn rational_phi<T: Scalar>(x: T) -> (T, T) {
    let phi1 = T::of(1.0) / (T::of(1.0) + x);
    (phi1, T::of(0.5) * phi1)
}

/// Dahl friction: presliding with hysteresis, no Stribeck drop, no damping.
///
/// ```text
/// ż = Ω − σ₀·|Ω|·z/M_K,   M_R = σ₀·z + b·Ω
/// ```
///
/// P. Dahl (1968), exponent 1. Holds a constant load without creep, drifts under a vibrating one.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Dahl<T> {
    /// Sliding level.
    #[field(symbol = "M_K", unit = "N m", range = 1e-6..=200.0, default = 0.180)]
    pub kinetic_torque: T,
    /// Viscous torque per speed, caused by the lubricant.
    #[field(symbol = "b", unit = "N m s/rad", range = 0.0..=50.0, default = 2.0e-4)]
    pub viscous_friction: T,
    /// Stiffness of the bristles, the slope of the presliding loop at rest.
    #[field(symbol = "σ₀", unit = "N m/rad", range = 1e-3..=1e7, default = 300.0)]
    pub bristle_stiffness: T,
}

impl<T: Scalar> Bristle<T> for Dahl<T> {
    #[inline(always)]
    fn sliding(&self, _speed: T) -> T {
        self.kinetic_torque
    }

    #[inline(always)]
    fn release(&self, _deflection: T, _velocity: T, _level: T) -> Release<T> {
        Release::sliding()
    }

    #[inline(always)]
    fn damping(&self, _velocity: T) -> T {
        T::of(0.0)
    }

    #[inline(always)]
    fn stiffness(&self) -> T {
        self.bristle_stiffness
    }
}

/// Form in which the damping of the bristles fades with speed.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "shape")]
pub enum Fading<T> {
    /// σ₁·e^(−(Ω/v_c)²).
    Gaussian(DampingVelocity<T>),
    /// σ₁/(1 + (Ω/v_c)²).
    Rational(DampingVelocity<T>),
}

/// The velocity of [`Fading`].
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct DampingVelocity<T> {
    /// Speed at which the damping of the bristles has fallen to 1/e (Gaussian) or 1/2 (rational) of its value at rest.
    #[field(symbol = "v_c", unit = "rad/s", range = 1e-4..=1e3, default = 1.2)]
    pub velocity: T,
}

/// LuGre friction with the sliding curve of [`Stribeck`].
///
/// ```text
/// ż = Ω − σ₀·|Ω|·z/g(|Ω|),   M_R = σ₀·z + σ₁(Ω)·ż + b·Ω,   g = M_K + (M_S − M_K)·e^(−|Ω|/Ω_Strib)
/// ```
///
/// Canudas de Wit et al. (1995), equations (1) to (3). With constant σ₁ it is passive only for large b. With fading
/// σ₁(Ω) it is passive if v_c is small enough (Åström & Canudas de Wit 2008, property 4), which is checked. Drifts
/// under a vibrating load below breakaway; where that matters, use [`ElastoPlastic`].
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = LuGre::law)]
pub struct LuGre<T> {
    /// The curve at constant speed.
    pub sliding: Stribeck<T>,
    /// Stiffness of the bristles, the slope of the presliding loop at rest.
    #[field(symbol = "σ₀", unit = "N m/rad", range = 1e-3..=1e7, default = 300.0)]
    pub bristle_stiffness: T,
    /// Damping of the bristles at rest.
    #[field(symbol = "σ₁", unit = "N m s/rad", range = 0.0..=1e3, default = 0.85)]
    pub bristle_damping: T,
    /// Fading of the damping with speed.
    pub fading: Fading<T>,
}

impl<T: Scalar> Bristle<T> for LuGre<T> {
    #[inline(always)]
    fn sliding(&self, speed: T) -> T {
        self.sliding.level(speed)
    }

    #[inline(always)]
    fn release(&self, _deflection: T, _velocity: T, _level: T) -> Release<T> {
        Release::sliding()
    }

    #[inline(always)]
    fn damping(&self, velocity: T) -> T {
        match &self.fading {
            Fading::Gaussian(fading) => {
                let s = velocity / fading.velocity;
                self.bristle_damping * (-(s * s)).exp()
            }
            Fading::Rational(fading) => {
                let s = velocity / fading.velocity;
                self.bristle_damping / (T::of(1.0) + s * s)
            }
        }
    }

    #[inline(always)]
    fn stiffness(&self) -> T {
        self.bristle_stiffness
    }
}

impl<T: Scalar> LuGre<T> {
    /// Largest v_c [rad/s] for which the bristles are passive: σ₁(Ω)·|Ω| ≤ 4·min g at every speed, so
    /// v_c ≤ 4·√(2e)·min g/σ₁ for the Gaussian form and ≤ 8·min g/σ₁ for the rational one. Infinite without damping.
    pub fn passive_damping_velocity(&self) -> T {
        // 4·√(2e)
        const GAUSSIAN: f64 = 9.326_575_266_183_9;
        let factor = match self.fading {
            Fading::Gaussian(_) => GAUSSIAN,
            Fading::Rational(_) => 8.0,
        };
        T::of(factor) * self.sliding.smallest_level() / self.bristle_damping
    }

    fn law(&self) -> [Relation<T>; 1] {
        let (Fading::Gaussian(fading) | Fading::Rational(fading)) = self.fading;
        let remedy = "With a higher v_c the bristles are not passive: reduce v_c or the bristle damping.";
        [at_most("fading", fading.velocity, self.passive_damping_velocity(), remedy)]
    }
}

/// Elasto-plastic friction: LuGre with a purely elastic zone around each point of rest, hence without drift.
///
/// ```text
/// ż = Ω − α(z, Ω)·σ₀·|Ω|·z/g(|Ω|)
/// ```
///
/// α = 0 while the bristles recede or |z| ≤ z_ba, 1 from the steady deflection z_s = g/σ₀ on, half a sine between.
/// P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, IEEE TAC 47 (2002) 787. The elastic limit z_ba is a share of
/// M_S/σ₀, but never above 0.95·z_s: otherwise the load would slide at the wrong torque wherever g falls below it.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct ElastoPlastic<T> {
    /// The bristles and their sliding curve.
    pub lugre: LuGre<T>,
    /// Elastic limit as a share of the breakaway deflection M_S/σ₀.
    #[field(symbol = "z_ba·σ₀/M_S", unit = "1", range = 0.0..=0.95, default = 0.7)]
    pub elastic_fraction: T,
}

impl<T: Scalar> Bristle<T> for ElastoPlastic<T> {
    #[inline(always)]
    fn sliding(&self, speed: T) -> T {
        self.lugre.sliding(speed)
    }

    #[inline(always)]
    fn release(&self, deflection: T, velocity: T, level: T) -> Release<T> {
        // Compared as torques σ₀·z, which saves divisions.
        let steady = level;
        let elastic = (self.elastic_fraction * self.lugre.sliding.breakaway_torque).min(T::of(0.95) * steady);
        let size = self.lugre.bristle_stiffness * deflection.abs();
        // u runs from 0 at the elastic limit to 1 at the steady deflection. Half a sine over it,
        // α = ½ + ½·sin(π·(u − ½)) = sin²(π·u/2) = 4·s²·(1 − s²) and ∂α/∂u = 2·π·s·c·(1 − 2·s²), with s and c of π·u/4.
        let per_width = T::of(1.0) / (steady - elastic);
        let u = ((size - elastic) * per_width).clamp(T::of(0.0), T::of(1.0));
        let quarter = T::of(0.25 * PI) * u;
        let (s, c) = (sine(quarter), cosine(quarter));
        let square = s * s;
        let rising = T::of(4.0) * square * (T::of(1.0) - square);
        let steep = T::of(2.0 * PI) * (s * c) * (T::of(1.0) - T::of(2.0) * square) * (size * per_width);
        let (zero, one) = (T::of(0.0), T::of(1.0));
        let elastic_zone = (deflection * velocity).le(zero) | size.le(elastic);
        let sliding = size.ge(steady);
        let share = elastic_zone.select(zero, sliding.select(one, rising));
        let slope = elastic_zone.select(zero, sliding.select(zero, steep));
        Release { share, slope }
    }

    #[inline(always)]
    fn damping(&self, velocity: T) -> T {
        self.lugre.damping(velocity)
    }

    #[inline(always)]
    fn stiffness(&self) -> T {
        self.lugre.bristle_stiffness
    }

    /// No motion bends the bristles beyond the steady deflection or beyond their deflection at the start. A linearised
    /// release would, in a step longer than the elastic zone.
    #[inline(always)]
    fn within_reach(&self, level: T, start: T, end: T) -> T {
        let most = start.abs().max(level / self.lugre.bristle_stiffness);
        end.clamp(-most, most)
    }
}
