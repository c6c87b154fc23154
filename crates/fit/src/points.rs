//! Plausibility of the points of a friction curve.
//!
//! The search over the Stribeck velocity covers the range of the speeds, so that one mistyped speed decides about its
//! effort and about the result. Such a point is refused with its row instead.

use super::CurvePoint;
use stickslip_base::Error;

/// Largest ratio of a speed to the median of all, and its inverse: six decades more than any drive covers.
const SPEEDS: f64 = 1e6;
/// Plausible magnitudes of speeds [rad/s or m/s], torques [N m or N] and their errors in any unit: squares of these
/// numbers and their sums are finite.
const MAGNITUDES: [f64; 2] = [1e-30, 1e30];

/// Checks all points of a curve; the first invalid one is reported with its index.
///
/// # Errors
/// [`Error::CurvePoint`] for a velocity that is 0, not finite, or implausible beside the others; for a torque or a
/// standard error that is not finite or implausible; and for a standard error that is not positive.
pub fn check_points(points: &[CurvePoint]) -> Result<(), Error> {
    let mut speeds: Vec<f64> = points.iter().map(|point| point.velocity.abs()).filter(|v| v.is_finite()).collect();
    speeds.sort_by(f64::total_cmp);
    let median = speeds.get(speeds.len() / 2).copied().unwrap_or(1.0);
    let [smallest, largest] = MAGNITUDES;
    let is_plausible = |value: f64| (smallest..=largest).contains(&value.abs());
    for (index, point) in points.iter().enumerate() {
        let CurvePoint { velocity, torque, standard_error } = *point;
        let bad = |field, value, remedy| Err(Error::CurvePoint { index, field, value, remedy });
        let speed = velocity.abs();
        if !(velocity.is_finite() && velocity != 0.0) {
            return bad("velocity", velocity, "Remove points at rest: the curve is that of a moving axis.");
        }
        if !is_plausible(speed) || speed > SPEEDS * median || speed < median / SPEEDS {
            let remedy = "It is not plausible: beyond a million times the median of the speeds, or below a millionth. \
                          Correct its unit or exponent, or remove the row.";
            return bad("velocity", velocity, remedy);
        }
        if !torque.is_finite() {
            return bad("torque", torque, "Remove points without a value.");
        }
        if torque != 0.0 && !is_plausible(torque) {
            return bad("torque", torque, "It is not plausible. Correct its unit or exponent, or remove the row.");
        }
        if !(standard_error.is_finite() && standard_error > 0.0) {
            let remedy = "Set a positive standard error for each point, or 1 for all.";
            return bad("standard_error", standard_error, remedy);
        }
        if !is_plausible(standard_error) {
            let remedy = "It is not plausible. Correct its unit or exponent, or remove the column.";
            return bad("standard_error", standard_error, remedy);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{StribeckPlan, fit_stribeck};
    use super::*;

    fn with(index: usize, change: impl Fn(&mut CurvePoint)) -> Vec<CurvePoint> {
        let point = |velocity| CurvePoint { velocity, torque: 0.3 + 0.02 * velocity, standard_error: 1e-3 };
        let mut points = [0.1, 0.5, 1.0, 2.0, 5.0, 20.0, 50.0].map(point).to_vec();
        change(&mut points[index]);
        points
    }

    #[test]
    fn one_implausible_number_is_refused_with_its_row_before_any_search() {
        let message = |points: &[CurvePoint]| {
            let error = fit_stribeck(points, &StribeckPlan::default()).unwrap_err();
            assert!(matches!(error, Error::CurvePoint { index: 3, .. }), "{error}");
            error.to_string()
        };
        for velocity in [1e308, -1e308, 5e-324, 1e9, 1e-9, f64::MAX, f64::MIN_POSITIVE] {
            let message = message(&with(3, |point| point.velocity = velocity));
            assert!(message.starts_with("point 4 of the friction curve: velocity = "), "{message}");
            assert!(message.contains("million times the median"), "{message}");
        }
        for torque in [1e308, -1e308, 1e-310] {
            assert!(message(&with(3, |point| point.torque = torque)).contains("torque = "));
        }
        for error in [1e-200, 1e200] {
            assert!(message(&with(3, |point| point.standard_error = error)).contains("remove the column"));
        }
        assert!(fit_stribeck(&with(3, |point| point.torque = 0.0), &StribeckPlan::default()).is_ok());
    }

    #[test]
    fn all_speeds_may_be_slow_or_fast() {
        for scale in [1e-9, 1e9] {
            let mut points = with(0, |_| ());
            points.iter_mut().for_each(|point| point.velocity *= scale);
            assert!(fit_stribeck(&points, &StribeckPlan::default()).is_ok(), "{scale}");
        }
    }
}
