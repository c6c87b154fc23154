//! The Stribeck curve through reference points. A point that contradicts the others is found and not used.

use std::convert::Infallible;

use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::{Dual, Scalar};

use stickslip_base::Error;
use stickslip_fit::{Stop, minimise};

/// A reference point: speed ≥ 0 [rad/s], torque > 0 [N m], weight > 0.
pub type Weighted = [f64; 3];

/// Deviation from which a point may be stray: a share of the largest torque, and a multiple of the RMS of the others.
const STRAY: f64 = 0.1;
const APART: f64 = 5.0;
/// RMS deviation of the used points above which stray points are searched, as a share of the largest torque.
const CLOSE: f64 = 0.03;
/// Fewest used points, and the largest number of stray ones.
const FEWEST: usize = 4;
const MOST: usize = 8;
/// Largest number of points that are left out on trial.
const TRIED: usize = 12;
/// Largest breakaway and kinetic torque over the largest torque of the points: the curve does not rise much above them.
const ABOVE: f64 = 1.25;

/// The Stribeck curve through reference points by least squares. Parameters that the points do not determine remain near
/// `start`: a change of a parameter by a factor of e weighs as much as a thousandth of the largest torque. One
/// parameter, by its index in [`PARAMETERS`](stickslip_fit::PARAMETERS), may be held at its value in `start`. From five
/// points on, those that contradict the others are not used, except with a weight above 1.
///
/// # Errors
/// [`Error::CurvePoint`] for an invalid point; [`Error::TooFew`] without one.
pub fn through_points(points: &[Weighted], start: &Stribeck<f64>, held: Option<usize>) -> Result<Stribeck<f64>, Error> {
    check(points)?;
    let (_, all) = fitted(points, start, held);
    Ok(without_strays(points, all, start, held).unwrap_or(all))
}

/// The curve through the points but the stray ones; `None` if there are none.
fn without_strays(
    points: &[Weighted],
    all: Stribeck<f64>,
    start: &Stribeck<f64>,
    held: Option<usize>,
) -> Option<Stribeck<f64>> {
    let mut curve = all;
    let mut used = points.to_vec();
    for _ in 0..most(points.len()) {
        if rms(&used, &curve) <= CLOSE * largest(&used) {
            return None;
        }
        // The point without which the others fit best, with the least change of the curve.
        let deviation = |index: &usize| deviation(&used[*index], &curve).abs();
        let mut tried: Vec<usize> = (0..used.len()).filter(|index| used[*index][2] <= 1.0).collect();
        tried.sort_by(|a, b| deviation(b).total_cmp(&deviation(a)));
        let left_out = tried.into_iter().take(TRIED).map(|index| {
            let others: Vec<_> =
                used.iter().enumerate().filter(|(at, _)| *at != index).map(|(_, point)| *point).collect();
            let (cost, curve) = fitted(&others, start, held);
            (cost, others, curve)
        });
        (_, used, curve) = left_out.min_by(|a, b| a.0.total_cmp(&b.0))?;
        if strays(points, &curve).len() == points.len() - used.len() && rms(&used, &curve) <= CLOSE * largest(&used) {
            return Some(curve);
        }
    }
    None
}

/// The points that contradict the others: at most a third, each with a weight of at most 1 and farther from the curve
/// than a tenth of the largest torque and five times the RMS deviation of the others.
pub(crate) fn strays(points: &[Weighted], curve: &Stribeck<f64>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).filter(|index| points[*index][2] <= 1.0).collect();
    let far = |index: usize| deviation(&points[index], curve).abs();
    order.sort_by(|a, b| far(*b).total_cmp(&far(*a)));
    for count in (1..=most(points.len()).min(order.len())).rev() {
        let (out, _) = order.split_at(count);
        let others: Vec<_> =
            (0..points.len()).filter(|index| !out.contains(index)).map(|index| points[index]).collect();
        let limit = (APART * rms(&others, curve)).max(STRAY * largest(&others));
        if out.iter().all(|index| far(*index) > limit) {
            let mut out = out.to_vec();
            out.sort_unstable();
            return out;
        }
    }
    Vec::new()
}

/// Largest number of stray points among some.
fn most(count: usize) -> usize {
    (count / 3).min(count.saturating_sub(FEWEST)).min(MOST)
}

/// Torque of a point minus that of the curve [N m].
pub(crate) fn deviation(point: &Weighted, curve: &Stribeck<f64>) -> f64 {
    point[1] - curve.magnitude(point[0])
}

