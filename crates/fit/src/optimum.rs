//! The best Stribeck curve through points, however many they are.
//!
//! Many points are taken together in bins of the speed first: the valleys of the sum of squares are found on some seventy
//! means, their bottoms on some hundreds, and all points are gone over once or twice at the end.

use std::convert::Infallible;

use stickslip_core::friction::Stribeck;
use stickslip_core::scalar::{Dual, Scalar as _};

use super::descent::{Minimum, descend, normal_at};
use super::nonlinear::{Stop, minimise};
use super::points::{Points, Sample};
use super::projection::{Parameters, bottom, cost, curve, valleys};
use stickslip_base::Error;

/// Points from which on means are taken first.
const MANY: usize = 512;
/// What may be left where the last steps run over few points: nothing but rounding.
const EXACT: f64 = 1e-13;
/// Where they run over many: a hundred-millionth of a parameter, thousands of times below what noise leaves of so many.
const CLOSE: f64 = 1e-8;

/// The best curve and its covariance, of [`stribeck_optimum`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StribeckOptimum {
    /// M_S [N m], M_K [N m], Ω_Strib [rad/s], b [N m s/rad], none negative.
    pub parameters: [f64; 4],
    /// Their covariance where the scatter of the points sets the scale; infinite where the points leave one open.
    pub covariance: [[f64; 4]; 4],
    /// Root mean square of what is left, weighted [N m].
    pub rms: f64,
}

/// The best curve through points by their speeds [rad/s] and torques of the motion's sign [N m], and nothing else: no
/// verdicts, no intervals, no outliers, for who fits thousands of curves. [`fit_stribeck`](super::fit_stribeck) comes to
/// the same curve. Without weights all points count alike.
///
/// # Errors
/// Fewer than five points; columns of different lengths; a speed or a weight that is not positive, or a torque that is no
/// number.
pub fn stribeck_optimum(speeds: &[f64], torques: &[f64], weights: Option<&[f64]>) -> Result<StribeckOptimum, Error> {
    let count = speeds.len();
    if count < 5 {
        let remedy = "Four parameters and their errors need five speeds; measure more.";
        return Err(Error::TooFew { what: "points of the friction curve", found: count, needed: 5, remedy });
    }
    let lengths = [torques.len(), weights.map_or(count, <[f64]>::len)];
    if let Some(found) = lengths.into_iter().find(|length| *length != count) {
        return Err(Error::TooFew { what: "torques or weights", found, needed: count, remedy: "One for each speed." });
    }
    let points = Points::of(speeds, torques, weights);
    let plain = &points.plain;
    let summed = plain.one + plain.vv + plain.torque_torque;
    let positive = weights.is_none_or(|weights| weights.iter().all(|weight| *weight > 0.0));
    if !(summed.is_finite() && points.speeds[0] > 0.0 && positive) {
        return Err(no_point(speeds, torques, weights));
    }
    let bounds = bounds(points.speeds);
    let sample = |k: usize| Sample { speed: speeds[k], torque: torques[k], weight: weights.map_or(1.0, |w| w[k]) };
    let found =
        fast(&points, bounds).unwrap_or_else(|| slow(&points, &(0..count).map(sample).collect::<Vec<_>>(), bounds));
    let scale = found.cost / (count - 4) as f64;
    let covariance = super::stribeck::inverse(&found.normal).map(|inverse| inverse.map(|row| row.map(|v| v * scale)));
    Ok(StribeckOptimum {
        parameters: found.parameters,
        covariance: covariance.unwrap_or([[f64::INFINITY; 4]; 4]),
        rms: (found.cost / plain.one).sqrt(),
    })
}

