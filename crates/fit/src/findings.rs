//! Gaps of a Stribeck fit: uncertain parameters, their cause and the missing measurement.

use std::fmt;

use super::StribeckDrop;
use super::stribeck::StribeckFit;
use stickslip_base::quantity::rough;

/// Relative half-width of a 95 % interval above which a parameter counts as uncertain.
pub const HARDLY_KNOWN: f64 = 0.5;
/// The slowest speed, as a share of the Stribeck velocity, above which the breakaway torque is an extrapolation: a
/// fifth of the drop is missing there.
const FAR_FROM_REST: f64 = 0.25;
/// Share of the friction at the fastest speed below which the viscous part is lost among the rest.
const SIGNIFICANT_LACK: f64 = 0.02;

/// A gap of the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// No significant drop from breakaway to sliding: M_S and Ω_Strib are only valid as parts of the curve.
    NoStribeckEffect {
        /// The verdict.
        drop: StribeckDrop,
        /// The slowest measured speed [rad/s].
        slowest: f64,
    },
    /// The Stribeck velocity is uncertain.
    StribeckVelocity {
        /// Relative half-width of its interval.
        relative: f64,
        /// Its value [rad/s].
        velocity: f64,
        /// Range of speeds for more points [rad/s].
        add: [f64; 2],
    },
    /// The breakaway torque is outside the measured speeds.
    BreakawayExtrapolated {
        /// Slowest speed over Stribeck velocity.
        ratio: f64,
        /// Upper limit of the speeds for more points [rad/s].
        below: f64,
    },
    /// The viscous friction is uncertain.
    ViscousFriction {
        /// Relative half-width of its interval; infinite at 0.
        relative: f64,
        /// The fastest measured speed [rad/s].
        fastest: f64,
    },
    /// The scatter about the curve is more than noise: no curve of this form passes through the points.
    LackOfFit {
        /// Its standard deviation as a share of the largest friction.
        relative: f64,
    },
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The width of an interval ten times as wide as the value is not useful.
        let percent = |share: f64| {
            if share <= 10.0 { format!("±{:.0} %", 100.0 * share) } else { "no useful precision".into() }
        };
        match *self {
            Finding::NoStribeckEffect { drop: StribeckDrop::Absent { .. }, slowest } => write!(
                f,
                "There is no Stribeck effect in this data: friction does not fall with speed. If one is expected, add \
                 speeds below {} rad/s.",
                rough(slowest)
            ),
            Finding::NoStribeckEffect { slowest, .. } => write!(
                f,
                "No Stribeck effect is shown by this data: Coulomb and viscous friction explain it as well. Add speeds \
                 below {} rad/s, or repeat the slow ones.",
                rough(slowest)
            ),
            Finding::StribeckVelocity { relative, velocity, add: [low, high] } => write!(
                f,
                "The Stribeck velocity of {} rad/s is uncertain ({}): add speeds between {} and {} rad/s.",
                rough(velocity),
                percent(relative),
                rough(low),
                rough(high)
            ),
            Finding::BreakawayExtrapolated { ratio, below } => write!(
                f,
                "The breakaway torque is extrapolated: the slowest point is at {ratio:.2}·Ω_Strib. Add speeds below \
                 {} rad/s, or measure the breakaway from rest.",
                rough(below)
            ),
            Finding::ViscousFriction { relative, fastest } => write!(
                f,
                "The viscous friction is uncertain ({}): add speeds above {} rad/s.",
                percent(relative),
                rough(fastest)
            ),
            Finding::LackOfFit { relative } => write!(
                f,
                "The points deviate by {:.1} % of the friction from any curve of this form, which is more than their noise: \
                 fit the directions separately, or use the curve as an average.",
                100.0 * relative
            ),
        }
    }
}