fn rms(points: &[Weighted], curve: &Stribeck<f64>) -> f64 {
    let squares: f64 = points.iter().map(|point| deviation(point, curve).powi(2)).sum();
    (squares / points.len() as f64).sqrt()
}

fn largest(points: &[Weighted]) -> f64 {
    points.iter().map(|[_, torque, _]| *torque).fold(0.0, f64::max)
}

fn check(points: &[Weighted]) -> Result<(), Error> {
    for (index, &[speed, torque, weight]) in points.iter().enumerate() {
        if !(speed.is_finite() && speed >= 0.0) {
            let remedy = "The speed of a reference point is at least 0: friction is the same in both directions.";
            return Err(Error::CurvePoint { index, field: "velocity", value: speed, remedy });
        }
        if !(torque.is_finite() && torque > 0.0) {
            let remedy = "Friction brakes: the torque must be above 0.";
            return Err(Error::CurvePoint { index, field: "torque", value: torque, remedy });
        }
        if !(weight.is_finite() && weight > 0.0) {
            let remedy = "A weight must be above 0; remove the point instead.";
            return Err(Error::CurvePoint { index, field: "weight", value: weight, remedy });
        }
    }
    if points.is_empty() {
        let remedy = "Give at least one.";
        return Err(Error::TooFew { what: "reference points", found: 0, needed: 1, remedy });
    }
    Ok(())
}

/// Least squares: the cost, and the curve.
fn fitted(points: &[Weighted], start: &Stribeck<f64>, held: Option<usize>) -> (f64, Stribeck<f64>) {
    let largest = largest(points);
    let old = [start.breakaway_torque, start.kinetic_torque, start.stribeck_velocity, start.viscous_friction.max(1e-9)];
    let torque = |start: f64| [1e-6, (ABOVE * largest).max(start)];
    let bounds = [torque(old[0]), torque(old[1]), [1e-4, 1e3], [1e-12, 50.0]];
    let stop = Stop { step: 1e-10, fall: 1e-14, evaluations: 400 };
    let factors = if held == Some(2) { &[1.0][..] } else { &[0.1, 0.3, 1.0, 3.0] };
    let fits = factors.iter().map(|factor| {
        let mut from = old;
        from[2] = (from[2] * factor).clamp(bounds[2][0], bounds[2][1]);
        let Ok(fit) = minimise(from, bounds, stop, |p: [Dual<4>; 4]| {
            let curve = exponential(p);
            let off = points.iter().map(|&[speed, torque, weight]| {
                (curve.magnitude(Dual::of(speed)) - Dual::of(torque)) * Dual::of(weight.sqrt())
            });
            let pull = |i: usize| if held == Some(i) { HELD } else { 1e-3 };
            let moved = (0..4).map(|i| (p[i] / Dual::of(old[i])).ln() * Dual::of(pull(i) * largest));
            Ok::<_, Infallible>(off.chain(moved).collect())
        });
        fit
    });
    let fit = fits.min_by(|a, b| a.cost.total_cmp(&b.cost)).expect("at least one start");
    let mut numbers = fit.parameters;
    if let Some(held) = held {
        numbers[held] = old[held];
    }
    (fit.cost, exponential(numbers))
}

/// Weight that holds a parameter: it moves less than the output resolution.
const HELD: f64 = 1e2;

