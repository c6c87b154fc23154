//! Coulomb and viscous friction, where a Stribeck curve explains the points no better.
//!
//! Four parameters through points of a straight line have no meaning one by one: the fit invents a drop below the
//! slowest speed. Two parameters describe the same points, and each has an interval.

use super::projection::Sample;
use super::stribeck::{Normal, StribeckFit, StribeckPlan, Uncertainty, huber_weight, interval, select};
use super::{CurvePoint, SIGNIFICANCE, f_test, student_t95};
use stickslip_base::Error;

/// M_K and b with their weights and covariance.
struct Line {
    values: [f64; 2],
    covariance: [[f64; 2]; 2],
}

impl StribeckFit {
    /// This fit, or Coulomb and viscous friction if the points show no drop and the simple law explains them as well
    /// (F test): then M_S = M_K, and M_S and Ω_Strib are unknown. `points` and `plan` are those of the fit.
    ///
    /// # Errors
    /// As [`fit_stribeck`](super::fit_stribeck).
    pub fn or_coulomb(self, points: &[CurvePoint], plan: &StribeckPlan) -> Result<Self, Error> {
        if self.drop.is_identified() {
            return Ok(self);
        }
        let mut samples = select(points, plan.side)?;
        samples.iter_mut().for_each(|s| s.weight = 1.0 / (1.0 / s.weight + self.lack_of_fit * self.lack_of_fit));
        let line = robust(&samples, plan.huber);
        let chi_square = cost(&samples, line.values);
        let full = self.chi_square.min(chi_square);
        if f_test(chi_square, full, 2.0, self.degrees_of_freedom as f64) < SIGNIFICANCE {
            return Ok(self);
        }
        Ok(self.with_line(&samples, plan, &line, chi_square))
    }

    /// Whether the parameters are those of Coulomb and viscous friction.
    pub fn is_coulomb(&self) -> bool {
        self.parameters[0] == self.parameters[1] && self.ci95[0][1].is_infinite()
    }