/// The first that is no point.
fn no_point(speeds: &[f64], torques: &[f64], weights: Option<&[f64]>) -> Error {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    let fault = |index: usize| {
        let (speed, torque, weight) = (speeds[index], torques[index], weights.map_or(1.0, |w| w[index]));
        let of = |field, value, remedy| Some(Error::CurvePoint { index, field, value, remedy });
        if !positive(speed) {
            of("velocity", speed, "A speed is above 0: mirror the other direction, leave out points at rest.")
        } else if !torque.is_finite() {
            of("torque", torque, "Leave out points without a value.")
        } else if !positive(weight) {
            of("weight", weight, "A weight is 1 over the square of a standard error.")
        } else {
            None
        }
    };
    let sums = Error::OutOfRange {
        name: "the sum of squares",
        value: f64::INFINITY,
        unit: "1",
        minimum: 0.0,
        maximum: f64::MAX,
        remedy: "Give SI units.",
    };
    (0..speeds.len()).find_map(fault).unwrap_or(sums)
}

/// Ω_Strib of a fit, from the slowest and the fastest speed.
pub(super) fn bounds([slowest, fastest]: [f64; 2]) -> [f64; 2] {
    [slowest / 10.0, fastest * 3.0]
}

/// The best parameters of all.
pub(super) fn optimum(samples: &[Sample], bounds: [f64; 2]) -> Parameters<f64> {
    let points = Points::of_samples(samples);
    fast(&points, bounds).unwrap_or_else(|| slow(&points, samples, bounds)).parameters
}

/// The best parameters from a start that is good.
pub(super) fn from_near(samples: &[Sample], start: Parameters<f64>, bounds: [f64; 2]) -> Parameters<f64> {
    let points = Points::of_samples(samples);
    descend(&points, start, bounds, EXACT).map_or_else(|| polish(samples, start, bounds), |it| it.parameters)
}

/// `None` where a descent comes to nothing: there is more than one thing then that it may be.
fn fast(points: &Points, bounds: [f64; 2]) -> Option<Minimum> {
    if points.len() <= MANY {
        return deepest(valleys(points, bounds).into_iter().map(|it| descend(points, it.parameters, bounds, EXACT)));
    }
    let [fine, coarse] = points.means();
    let starts = valleys(&coarse, bounds).into_iter().map(|valley| {
        let rough = descend(&coarse, valley.parameters, bounds, CLOSE)?;
        descend(&fine, rough.parameters, bounds, CLOSE)
    });
    let mut bottoms = starts.collect::<Option<Vec<Minimum>>>()?;
    bottoms.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let least = bottoms.first()?;
    // The means leave out the scatter within them; a valley that is deeper by less than a thousandth of all may be no
    // deeper.
    let margin = if bottoms.len() > 1 { 1e-3 * points.sums(least.parameters).rr } else { 0.0 };
    let near = bottoms.iter().take_while(|it| it.cost <= least.cost + margin);
    deepest(near.map(|it| descend(points, it.parameters, bounds, CLOSE)))
}

/// The deepest, if all are minima.
fn deepest(minima: impl Iterator<Item = Option<Minimum>>) -> Option<Minimum> {
    let all = minima.collect::<Option<Vec<Minimum>>>()?;
    all.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// By finer and finer grids over the Stribeck velocity, which always come to something.
fn slow(points: &Points, samples: &[Sample], bounds: [f64; 2]) -> Minimum {
    let bottoms = valleys(points, bounds).into_iter().map(|valley| bottom(points, valley, bounds).parameters);
    let polished = bottoms.map(|start| polish(samples, start, bounds));
    let best = polished.min_by(|a, b| cost(*a, samples).total_cmp(&cost(*b, samples)));
    let parameters = best.expect("there is always a valley");
    Minimum { parameters, cost: cost(parameters, samples), normal: normal_at(points, parameters) }
}

/// The last digits where a descent does not prove itself: parameters at 0 stay there, the Stribeck velocity stays within
/// its bounds.
fn polish(samples: &[Sample], start: Parameters<f64>, bounds: [f64; 2]) -> Parameters<f64> {
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
