//! Play between motor and screw.

use crate::Fields;
use crate::drive::TwoMass;
use crate::scalar::{Mask, Scalar};

/// Whether there is play between motor and screw.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
#[fields(tag = "kind")]
pub enum Backlash<T> {
    /// None: a tight coupling and a preloaded nut.
    Nothing,
    /// A gap.
    Gap(Gap<T>),
}

/// A gap of coupling or nut: within it neither side moves the other, and flanks that touch push but never pull.
///
/// ```text
/// M_C = max(0, c·(δ − β) + d·δ̇) for δ > β,   min(0, c·(δ + β) + d·δ̇) for δ < −β,   otherwise 0
/// ```
///
/// Nordin & Gutman: Controlling mechanical systems with backlash (Automatica 38, 2002), the dead zone with damping in
/// contact alone.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct Gap<T> {
    /// Half of the gap, from its middle to a flank.
    #[field(symbol = "β", unit = "rad", range = 0.0..=5e-3, default = 1e-3)]
    pub half_width: T,
}

impl<T: Scalar> Backlash<T> {
    /// Missing torque of the coupling relative to a tight one [N m], for its twist [rad] and the velocity of the twist
    /// [rad/s].
    #[inline(always)]
    pub(super) fn lost(&self, drive: &TwoMass<T>, twist: T, slip: T) -> T {
        match self {
            Backlash::Nothing => T::of(0.0),
            Backlash::Gap(gap) => {
                let tight = drive.coupling_stiffness * twist + drive.coupling_damping * slip;
                let (zero, way) = (T::of(0.0), drive.coupling_stiffness * gap.half_width);
                let above = twist.gt(gap.half_width).select((tight - way).max(zero), zero);
                let below = twist.lt(-gap.half_width).select((tight + way).min(zero), zero);
                tight - above - below
            }
        }
    }
}

#[cfg(test)]
mod tests;
