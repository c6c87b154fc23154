//! Limits of a recording, their causes and remedies.

use super::results::unit;
use super::{CLOSED_LOOP, Identification};
use stickslip_base::quantity::{Estimate, number, tied};
use stickslip_fit::{StribeckDrop, StribeckFit};

impl Identification {
    /// Quantities that no analysis of this recording can determine, with cause and remedy; a sentence or two each.
    pub fn limits(&self) -> Vec<String> {
        let unit = |name| unit(self.axis, name);
        let sides = [("positive", 1), ("negative", -1)].into_iter().zip(&self.stribeck);
        let moved = |(_, sign): (&str, i8)| self.findings.only.is_none_or(|only| only == sign);
        let sides = sides.filter(|(side, _)| moved(*side)).map(|((side, _), fit)| (side, fit));
        let verdict = |(side, fit): (_, &Option<_>)| stribeck(side, fit.as_ref(), unit("breakaway"), unit("velocity"));
        let mut limits: Vec<String> = sides.filter_map(verdict).collect();
        limits.push(format!(
            "Friction below {}: the axis reverses so fast that the low-pass mixes both directions there. Slow strokes \
             would determine it.",
            tied(&Estimate::new(self.curve.slowest, unit("velocity")))
        ));
        if self.findings.only.is_none() {
            limits.push(self.constant_force());
        }
        let index = CLOSED_LOOP.iter().position(|name| *name == "bristle_stiffness").unwrap_or(usize::MAX);
        let bristles = self.best().refined.as_ref().and_then(|fit| fit.ci95.get(index).zip(fit.parameters.get(index)));
        if let Some(([low, high], stiffness)) = bristles.filter(|([low, high], _)| *high > 2.0 * low) {
            limits.push(format!(
                "The stiffness of presliding: {} is uncertain by a factor of {}. Strokes of some micrometres \
                 around rest would determine it.",
                tied(&Estimate::new(*stiffness, unit("stiffness"))),
                number((high / low).sqrt(), 1)
            ));
        }
        limits.extend(self.signals.notes.iter().cloned());
        limits
    }

    /// Possible causes of a constant force.
    fn constant_force(&self) -> String {
        let force = |value| tied(&Estimate::new(value, unit(self.axis, "offset")));
        let offset = force(self.symmetric.fit.coefficients[3]);
        match (self.lift, self.weight()) {
            (None, _) => "Whether the directions differ by friction or by a constant force: a weight, a tilt or an \
                          offset of the drive looks the same in motion. The offset given here holds if Coulomb \
                          friction is alike both ways."
                .into(),
            (Some(_), Some([weight, rest])) => format!(
                "Where {} come from that are left of the constant force of {offset} after the weight of {}: an offset \
                 of the drive, a counterweight, or Coulomb friction that is not alike both ways.",
                force(rest),
                force(weight)
            ),
            (Some(_), None) => format!(
                "Which part of the constant force of {offset} is weight. State lifted_mass in the machine file if it is \
                 known; Coulomb friction is assumed to be equal in both directions on average."
            ),
        }
    }
}

/// The verdict on a Stribeck drop; none where there is one.
fn stribeck(side: &str, fit: Option<&StribeckFit>, force: &str, velocity: &str) -> Option<String> {
    let why = match fit.map(|fit| fit.drop) {
        None => "the friction curve has fewer than five speeds. Record more of them.".to_owned(),
        Some(StribeckDrop::Identified { .. }) => return None,
        Some(StribeckDrop::Absent { breakaway }) => format!(
            "no Stribeck drop in this data; the curve rises from {} at rest.",
            tied(&Estimate::new(breakaway, force))
        ),
        Some(StribeckDrop::Insignificant { drop, probability }) => format!(
            "a drop of {} may be chance, with probability {}. Repeat the slow speeds.",
            tied(&Estimate::new(drop, force)),
            percent(probability)
        ),
        Some(StribeckDrop::OutsideSpeeds { stribeck_velocity, slowest: [slowest, _] }) => format!(
            "a drop would be at {}, but the slowest speed is {}. Measure at slower speeds.",
            tied(&Estimate::new(stribeck_velocity, velocity)),
            tied(&Estimate::new(slowest, velocity))
        ),
    };
    Some(format!("Breakaway and Stribeck velocity against {side} velocity: {why}"))
}

/// A share with two decimals.
pub(super) fn percent(share: f64) -> String {
    format!("{}\u{a0}%", number(100.0 * share, 2))
}

#[cfg(test)]
mod tests {
    use super::super::tests::found;
    use super::*;

    #[test]
    fn every_verdict_but_a_drop_has_a_reason() {
        let limit_of = |drop| {
            let mut fit = found().stribeck[0].clone().unwrap();
            fit.drop = drop;
            stribeck("positive", Some(&fit), "N", "m/s")
        };
        assert_eq!(limit_of(StribeckDrop::Identified { drop: 1.0, ci95: [0.5, 1.5] }), None);
        for (drop, why) in [
            (StribeckDrop::Absent { breakaway: 15.47 }, "rises from 15.47 N"),
            (StribeckDrop::Insignificant { drop: 1.0, probability: 0.3 }, "a drop of 1.000 N may be chance"),
            (
                StribeckDrop::OutsideSpeeds { stribeck_velocity: 0.02, slowest: [0.05, 0.1] },
                "slowest speed is 0.05000 m/s",
            ),
        ] {
            let text = limit_of(drop).unwrap().replace('\u{a0}', " ");
            assert!(text.contains(why), "{text}");
        }
        assert!(stribeck("negative", None, "N", "m/s").unwrap().contains("fewer than five speeds"));
    }
}
