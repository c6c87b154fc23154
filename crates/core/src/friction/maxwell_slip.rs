//! Generalised Maxwell slip: hysteresis with memory of every reversal. Reference: `tests/reference/maxwell_slip`.

use super::bristle::{phi, rational_phi};
use super::{Direction, ELEMENTS, Memory, Stribeck};
use crate::Fields;
use crate::fields::{Relation, at_most};
use crate::scalar::{Mask, Scalar};

/// Generalised Maxwell slip: four parallel springs that slip, with memory of every reversal.
///
/// Each spring is an element that slips at its share of one level, and the level lags behind the sliding curve:
///
/// ```text
/// M_R = Σ κ_i·z_i + b·Ω,   ż_i = Ω while κ_i·|z_i| < α_i·L, else slipping with κ_i·z_i = α_i·L·sign(Ω)
/// L̇ = C·(1 − L/s(|Ω|)),   s = M_K + (M_S − M_K)·e^(−|Ω|/Ω_Strib)
/// ```
///
/// V. Lampaert, F. Al-Bender, J. Swevers, Proc. PhysCon (2003); F. Al-Bender, V. Lampaert, J. Swevers, IEEE TAC 50
/// (2005) 1883. The elements are stops: small loops close within large ones, and a load below breakaway does not drift,
/// with or without vibration. The attraction C is a torque per time, as published, so that identified values can be
/// used directly; the level lags by s/C. In the published model each slipping element has its own lag and a sticking
/// element has none. Here the elements share one lag, also at rest, so that a reversal faster than the lag does not
/// reach the full breakaway peak. There is no bristle damping: within the elastic zone of the stiffest element only
/// viscous friction damps.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(law = MaxwellSlip::law)]
pub struct MaxwellSlip<T> {
    /// The curve at constant speed.
    pub sliding: Stribeck<T>,
    /// Rate at which the level approaches the curve.
    #[field(symbol = "C", unit = "N m/s", range = 1e-3..=1e6, default = 30.0)]
    pub attraction: T,
    /// Share of the first element in the level.
    #[field(symbol = "α₁", unit = "1", range = 0.0..=1.0, default = 0.25)]
    pub first_share: T,
    /// Share of the second element.
    #[field(symbol = "α₂", unit = "1", range = 0.0..=1.0, default = 0.25)]
    pub second_share: T,
    /// Share of the third element; the fourth has the rest.
    #[field(symbol = "α₃", unit = "1", range = 0.0..=1.0, default = 0.25)]
    pub third_share: T,
    /// Stiffness of the first element. The sum of all four is the slope of the presliding loop at a reversal.
    #[field(symbol = "κ₁", unit = "N m/rad", range = 1e-3..=1e7, default = 160.0)]
    pub first_stiffness: T,
    /// Stiffness of the second element.
    #[field(symbol = "κ₂", unit = "N m/rad", range = 1e-3..=1e7, default = 80.0)]
    pub second_stiffness: T,
    /// Stiffness of the third element.
    #[field(symbol = "κ₃", unit = "N m/rad", range = 1e-3..=1e7, default = 40.0)]
    pub third_stiffness: T,
    /// Stiffness of the fourth element.
    #[field(symbol = "κ₄", unit = "N m/rad", range = 1e-3..=1e7, default = 20.0)]
    pub fourth_stiffness: T,
}

/// A step of a Maxwell slip: held velocity [rad/s], factor of the level, duration [s].
#[derive(Clone, Copy)]
pub(super) struct Slip<T> {
    pub(super) velocity: T,
    pub(super) strength: T,
    pub(super) dt: T,
}

impl<T: Scalar> MaxwellSlip<T> {
    /// Share of each element in the level.
    #[inline(always)]
    pub fn shares(&self) -> [T; ELEMENTS] {
        let rest = T::of(1.0) - self.first_share - self.second_share - self.third_share;
        [self.first_share, self.second_share, self.third_share, rest]
    }

    /// Stiffness of each element [N m/rad].
    #[inline(always)]
    pub fn stiffnesses(&self) -> [T; ELEMENTS] {
        [self.first_stiffness, self.second_stiffness, self.third_stiffness, self.fourth_stiffness]
    }

