//! The best Stribeck curve through points: the valleys of the sum of squares by variable projection, the last digits by
//! Levenberg-Marquardt.

use std::convert::Infallible;

use stickslip_core::friction::Stribeck;
use stickslip_core::scalar::{Dual, Scalar as _};

use super::nonlinear::{Stop, minimise};
use super::projection::{Parameters, Sample, bottom, cost, curve, valleys};

/// Ω_Strib of a fit, from the slowest and the fastest speed.
pub(super) fn bounds([slowest, fastest]: [f64; 2]) -> [f64; 2] {
    [slowest / 10.0, fastest * 3.0]
}

/// The best parameters of all.
pub(super) fn optimum(samples: &[Sample], bounds: [f64; 2]) -> Parameters<f64> {
    let starts = valleys(samples, bounds).into_iter().map(|valley| bottom(samples, valley));
    let polished = starts.map(|start| from_near(samples, start, bounds));
    let best = polished.min_by(|a, b| cost(*a, samples).total_cmp(&cost(*b, samples)));
    best.expect("there is always a valley")
}

/// The best parameters from a good start: parameters at 0 stay there, the Stribeck velocity stays within its bounds.
pub(super) fn from_near(samples: &[Sample], start: Parameters<f64>, bounds: [f64; 2]) -> Parameters<f64> {
    const FREE: [f64; 2] = [0.0, f64::INFINITY];
    let residual = |curve: &Stribeck<Dual<4>>, s: &Sample| {
        (Dual::of(s.torque) - curve.magnitude(Dual::of(s.speed))) * Dual::of(s.weight.sqrt())
    };
    let residuals = |parameters| {
        let curve = curve(parameters);
        Ok::<_, Infallible>(samples.iter().map(|s| residual(&curve, s)).collect())
    };
    let stop = Stop { step: 1e-12, fall: f64::NEG_INFINITY, evaluations: 100 };
    let Ok(minimum) = minimise(start, [FREE, FREE, bounds, FREE], stop, residuals);
    minimum.parameters
}
