//! Drift over the recording: friction falls while grease and bearings warm up.

use crate::balance::{Balance, Directions, Solved};
use crate::machine::Axis;
use crate::results::unit;
use crate::rigid::ASYMMETRIC;
use stickslip_base::quantity::{Estimate, tied};

/// A coefficient that differs between the halves of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// Its index in [`ASYMMETRIC`].
    pub index: usize,
    /// Its values in the halves.
    pub values: [f64; 2],
    /// Their 95 % intervals.
    pub halves: [[f64; 2]; 2],
}

impl Drift {
    /// The finding in a sentence; none without drift.
    pub(super) fn sentence(all: &[Drift], axis: Axis) -> Option<String> {
        let change = |drift: &Drift| {
            let name = ASYMMETRIC[drift.index];
            let number = |k: usize| {
                let [low, high] = drift.halves[k];
                tied(&Estimate::new(drift.values[k], unit(axis, name)).with_half_width(0.5 * (high - low)))
            };
            let name = match name.split_once('_') {
                Some((side, kind)) => format!("{kind} friction against {side} velocity"),
                None if axis == Axis::Rotary => "moment of inertia".into(),
                None => "moving mass".into(),
            };
            format!("{name} {} and {}", number(0), number(1))
        };
        let changes: Vec<String> = all.iter().map(change).collect();
        (!changes.is_empty()).then(|| {
            format!(
                "The halves of the recording differ: {}. Warm-up of the axis, or another load, is the usual cause. The \
                 intervals of these values contain both halves. Record again with the axis warm.",
                changes.join("; ")
            )
        })
    }
}

/// Coefficients of mass and friction whose halves differ by more than chance.
pub(super) fn drift(balance: &Balance<'_>, solved: &Solved) -> Vec<Drift> {
    let terms = solved.terms.with(solved.terms.timing.fixed());
    let halves = balance.halves().map(|half| balance.solve(&terms, &half));
    let [Ok(first), Ok(second)] = halves else { return Vec::new() };
    let place = |k: usize| match (solved.terms.directions, k) {
        (Directions::Only(-1), 1 | 2) => k + 2,
        _ => k,
    };
    let differs = |k: usize| {
        let halves = [first.fit.ci95[k], second.fit.ci95[k]];
        let [a, b] = halves.map(|[low, high]| 0.5 * (high - low));
        let values = [first.fit.coefficients[k], second.fit.coefficients[k]];
        // 3 instead of 2 standard errors: one in several coefficients differs by chance.
        let chance = 1.5 * a.hypot(b);
        ((values[0] - values[1]).abs() > chance && chance > 0.0).then_some(Drift { index: place(k), values, halves })
    };
    (0..solved.terms.body()).filter_map(differs).collect()
}