    /// Sum of the stiffnesses of all elements [N m/rad].
    pub fn stiffness(&self) -> T {
        self.first_stiffness + self.second_stiffness + self.third_stiffness + self.fourth_stiffness
    }

    /// This model with another sum of the stiffnesses [N m/rad], in unchanged proportions.
    #[must_use]
    pub fn with_stiffness(&self, stiffness: T) -> Self {
        let ratio = stiffness / self.stiffness();
        MaxwellSlip {
            first_stiffness: ratio * self.first_stiffness,
            second_stiffness: ratio * self.second_stiffness,
            third_stiffness: ratio * self.third_stiffness,
            fourth_stiffness: ratio * self.fourth_stiffness,
            ..*self
        }
    }

    fn law(&self) -> [Relation<T>; 1] {
        let left = T::of(1.0) - self.first_share - self.second_share;
        let remedy = "The four shares sum to 1: reduce this one or the two before it.";
        [at_most("third_share", self.third_share, left, remedy)]
    }

    /// State of the contact after long sliding at a velocity [rad/s] with this factor of its level.
    #[inline(always)]
    pub(super) fn steady(&self, velocity: T, strength: T) -> Memory<T> {
        let level = self.sliding.level(velocity.abs());
        let (shares, stiffnesses) = (self.shares(), self.stiffnesses());
        let mut memory = Memory { lag: T::of(1.0) - level / self.sliding.breakaway_torque, ..Memory::default() };
        for i in 0..ELEMENTS {
            let deflection = velocity.sign() * (shares[i] * strength * level) / stiffnesses[i];
            memory.elements[i] = deflection;
            memory.deflection += shares[i] * deflection;
        }
        memory
    }

    /// One step: the new state, and the mean torque [N m] without the viscous part. Each element has the factor of its
    /// own direction, so that the torque has no jump at a reversal.
    ///
    /// The level is exact for a held velocity. Over the step the limit of each element changes linearly from its
    /// initial to its final value, and the element stretches until it reaches the limit. The torque is the exact mean
    /// of this motion: the work less the stored energy is the loss by slipping, which is never negative.
    #[inline(always)]
    pub(super) fn step<const PREDICTS: bool>(
        &self,
        mut memory: Memory<T>,
        direction: &Direction<T>,
        slip: Slip<T>,
    ) -> (Memory<T>, T) {
        let (zero, half, one) = (T::of(0.0), T::of(0.5), T::of(1.0));
        let Slip { velocity, strength, dt } = slip;
        let breakaway = self.sliding.breakaway_torque;
        let steady = self.sliding.level(velocity.abs());
        let lagging = breakaway * (one - memory.lag);
        let x = self.attraction * dt / steady;
        let (phi1, _) = if PREDICTS { rational_phi(x) } else { phi(x) };
        let fall = (lagging - steady) * (x * phi1);
        memory.lag += fall / breakaway;
        let (level, level_then) = (strength * lagging, strength * (lagging - fall));

        // A NaN as a limit would not limit. The term 0·level passes a non-finite level on to the result.
        let way = velocity * dt + zero * level;
        let (shares, stiffnesses) = (self.shares(), self.stiffnesses());
        let (mut torque, mut deflection) = (zero, zero);
        for i in 0..ELEMENTS {
            let compliance = shares[i] / stiffnesses[i];
            let (limit, last) = (compliance * level, compliance * level_then);
            let start = memory.elements[i].clamp(-limit, limit);
            let free = start + way;
            let end = free.clamp(-last, last);
            let (slid, side) = ((free - end).abs(), (free - end).sign());
            let slips = slid.gt(zero);
            // Time at which the limit is reached, as a share of the step, and the deflection there.
            let gap = limit - side * start;
            let when = slips.select(gap / slips.select(gap + slid, one), one);
            let met = slips.select(side * (limit + (last - limit) * when), free);
            let mean = half * (when * start + met + (one - when) * end);
            torque += direction.factor(half * (start + end)) * (stiffnesses[i] * mean);
            memory.elements[i] = end;
            deflection += shares[i] * end;
        }
        memory.deflection = deflection;
        (memory, torque)
    }
}
