//! The identified parameters for reports, with published ones.

use crate::machine::{Axis, Machine};
use stickslip_base::Summary;
use stickslip_base::quantity::Estimate;

/// A parameter for reports.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterLine {
    /// Name.
    pub name: &'static str,
    /// Value with its interval.
    pub identified: Estimate,
    /// Published value in the machine file.
    pub published: Option<Estimate>,
}

/// Names for reports, names of results, and names in the machine file's `published.asymmetric`.
const DIRECTIONS: [(&str, &str, &str); 9] = [
    ("moving mass M", "inertia.mass", "mass"),
    ("Coulomb friction, positive velocity", "friction.positive.coulomb", "positive_coulomb"),
    ("viscous friction, positive velocity", "friction.positive.viscous", "positive_viscous"),
    ("breakaway friction, positive velocity", "friction.positive.breakaway", "positive_breakaway"),
    ("Stribeck velocity, positive", "friction.positive.stribeck_velocity", "positive_stribeck_velocity"),
    ("Coulomb friction, negative velocity", "friction.negative.coulomb", "negative_coulomb"),
    ("viscous friction, negative velocity", "friction.negative.viscous", "negative_viscous"),
    ("breakaway friction, negative velocity", "friction.negative.breakaway", "negative_breakaway"),
    ("Stribeck velocity, negative", "friction.negative.stribeck_velocity", "negative_stribeck_velocity"),
];

/// The same for `published.symmetric`.
const ALIKE: [(&str, &str, &str); 4] = [
    ("moving mass M", "symmetric.mass", "mass"),
    ("Coulomb friction", "symmetric.coulomb", "coulomb"),
    ("viscous friction", "symmetric.viscous", "viscous"),
    ("offset", "friction.offset", "offset"),
];

/// The best model's, in the order of its equations; only those fitted in the closed loop.
pub(super) const BEST: [(&str, &str, &str); 12] = [
    ("moving mass M", "closed_loop.mass", ""),
    ("friction at rest, positive velocity", "closed_loop.positive.breakaway", ""),
    ("Coulomb friction, positive velocity", "closed_loop.positive.coulomb", ""),
    ("transition from rest, positive velocity", "closed_loop.positive.stribeck_velocity", ""),
    ("viscous friction, positive velocity", "closed_loop.positive.viscous", ""),
    ("friction at rest, negative velocity", "closed_loop.negative.breakaway", ""),
    ("Coulomb friction, negative velocity", "closed_loop.negative.coulomb", ""),
    ("transition from rest, negative velocity", "closed_loop.negative.stribeck_velocity", ""),
    ("viscous friction, negative velocity", "closed_loop.negative.viscous", ""),
    ("time constant of the drive", "closed_loop.lag", ""),
    ("bristle stiffness σ₀", "closed_loop.bristle_stiffness", ""),
    ("bristle damping σ₁", "closed_loop.bristle_damping", ""),
];

/// The parameters of both least squares, a friction for each direction and one for both, with published ones.
pub fn parameter_lines(summary: &Summary, machine: &Machine) -> [Vec<ParameterLine>; 2] {
    [lines(&DIRECTIONS, "asymmetric", summary, machine), lines(&ALIKE, "symmetric", summary, machine)]
}

pub(super) fn lines(
    names: &[(&'static str, &str, &str)],
    table: &str,
    summary: &Summary,
    machine: &Machine,
) -> Vec<ParameterLine> {
    let published = |name: &str, unit: &str| {
        let numbers = machine.published.get(table)?.get(name)?;
        let estimate = Estimate::new(*numbers.first()?, unit);
        Some(match numbers.get(1) {
            // Standard deviations are published, intervals of 95 % are shown.
            Some(deviation) => estimate.with_half_width(1.96 * deviation),
            None => estimate,
        })
    };
    let line = |&(name, result, key): &(&'static str, &str, &str)| {
        let identified = summary.estimate(result)?;
        let name = if name == "moving mass M" && machine.axis == Axis::Rotary { "moment of inertia J" } else { name };
        Some(ParameterLine { name, published: published(key, &identified.unit), identified })
    };
    names.iter().filter_map(line).collect()
}
