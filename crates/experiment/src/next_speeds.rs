//! The next speeds: the information of more plateaus, before they are measured.
//!
//! The information of a fit is the inverse of its covariance; a plateau at speed Ω with standard error s adds
//! g·gᵀ/s², where g is the curve's gradient there. The best addition makes the determinant of the information largest
//! (D-optimal, all parameters) or the variance of one parameter smallest (c-optimal); see Atkinson, Donev, Tobias,
//! *Optimum Experimental Designs, with SAS* (2007), chapters 10 and 11.

use nalgebra::{Matrix4, Vector4};

use stickslip_fit::StribeckFit;

/// Purpose of the new plateaus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// All four parameters.
    All,
    /// One parameter: 0 M_S, 1 M_K, 2 Ω_Strib, 3 b.
    Parameter(usize),
}

/// New speeds and their expected effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Addition {
    /// Speeds in the order of their worth [rad/s]; a speed may occur more than once.
    pub speeds: Vec<f64>,
    /// Width of each parameter's interval afterwards, over the present width.
    pub shrinks_to: [f64; 4],
}

/// The best `count` plateaus to add within `range` [rad/s], each with the standard error [N m] of a plateau. Empty if
/// the fit has no finite covariance: then the data lack a speed regime, which [`StribeckFit::findings`] names.
pub fn next_speeds(fit: &StribeckFit, range: [f64; 2], standard_error: f64, count: usize, goal: Goal) -> Addition {
    const CANDIDATES: usize = 121;
    let old = Matrix4::from_fn(|i, j| fit.covariance[i][j]);
    let mut covariance = old;
    let mut speeds = Vec::new();
    if !old.iter().all(|c| c.is_finite()) {
        return Addition { speeds, shrinks_to: [1.0; 4] };
    }
    let ratio = libm::log(range[1] / range[0]);
    let candidate = |k: usize| range[0] * libm::exp(ratio * k as f64 / (CANDIDATES - 1) as f64);
    for _ in 0..count {
        // Rank-one update (Sherman and Morrison): the covariance loses (C·g)(C·g)ᵀ/(s² + gᵀ·C·g).
        let gain = |speed: f64| {
            let gradient = Vector4::from(fit.gradient(speed));
            let moved = covariance * gradient;
            let predicted = gradient.dot(&moved);
            let worth = match goal {
                Goal::All => predicted,
                Goal::Parameter(i) => moved[i] * moved[i] / (standard_error * standard_error + predicted),
            };
            (worth, moved, predicted)
        };
        let best = (0..CANDIDATES).map(candidate).max_by(|a, b| gain(*a).0.total_cmp(&gain(*b).0));
        let Some(speed) = best else { break };
        let (_, moved, predicted) = gain(speed);
        covariance -= moved * moved.transpose() / (standard_error * standard_error + predicted);
        speeds.push(speed);
    }
    Addition { speeds, shrinks_to: std::array::from_fn(|i| (covariance[(i, i)] / old[(i, i)]).sqrt()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::noise::Normals;
    use stickslip_fit::{CurvePoint, StribeckPlan, Uncertainty, fit_stribeck};

    const ERROR: f64 = 5e-4;

    fn fitted(speeds: &[f64]) -> StribeckFit {
        let curve = stickslip_core::friction::Stribeck {
            breakaway_torque: 0.06,
            kinetic_torque: 0.04,
            stribeck_velocity: 2.0,
            ..Default::default()
        };
        let normals = Normals::new(3);
        let points: Vec<_> = speeds
            .iter()
            .enumerate()
            .map(|(k, &velocity)| CurvePoint {
                velocity,
                torque: curve.magnitude(velocity) + ERROR * normals.pair(0, k as u64)[0],
                standard_error: ERROR,
            })
            .collect();
        fit_stribeck(&points, &StribeckPlan { uncertainty: Uncertainty::Absolute, ..StribeckPlan::default() }).unwrap()
    }

    const SPEEDS: [f64; 9] = [0.8, 1.2, 1.8, 2.7, 4.0, 6.0, 9.0, 13.0, 20.0];

    #[test]
    fn each_parameter_gets_the_speeds_that_determine_it() {
        let fit = fitted(&SPEEDS);
        let best = |i| next_speeds(&fit, [0.05, 50.0], ERROR, 1, Goal::Parameter(i)).speeds[0];
        // M_S has most effect at rest, b at the highest speed.
        assert_eq!(best(0), 0.05);
        assert!((best(3) / 50.0 - 1.0).abs() < 1e-12, "{}", best(3));
        let all = next_speeds(&fit, [0.05, 50.0], ERROR, 4, Goal::All);
        assert!(all.speeds.iter().any(|s| *s < 0.1) && all.speeds.iter().any(|s| *s > 40.0), "{:?}", all.speeds);
        assert!(all.shrinks_to.iter().all(|share| *share < 1.0));
    }

    #[test]
    fn the_predicted_width_of_the_interval_is_reached() {
        let fit = fitted(&SPEEDS);
        let addition = next_speeds(&fit, [0.05, 50.0], ERROR, 3, Goal::Parameter(0));
        let more: Vec<f64> = SPEEDS.iter().chain(&addition.speeds).copied().collect();
        let after = fitted(&more);
        for i in 0..4 {
            let measured = after.standard_errors[i] / fit.standard_errors[i];
            // The gradient moves with the parameters, by a few tenths of their errors here.
            assert!(
                (measured / addition.shrinks_to[i] - 1.0).abs() < 0.25,
                "{i}: {measured} for {}",
                addition.shrinks_to[i]
            );
        }
    }

    #[test]
    fn a_fit_without_covariance_gets_no_advice() {
        let fit = fitted(&[1.0; 6]);
        assert!(next_speeds(&fit, [0.05, 50.0], ERROR, 3, Goal::All).speeds.is_empty());
    }
}