impl StribeckFit {
    /// Gaps of the data, the most important first; empty if all parameters are well determined.
    pub fn findings(&self) -> Vec<Finding> {
        let mut findings = Vec::new();
        let [slowest, fastest] = self.speeds;
        let velocity = self.parameters[2];
        let relative = |i: usize| {
            let width = 0.5 * (self.ci95[i][1] - self.ci95[i][0]) / self.parameters[i];
            if width.is_nan() { f64::INFINITY } else { width }
        };
        if self.drop.is_identified() {
            if relative(2) > HARDLY_KNOWN {
                let add = [0.3 * velocity, 3.0 * velocity];
                findings.push(Finding::StribeckVelocity { relative: relative(2), velocity, add });
            }
            if slowest > FAR_FROM_REST * velocity {
                let below = FAR_FROM_REST * velocity;
                findings.push(Finding::BreakawayExtrapolated { ratio: slowest / velocity, below });
            }
        } else {
            findings.push(Finding::NoStribeckEffect { drop: self.drop, slowest });
        }
        if relative(3) > HARDLY_KNOWN {
            findings.push(Finding::ViscousFriction { relative: relative(3), fastest });
        }
        let largest = [slowest, fastest].map(|speed| self.curve().magnitude(speed)).into_iter().fold(0.0, f64::max);
        if self.lack_of_fit > SIGNIFICANT_LACK * largest {
            findings.push(Finding::LackOfFit { relative: self.lack_of_fit / largest });
        }
        findings
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::synthetic;
    use super::super::{CurvePoint, StribeckPlan, Uncertainty, fit_stribeck};
    use super::*;

    fn fitted(points: &[CurvePoint]) -> StribeckFit {
        fit_stribeck(points, &StribeckPlan { uncertainty: Uncertainty::Extra, ..StribeckPlan::default() }).unwrap()
    }

    fn within(points: Vec<CurvePoint>, low: f64, high: f64) -> Vec<CurvePoint> {
        points.into_iter().filter(|p| (low..=high).contains(&p.velocity)).collect()
    }

    fn assert_finding(fit: &StribeckFit, start: &str, remedy: &str) {
        let findings = fit.findings();
        let finding = findings.iter().map(ToString::to_string).find(|text| text.starts_with(start));
        assert!(finding.as_ref().is_some_and(|text| text.contains(remedy)), "{start}: {findings:?}");
    }

    #[test]
    fn a_complete_curve_has_no_findings() {
        assert_eq!(fitted(&synthetic([0.3, 0.18, 3.0, 2e-3], 5e-4, 1)).findings(), []);
    }

    #[test]
    fn each_gap_is_reported_with_its_remedy() {
        assert_finding(
            &fitted(&synthetic([0.18, 0.2, 3.0, 2e-3], 5e-4, 1)),
            "There is no Stribeck effect",
            "add speeds below 0.10 rad/s",
        );
        assert_finding(
            &fitted(&synthetic([0.1803, 0.18, 3.0, 2e-3], 5e-4, 4)),
            "No Stribeck effect is shown",
            "repeat the slow ones",
        );
        let slow = within(synthetic([0.3, 0.18, 3.0, 2e-4], 2e-3, 2), 0.0, 15.0);
        assert_finding(&fitted(&slow), "The viscous friction is uncertain", "add speeds above 14 rad/s");
        let fast = within(synthetic([0.3, 0.18, 3.0, 2e-3], 1e-4, 3), 1.0, 50.0);
        assert_finding(
            &fitted(&fast),
            "The breakaway torque is extrapolated: the slowest point is at 0.",
            "Add speeds below 0.7",
        );
        let mut sparse = synthetic([0.3, 0.18, 3.0, 2e-3], 1.5e-2, 3);
        sparse.retain(|p| p.velocity < 0.2 || p.velocity > 2.0);
        assert_finding(&fitted(&sparse), "The Stribeck velocity of", "add speeds between");
    }

    #[test]
    fn points_off_any_curve_give_a_lack_of_fit_and_wider_intervals() {
        let mut both = synthetic([0.3, 0.18, 3.0, 2e-3], 5e-4, 1);
        let narrow = fitted(&both);
        let weaker = synthetic([0.27, 0.16, 3.0, 2e-3], 5e-4, 2);
        both.extend(weaker.iter().map(|p| CurvePoint { velocity: -p.velocity, torque: -p.torque, ..*p }));
        let fit = fitted(&both);
        assert_finding(&fit, "The points deviate", "fit the directions separately");
        // Half the difference between the directions, 15 mN m at rest and 10 mN m sliding.
        assert!((8e-3..17e-3).contains(&fit.lack_of_fit), "{}", fit.lack_of_fit);
        assert!(fit.standard_errors[0] > 3.0 * narrow.standard_errors[0]);
        assert_eq!(narrow.lack_of_fit, 0.0);
    }
}