/// The exponential form, equation (1).
fn exponential<T: Scalar>(parameters: [T; 4]) -> Stribeck<T> {
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = parameters;
    let decay = Decay::Exponential;
    Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, decay }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_fit::values;

    #[test]
    fn four_points_of_a_curve_return_the_curve() {
        let exact =
            Stribeck { kinetic_torque: 0.12, stribeck_velocity: 1.5, viscous_friction: 1.2e-3, ..Stribeck::default() };
        let points = [0.0, 1.5, 12.0, 80.0].map(|speed| [speed, exact.magnitude(speed), 1.0]);
        let fit = through_points(&points, &Stribeck::default(), None).unwrap();
        for (fit, exact) in values(&fit).into_iter().zip(values(&exact)) {
            // The pull of the start, a thousandth of the torque on each parameter, squared.
            assert!((fit / exact - 1.0).abs() < 1e-3, "{fit} for {exact}");
        }
    }

    #[test]
    fn one_point_moves_only_the_parameters_that_it_determines() {
        let start = Stribeck::default();
        let fit = through_points(&[[0.0, 0.4, 1.0]], &start, None).unwrap();
        assert!((fit.breakaway_torque - 0.4).abs() < 1e-4, "{fit:?}");
        assert!((fit.kinetic_torque / start.kinetic_torque - 1.0).abs() < 1e-6);
    }

    #[test]
    fn an_invalid_reference_point_is_refused() {
        let refusal = |points: &[Weighted]| through_points(points, &Stribeck::default(), None).unwrap_err().to_string();
        assert!(
            refusal(&[[1.0, 0.2, 1.0], [-1.0, 0.2, 1.0]]).starts_with("point 2 of the friction curve: velocity = -1.")
        );
        assert!(refusal(&[[1.0, f64::NAN, 1.0]]).contains("torque = NaN. Friction brakes"));
        assert!(refusal(&[]).contains("too few reference points: 0; at least 1 required"));
    }

    /// Four points of a curve and a stray one, wherever it lies.
    fn with_stray(stray: [f64; 3]) -> (Vec<Weighted>, Stribeck<f64>) {
        let exact =
            Stribeck { kinetic_torque: 0.12, stribeck_velocity: 1.5, viscous_friction: 1.2e-3, ..Stribeck::default() };
        let mut points: Vec<Weighted> =
            [0.0, 1.5, 12.0, 80.0].map(|speed| [speed, exact.magnitude(speed), 1.0]).to_vec();
        points.push(stray);
        (points, exact)
    }

    #[test]
    fn a_stray_point_is_found_and_does_not_move_the_curve() {
        for stray in [[0.5, 1.4], [3.0, 1.0], [0.2, 0.05], [30.0, 0.9], [60.0, 0.01]] {
            let (points, exact) = with_stray([stray[0], stray[1], 1.0]);
            for start in [exact, Stribeck::default()] {
                let fit = through_points(&points, &start, None).unwrap();
                assert_eq!(strays(&points, &fit), [4], "{stray:?}: {fit:?}");
                for speed in [0.0, 1.0, 10.0, 50.0] {
                    assert!((fit.magnitude(speed) - exact.magnitude(speed)).abs() < 2e-3, "{stray:?}: {fit:?}");
                }
            }
        }
    }

    #[test]
    fn a_stray_point_with_a_larger_weight_is_used() {
        let (points, exact) = with_stray([0.5, 0.6, 2.0]);
        let fit = through_points(&points, &exact, None).unwrap();
        assert!(strays(&points, &fit).is_empty() && fit.magnitude(0.5) > 0.4, "{fit:?}");
    }

    #[test]
    fn of_four_points_each_is_used() {
        let (points, exact) = with_stray([0.5, 0.6, 1.0]);
        let fit = through_points(&points[1..], &exact, None).unwrap();
        assert!(strays(&points[1..], &fit).is_empty());
    }

    #[test]
    fn the_curve_does_not_rise_much_above_its_points() {
        // A drop between the first two points alone would fit any breakaway torque.
        let points = [[1.0, 1.0, 1.0], [2.0, 0.2, 1.0], [20.0, 0.18, 1.0], [60.0, 0.2, 1.0]];
        let start = Stribeck { stribeck_velocity: 0.2, ..Stribeck::default() };
        let fit = through_points(&points, &start, None).unwrap();
        assert!(fit.breakaway_torque <= 1.25 && fit.kinetic_torque <= 1.25, "{fit:?}");
    }

    #[test]
    fn several_stray_points_among_many_are_found_and_noise_is_not() {
        let (_, exact) = with_stray([1.0; 3]);
        let noise = |k: usize| 4e-3 * f64::sin(7.0 * k as f64);
        let mut points: Vec<Weighted> =
            (0..24).map(|k| [0.15 * (k * k) as f64, exact.magnitude(0.15 * (k * k) as f64) + noise(k), 1.0]).collect();
        let fit = through_points(&points, &Stribeck::default(), None).unwrap();
        assert!(strays(&points, &fit).is_empty());
        (points[3][1], points[10][1], points[17][1]) = (0.9, 0.6, 0.01);
        let fit = through_points(&points, &Stribeck::default(), None).unwrap();
        assert_eq!(strays(&points, &fit), [3, 10, 17], "{fit:?}");
        assert!((fit.breakaway_torque - exact.breakaway_torque).abs() < 0.02, "{fit:?}");
    }
}
