//! Verdict on the drop of a friction curve from breakaway to sliding: significant or an artefact of the fit.

use std::fmt;

use super::projection::{Parameters, Sample, cost};
use super::{f_test, student_t95};
use stickslip_base::quantity::rough;

/// Verdict on M_S > M_K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StribeckDrop {
    /// M_S − M_K > 0, significant [N m].
    Identified {
        /// M_S − M_K.
        drop: f64,
        /// Its 95 % interval.
        ci95: [f64; 2],
    },
    /// The curve rises from rest: M_S ≤ M_K.
    Absent {
        /// M_S [N m].
        breakaway: f64,
    },
    /// A drop fits, but so does Coulomb and viscous friction alone.
    Insignificant {
        /// M_S − M_K [N m].
        drop: f64,
        /// Probability of a gain this large without any Stribeck effect; the limit is [`SIGNIFICANCE`].
        probability: f64,
    },
    /// The drop is outside the measured speeds.
    OutsideSpeeds {
        /// Ω_Strib [rad/s].
        stribeck_velocity: f64,
        /// The slowest two measured speeds [rad/s].
        slowest: [f64; 2],
    },
}

/// Significance level of a drop. The Stribeck velocity has no value where there is no drop, and the search over it
/// finds something in any noise, which makes the F test lenient. The second condition, that the drop is larger than its
/// interval, compensates for it: of 600 simulated curves without a drop 2 gave a drop
/// (`noise_is_seldom_taken_for_a_drop…`).
pub const SIGNIFICANCE: f64 = 0.05;

impl StribeckDrop {
    /// Whether the data show M_S > M_K.
    pub fn is_identified(&self) -> bool {
        matches!(self, StribeckDrop::Identified { .. })
    }
}

impl fmt::Display for StribeckDrop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            StribeckDrop::Identified { drop, ci95: [low, high] } => {
                write!(f, "F_S − F_K = {drop:.3} ({low:.3} … {high:.3}): a Stribeck drop")
            }
            StribeckDrop::Absent { breakaway } => {
                write!(f, "F_S < F_K: no Stribeck drop in this data, the curve rises from {breakaway:.3} at rest")
            }
            StribeckDrop::Insignificant { drop, probability } => write!(
                f,
                "F_S − F_K = {drop:.3} may be chance (probability {probability:.3}, limit {SIGNIFICANCE}): no Stribeck \
                 drop is identifiable; repeat the slow speeds"
            ),
            StribeckDrop::OutsideSpeeds { stribeck_velocity, slowest: [first, second] } => write!(
                f,
                "the Stribeck velocity {} is not covered by the slowest speeds {} and {}: no \
                 Stribeck drop is identifiable; measure slower",
                rough(stribeck_velocity),
                rough(first),
                rough(second)
            ),
        }
    }
}

/// Checks in the order of importance for a user.
pub(super) fn judge(parameters: Parameters<f64>, covariance: &[[f64; 4]; 4], samples: &[Sample]) -> StribeckDrop {
    let [breakaway, kinetic, stribeck_velocity, _] = parameters;
    if breakaway <= kinetic {
        return StribeckDrop::Absent { breakaway };
    }
    let mut speeds: Vec<f64> = samples.iter().map(|s| s.speed).collect();
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    let slowest = [speeds[0], speeds[1.min(speeds.len() - 1)]];
    // With one speed within the drop, two parameters would depend on one number.
    if stribeck_velocity < 0.5 * slowest[1] {
        return StribeckDrop::OutsideSpeeds { stribeck_velocity, slowest };
    }
    let degrees_of_freedom = (samples.len() - 4) as f64;
    let drop = breakaway - kinetic;
    let probability = f_test(without_drop(samples), cost(parameters, samples), 2.0, degrees_of_freedom);
    let variance = covariance[0][0] + covariance[1][1] - 2.0 * covariance[0][1];
    let half_width = student_t95(degrees_of_freedom) * variance.sqrt();
    // An infinite or undefined variance gives no drop.
    if probability < SIGNIFICANCE && half_width < drop {
        return StribeckDrop::Identified { drop, ci95: [drop - half_width, drop + half_width] };
    }
    StribeckDrop::Insignificant { drop, probability }
}

/// Weighted sum of squares of Coulomb and viscous friction.
fn without_drop(samples: &[Sample]) -> f64 {
    let sum = |f: &dyn Fn(&Sample) -> f64| samples.iter().map(|s| s.weight * f(s)).sum::<f64>();
    let total = sum(&|_| 1.0);
    let (speed, torque) = (sum(&|s| s.speed) / total, sum(&|s| s.torque) / total);
    let slope = sum(&|s| (s.speed - speed) * (s.torque - torque)) / sum(&|s| (s.speed - speed).powi(2));
    sum(&|s| (s.torque - torque - slope * (s.speed - speed)).powi(2))
}
