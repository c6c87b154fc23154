//! Profile likelihood: limits of one parameter with all others fitted.
//!
//! The covariance of a fit is the curvature at its end. It ignores curved valleys, bounds, and parameters without
//! influence on the data. A profile does not: the parameter is held at one value after the other while all others are
//! fitted again. Where the sum of squares S rises by
//!
//!   n·ln(S/S_min)/κ ≥ χ²₉₅(1) = 3.84
//!
//! the held value is excluded (Venzon and Moolgavkar 1988; Raue et al. 2009). κ is the factor by which correlated
//! residuals contain less information than white ones of the same number. Where S never rises so far, the data give no
//! limit on that side.

use std::fmt;

use stickslip_core::scalar::{Dual, Scalar as _};

use super::{Stop, minimise};
use stickslip_base::parameters::number::rounded;

/// 95 % of χ² with one degree of freedom.
const CHI95: f64 = 3.841_458_820_694_124;

/// Sums of squares over one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Name of the parameter.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Value of the fit.
    pub best: f64,
    /// Held values, rising, including the fit's own; and the sum of squares there.
    pub points: Vec<[f64; 2]>,
    /// Residuals.
    pub samples: usize,
    /// κ ≥ 1: variance of the parameter over its variance with white residuals.
    pub inflation: f64,
}

/// Plan of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePlan {
    /// Farthest value, as a factor and its inverse.
    pub reach: f64,
    /// Values on each side.
    pub steps: usize,
    /// Stopping conditions of the fits of the others.
    pub stop: Stop,
}

impl Profile {
    /// The profile of parameter `which` from a fit's end: outwards on both sides, each fit from the one before, until the
    /// sum of squares is far beyond the limit.
    ///
    /// # Errors
    /// The first error of the residuals.
    pub fn of<const N: usize, E>(
        (name, unit): (&str, &str),
        (which, best): (usize, [f64; N]),
        bounds: [[f64; 2]; N],
        plan: ProfilePlan,
        inflation: f64,
        residuals: impl Fn([Dual<N>; N]) -> Result<Vec<Dual<N>>, E>,
    ) -> Result<Self, E> {
        let here = residuals(best.map(Dual::of))?;
        let least: f64 = here.iter().map(|residual| residual.value * residual.value).sum();
        let mut profile = Profile {
            name: name.into(),
            unit: unit.into(),
            best: best[which],
            points: vec![[best[which], least]],
            samples: here.len(),
            inflation: inflation.max(1.0),
        };
        for way in [-1.0, 1.0] {
            let mut start = best;
            for k in 1..=plan.steps {
                let factor = libm::pow(plan.reach, way * k as f64 / plan.steps as f64);
                let held = (best[which] * factor).clamp(bounds[which][0], bounds[which][1]);
                // A parameter without slope has no influence and stays.
                start[which] = held;
                let of = |mut p: [Dual<N>; N]| {
                    p[which] = Dual::of(held);
                    residuals(p)
                };
                let mut within = bounds;
                within[which] = [held; 2];
                let minimum = minimise(start, within, plan.stop, of)?;
                start = minimum.parameters;
                profile.points.push([held, minimum.cost]);
                if profile.rise(minimum.cost) > 4.0 * CHI95 {
                    break;
                }
            }
        }
        profile.points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Ok(profile)
    }

    fn least(&self) -> f64 {
        self.points.iter().map(|[_, cost]| *cost).fold(f64::INFINITY, f64::min)
    }

    /// n·ln(S/S_min)/κ of a sum of squares.
    pub fn rise(&self, cost: f64) -> f64 {
        self.samples as f64 * libm::log(cost / self.least()) / self.inflation
    }

    /// 95 % limits; none on a side without a limit.
    pub fn interval(&self) -> [Option<f64>; 2] {
        let rises: Vec<[f64; 2]> = self.points.iter().map(|[value, cost]| [*value, self.rise(*cost)]).collect();
        let bottom = (0..rises.len()).min_by(|a, b| rises[*a][1].total_cmp(&rises[*b][1])).unwrap_or(0);
        let crossing = |inner: usize, outer: usize| {
            let ([a, low], [b, high]) = (rises[inner], rises[outer]);
            // The rise goes with the square of the distance.
            let share = (CHI95.sqrt() - low.sqrt()) / (high.sqrt() - low.sqrt());
            (low < CHI95 && high >= CHI95).then(|| a * libm::pow(b / a, share))
        };
        let below = (1..=bottom).rev().find_map(|k| crossing(k, k - 1));
        let above = (bottom..rises.len().saturating_sub(1)).find_map(|k| crossing(k, k + 1));
        [below, above]
    }

    /// Whether the data limit the parameter on both sides.
    pub fn is_identifiable(&self) -> bool {
        self.interval().iter().all(Option::is_some)
    }