    fn with_line(self, samples: &[Sample], plan: &StribeckPlan, line: &Line, chi_square: f64) -> Self {
        let [coulomb, viscous] = line.values;
        let degrees_of_freedom = samples.len() - 2;
        let Normal { square, inside } = Normal::of(plan.huber.unwrap_or(f64::INFINITY));
        let is_scaled = plan.uncertainty == Uncertainty::Scaled;
        let scale = square / (inside * inside);
        let scale = if is_scaled { scale * robust_scale(samples, line.values, plan.huber) } else { scale };
        let covariance = line.covariance.map(|row| row.map(|value| value * scale));
        let is_absolute = match plan.uncertainty {
            Uncertainty::Absolute => true,
            Uncertainty::Scaled => false,
            Uncertainty::Extra => self.lack_of_fit == 0.0,
        };
        let coverage_factor = if is_absolute { 1.96 } else { student_t95(degrees_of_freedom as f64) };
        let [[a, c], [_, b]] = covariance;
        let errors = [a.sqrt(), b.sqrt()];
        let unknown = [0.0, f64::INFINITY];
        let residuals: Vec<f64> = samples.iter().map(|s| s.torque - coulomb - viscous * s.speed).collect();
        StribeckFit {
            parameters: [coulomb, coulomb, self.parameters[2], viscous],
            // M_S and M_K are one number, and Ω_Strib has no effect on the curve.
            covariance: [[a, a, 0.0, c], [a, a, 0.0, c], [0.0; 4], [c, c, 0.0, b]],
            standard_errors: [f64::INFINITY, errors[0], f64::INFINITY, errors[1]],
            ci95: [
                unknown,
                interval(coulomb, coverage_factor * errors[0]),
                unknown,
                interval(viscous, coverage_factor * errors[1]),
            ],
            at_bound: [false, coulomb == 0.0, false, viscous == 0.0],
            rms: (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt(),
            residuals,
            chi_square,
            coverage_factor,
            degrees_of_freedom,
            ..self
        }
    }
}

/// Weighted sum of squares about the line.
fn cost(samples: &[Sample], [coulomb, viscous]: [f64; 2]) -> f64 {
    samples.iter().map(|s| s.weight * (s.torque - coulomb - viscous * s.speed).powi(2)).sum()
}

/// Mean square of the standardised residuals, large ones cut, over its expectation.
fn robust_scale(samples: &[Sample], [coulomb, viscous]: [f64; 2], huber: Option<f64>) -> f64 {
    let threshold = huber.unwrap_or(f64::INFINITY);
    let Normal { square, .. } = Normal::of(threshold);
    let cut = |s: &Sample| ((s.torque - coulomb - viscous * s.speed).abs() * s.weight.sqrt()).min(threshold).powi(2);
    samples.iter().map(cut).sum::<f64>() / (samples.len() - 2) as f64 / square
}

/// The line with large residuals counted linearly.
fn robust(samples: &[Sample], huber: Option<f64>) -> Line {
    let mut weighted = samples.to_vec();
    let mut line = least_squares(&weighted);
    let Some(threshold) = huber else { return line };
    for _ in 0..100 {
        let [coulomb, viscous] = line.values;
        for (w, s) in weighted.iter_mut().zip(samples) {
            let residual = (s.torque - coulomb - viscous * s.speed) * s.weight.sqrt();
            w.weight = s.weight * huber_weight(residual, threshold);
        }
        let next = least_squares(&weighted);
        let moved = (0..2).any(|i| (next.values[i] - line.values[i]).abs() > 1e-12 * line.values[i].abs());
        line.values = next.values;
        if !moved {
            break;
        }
    }
    line
}

/// The best M_K and b, none negative.
fn least_squares(samples: &[Sample]) -> Line {
    let sum = |f: &dyn Fn(&Sample) -> f64| samples.iter().map(|s| s.weight * f(s)).sum::<f64>();
    let total = sum(&|_| 1.0);
    let (speed, torque) = (sum(&|s| s.speed) / total, sum(&|s| s.torque) / total);
    let spread = sum(&|s| (s.speed - speed).powi(2));
    let slope = sum(&|s| (s.speed - speed) * (s.torque - torque)) / spread;
    let values = if slope.is_nan() || slope <= 0.0 {
        [torque.max(0.0), 0.0]
    } else if torque < slope * speed {
        [0.0, sum(&|s| s.speed * s.torque) / sum(&|s| s.speed * s.speed)]
    } else {
        [torque - slope * speed, slope]
    };
    let of_slope = 1.0 / spread;
    Line {
        values,
        covariance: [[1.0 / total + speed * speed * of_slope, -speed * of_slope], [-speed * of_slope, of_slope]],
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::synthetic;
    use super::super::{HUBER, Side, fit_stribeck};
    use super::*;

    /// Six speeds a direction from 3 rad/s, Coulomb friction 0.55 N m, viscous friction 0.021 N m s/rad.
    const FAST: [[f64; 2]; 12] = [
        [3.0, 0.6145],
        [5.0, 0.6651],
        [8.0, 0.7224],
        [12.0, 0.8065],
        [16.0, 0.8886],
        [20.0, 0.9715],
        [-3.0, -0.6103],
        [-5.0, -0.655],
        [-8.0, -0.7208],
        [-12.0, -0.8054],
        [-16.0, -0.8905],
        [-20.0, -0.9686],
    ];

    #[test]
    fn a_line_has_coulomb_and_viscous_friction_on_each_side_and_nothing_else() {
        let points = FAST.map(|[velocity, torque]| CurvePoint { velocity, torque, standard_error: 1.0 });
        for side in [Side::Positive, Side::Negative, Side::Both] {
            let plan = StribeckPlan { side, huber: Some(HUBER), ..StribeckPlan::default() };
            let fit = fit_stribeck(&points, &plan).unwrap().or_coulomb(&points, &plan).unwrap();
            assert!(fit.is_coulomb(), "{side:?}: {fit:?}");
            assert_eq!([0, 1, 2, 3].map(|i| fit.knows(i)), [false, true, false, true], "{side:?}");
            for (index, truth) in [(1, 0.55), (3, 0.021)] {
                let [low, high] = fit.ci95[index];
                assert!(low < truth && truth < high && high - low < 0.1 * truth, "{side:?} {low} … {high}");
            }
            assert!(fit.band95(10.0) < 0.01 && fit.lines().next().unwrap().1.value.is_nan());
        }
    }

    #[test]
    fn a_drop_or_another_curvature_keeps_the_stribeck_curve() {
        for parameters in [[0.3, 0.18, 3.0, 2e-3], [0.18, 0.3, 3.0, 2e-3]] {
            let points = synthetic(parameters, 5e-4, 1);
            let plan = StribeckPlan::default();
            let fit = fit_stribeck(&points, &plan).unwrap();
            assert_eq!(fit.clone().or_coulomb(&points, &plan).unwrap(), fit);
        }
    }

    /// 95 % are expected of 400 lines with unknown scatter; 1.1 % is the standard deviation.
    #[test]
    fn intervals_of_a_line_contain_the_truth() {
        let (truth, mut hits, mut lines) = ([0.2, 2e-3], [0.0; 2], 0.0);
        for seed in 0..400 {
            let mut points = synthetic([truth[0], truth[0], 1.0, truth[1]], 1e-3, seed);
            points.iter_mut().for_each(|point| point.standard_error = 1.0);
            let plan = StribeckPlan::default();
            let line = fit_stribeck(&points, &plan).unwrap().or_coulomb(&points, &plan).unwrap();
            if line.is_coulomb() {
                lines += 1.0;
                for (hit, (index, truth)) in hits.iter_mut().zip([(1, truth[0]), (3, truth[1])]) {
                    let [low, high] = line.ci95[index];
                    *hit += f64::from(u8::from((low..=high).contains(&truth)));
                }
            }
        }
        assert!(lines > 320.0, "{lines}");
        assert!(hits.iter().all(|hit| (0.92..=0.98).contains(&(hit / lines))), "{hits:?} of {lines}");
    }
}
