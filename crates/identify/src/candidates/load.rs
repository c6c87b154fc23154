//! Friction that grows with the transmitted force: gears and screws lose a share of what they carry.

use crate::balance::{Balance, Solved, Terms};
use stickslip_base::quantity::{Estimate, tied};

/// A share below which no mechanism is named.
const NEGLIGIBLE: f64 = 0.005;

/// μ in F = … + μ·|F|·sign q̇.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadFriction {
    /// Share of the drive force.
    pub share: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
}

impl LoadFriction {
    pub(super) fn sentence(&self) -> String {
        let half_width = 50.0 * (self.ci95[1] - self.ci95[0]);
        format!(
            "Friction grows with the transmitted force: {} of the drive force are lost in addition to Coulomb and viscous \
             friction, an efficiency of {}. model.toml does not contain this share.",
            tied(&Estimate::new(100.0 * self.share, "%").with_half_width(half_width)),
            tied(&Estimate::new(100.0 * (1.0 - self.share), "%").with_half_width(half_width)),
        )
    }
}

/// The share of a solved balance, if it is clearly above what is negligible, and below 1.
pub(super) fn found(solved: &Solved) -> Option<LoadFriction> {
    let index = solved.terms.body();
    let (share, ci95) = (*solved.fit.coefficients.get(index)?, *solved.fit.ci95.get(index)?);
    (solved.terms.load && ci95[0] > NEGLIGIBLE && share < 1.0).then_some(LoadFriction { share, ci95 })
}

/// Whether both halves of the recording state a clear share, by themselves, and the same.
pub(super) fn is_in_both_halves(balance: &Balance<'_>, terms: &Terms) -> bool {
    let halves = balance.halves().map(|half| balance.solve(terms, &half).ok().as_ref().and_then(found));
    let [Some(first), Some(second)] = halves else { return false };
    first.ci95[0] < second.ci95[1] && second.ci95[0] < first.ci95[1]
}