    /// n·ln(S/S_min)/κ over the logarithm of the values, for a figure.
    pub fn rises(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.points.iter().map(|[value, cost]| (libm::log10(*value), self.rise(*cost)))
    }

    /// Limit of the rise.
    pub const LIMIT: f64 = CHI95;
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Profile { name, unit, best, points, .. } = self;
        let rough = |value: f64| rounded(value, 3);
        let ends = [points.first(), points.last()].map(|end| end.map_or(*best, |[value, _]| *value));
        match self.interval() {
            [Some(low), Some(high)] => {
                write!(f, "{name}: {} {unit}, within {} … {} to 95 %", rough(*best), rough(low), rough(high))
            }
            [Some(low), None] => write!(
                f,
                "{name} is not identifiable from this recording: any value above {} {unit} does as well, up to {} at \
                 least",
                rough(low),
                rough(ends[1])
            ),
            [None, Some(high)] => write!(
                f,
                "{name} is not identifiable from this recording: any value below {} {unit} does as well, down to {} at \
                 least",
                rough(high),
                rough(ends[0])
            ),
            [None, None] => write!(
                f,
                "{name} is not identifiable from this recording: any value from {} to {} {unit} does as well",
                rough(ends[0]),
                rough(ends[1])
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::super::tests::normal;
    use super::*;

    const STOP: Stop = Stop { step: 1e-9, fall: f64::NEG_INFINITY, evaluations: 60 };
    const FREE: [[f64; 2]; 2] = [[0.0, f64::INFINITY]; 2];

    /// Residuals of a·(1 − e^(−t/b)) through noisy points until `end`, as dual numbers of a and b.
    fn residuals(end: f64, b: f64) -> impl Fn([Dual<2>; 2]) -> Result<Vec<Dual<2>>, Infallible> {
        move |[amplitude, time]: [Dual<2>; 2]| {
            let one = Dual::of(1.0);
            let residual = |k: u32| {
                let t = end * (f64::from(k) + 0.5) / 200.0;
                let measured = 2.0 * (1.0 - libm::exp(-t / b)) + 0.02 * normal(3, u64::from(k));
                Dual::of(measured) - amplitude * (one - (-(Dual::of(t) / time)).exp())
            };
            Ok((0..200).map(residual).collect())
        }
    }

    fn profile(end: f64, b: f64, reach: f64) -> Profile {
        let of = residuals(end, b);
        let Ok(best) = minimise([1.0, 1.0], FREE, STOP, &of);
        let plan = ProfilePlan { reach, steps: 40, stop: STOP };
        let Ok(profile) = Profile::of(("time constant", "s"), (1, best.parameters), FREE, plan, 1.0, &of);
        profile
    }

    #[test]
    fn the_profile_of_a_well_determined_parameter_has_the_interval_of_the_covariance() {
        let determined = profile(5.0, 1.0, 1.1);
        let [Some(low), Some(high)] = determined.interval() else { panic!("{determined}") };
        assert!(determined.is_identifiable() && low < 1.0 && 1.0 < high, "{determined}");
        // (JᵀJ)⁻¹ of 200 points with 0.02: 0.0055 of b by the same formula in NumPy, half of the interval 1.96 of it.
        let of = residuals(5.0, 1.0);
        let Ok(all) = of([Dual::variable(2.0, 0), Dual::variable(determined.best, 1)]);
        let sum = |i: usize, j: usize| all.iter().map(|r| r.gradient[i] * r.gradient[j]).sum::<f64>();
        let variance = 0.02 * 0.02 * sum(0, 0) / (sum(0, 0) * sum(1, 1) - sum(0, 1) * sum(0, 1));
        // The drawn noise is a few percent off its deviation, and a step is half a standard error wide.
        let ratio = 0.5 * (high - low) / (1.96 * variance.sqrt());
        assert!((0.75..1.35).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_side_without_a_limit_is_reported() {
        // Only the start of the rise: a slope a/b, and both may be arbitrarily large.
        let slow = profile(0.1, 1.0, 100.0);
        assert!(!slow.is_identifiable(), "{slow}");
        let [Some(_), None] = slow.interval() else { panic!("{slow}") };
        assert!(slow.to_string().starts_with("time constant is not identifiable from this recording: any value above"));
        // Only the end: too fast for the first point.
        let quick = profile(5.0, 1e-4, 100.0);
        let [None, Some(_)] = quick.interval() else { panic!("{quick}") };
        assert!(quick.to_string().contains("any value below"), "{quick}");
    }

    #[test]
    fn correlated_residuals_make_the_interval_wider() {
        let determined = profile(5.0, 1.0, 1.1);
        let less = Profile { inflation: 2.0, ..determined.clone() };
        let width = |profile: &Profile| {
            let [Some(low), Some(high)] = profile.interval() else { panic!("{profile}") };
            high - low
        };
        // Twice the variance, √2 of the width.
        assert!((1.3..1.55).contains(&(width(&less) / width(&determined))));
    }
}
