//! Levenberg-Marquardt over positive parameters, with exact derivatives.
//!
//! The search runs in the logarithms: parameters keep their sign, and their scales do not matter. A parameter that
//! starts at 0 has no logarithm and stays there.

use nalgebra::{SMatrix, SVector};
use stickslip_core::scalar::{Dual, Lanes};

/// Stopping conditions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Largest share by which a parameter still moves.
    pub step: f64,
    /// Share of the sum of squares below which a step, real or predicted, ends the search; −∞ to go on.
    pub fall: f64,
    /// Largest number of evaluations.
    pub evaluations: usize,
}

/// Minimum of the sum of squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minimum<const N: usize> {
    /// The parameters.
    pub parameters: [f64; N],
    /// Sum of squares.
    pub cost: f64,
    /// Whether a stopping condition was reached before the last evaluation.
    pub converged: bool,
}

/// Least damping: small enough for fast convergence, large enough that a refused step soon shortens.
const DAMPING: f64 = 1e-4;

/// Minimises the sum of squared residuals from a start, within `low … high` of each parameter.
///
/// # Errors
/// The first error of the residuals; with [`Infallible`](std::convert::Infallible) there is none.
pub fn minimise<const N: usize, E>(
    start: [f64; N],
    bounds: [[f64; 2]; N],
    stop: Stop,
    residuals: impl Fn([Dual<N>; N]) -> Result<Vec<Dual<N>>, E>,
) -> Result<Minimum<N>, E> {
    let evaluate = |p: [f64; N]| -> Result<_, E> {
        Ok(Normal::of(&residuals(std::array::from_fn(|i| Dual::variable(p[i], i)))?, &p))
    };
    let mut minimum = Minimum { parameters: start, cost: f64::INFINITY, converged: false };
    let mut normal = evaluate(start)?;
    minimum.cost = normal.cost;
    let mut damping = DAMPING;
    for _ in 1..stop.evaluations {
        let Some((step, promise)) = normal.step(damping) else { break };
        if promise < stop.fall * normal.cost {
            minimum.converged = true;
            break;
        }
        let next = moved(&minimum.parameters, &step, &bounds);
        let candidate = evaluate(next)?;
        // Within rounding of the cost a step still improves the parameters.
        if candidate.cost <= minimum.cost * (1.0 + 1e-12) {
            let fall = 1.0 - candidate.cost / minimum.cost;
            (minimum.parameters, minimum.cost, normal) = (next, candidate.cost, candidate);
            damping = (damping * 0.1).max(DAMPING);
            if step.amax() < stop.step || fall < stop.fall {
                minimum.converged = true;
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e8 {
                break;
            }
        }
    }
    Ok(minimum)
}

/// Number of steps that [`minimise_side_by_side`] tries at once.
pub const TRIALS: usize = 8;

/// As [`minimise`], for residuals that take long: steps of all dampings, a decade apart, are tried side by side in vector
/// lanes, and the best one is taken. Derivatives are computed at accepted parameters only, by a function of their own.
/// If that is a coarser one, the search still ends where the residuals do not fall any more.
///
/// # Errors
/// The first error of either function.
pub fn minimise_side_by_side<const N: usize, E>(
    start: [f64; N],
    bounds: [[f64; 2]; N],
    stop: Stop,
    residuals: impl Fn([Lanes<f64, TRIALS>; N]) -> Result<Vec<Lanes<f64, TRIALS>>, E>,
    slopes: impl Fn([Dual<N>; N]) -> Result<Vec<Dual<N>>, E>,
) -> Result<Minimum<N>, E> {
    // A NaN is worse than any number.
    let costs = |rows: &[Lanes<f64, TRIALS>]| {
        let sums = rows.iter().fold([0.0; TRIALS], |sums, row| std::array::from_fn(|k| sums[k] + row.0[k] * row.0[k]));
        sums.map(|sum: f64| if sum.is_nan() { f64::INFINITY } else { sum })
    };
    let mut rows = residuals(start.map(|value| Lanes([value; TRIALS])))?;
    let (mut best, mut minimum) = (0, Minimum { parameters: start, cost: costs(&rows)[0], converged: false });
    for _ in 1..stop.evaluations {
        let here = std::array::from_fn(|i| Dual::variable(minimum.parameters[i], i));
        let mut sloped = slopes(here)?;
        sloped.iter_mut().zip(&rows).for_each(|(slope, row)| slope.value = row.0[best]);
        let normal = Normal::of(&sloped, &minimum.parameters);
        let steps: [_; TRIALS] = std::array::from_fn(|k| normal.step(DAMPING * libm::pow(10.0, k as f64)));
        // Without a step the parameters remain.
        let tried = steps.map(|step| step.map_or(minimum.parameters, |(s, _)| moved(&minimum.parameters, &s, &bounds)));
        if steps[0].is_some_and(|(_, promise)| promise < stop.fall * minimum.cost) {
            minimum.converged = true;
            break;
        }
        rows = residuals(std::array::from_fn(|i| Lanes(tried.map(|parameters| parameters[i]))))?;
        let tried_costs = costs(&rows);
        best = (0..TRIALS).min_by(|a, b| tried_costs[*a].total_cmp(&tried_costs[*b])).unwrap_or(0);
        let fall = 1.0 - tried_costs[best] / minimum.cost;
        if fall <= 0.0 || fall.is_nan() {
            break;
        }
        (minimum.parameters, minimum.cost) = (tried[best], tried_costs[best]);
        if fall < stop.fall || steps[best].is_some_and(|(step, _)| step.amax() < stop.step) {
            minimum.converged = true;
            break;
        }
    }
    Ok(minimum)
}

/// Parameters after a step in the logarithms, within their bounds.
fn moved<const N: usize>(from: &[f64; N], step: &SVector<f64, N>, bounds: &[[f64; 2]; N]) -> [f64; N] {
    // At most a factor of e at once: the linear model is not valid beyond.
    std::array::from_fn(|i| (from[i] * libm::exp(step[i].clamp(-1.0, 1.0))).clamp(bounds[i][0], bounds[i][1]))
}

/// Normal equations in the logarithms.
struct Normal<const N: usize> {
    cost: f64,
    matrix: SMatrix<f64, N, N>,
    right: SVector<f64, N>,
}

impl<const N: usize> Normal<N> {
    fn of(residuals: &[Dual<N>], parameters: &[f64; N]) -> Self {
        let mut normal = Normal::<N> { cost: 0.0, matrix: SMatrix::zeros(), right: SVector::zeros() };
        for residual in residuals {
            let row = SVector::<f64, N>::from_fn(|i, _| residual.gradient[i] * parameters[i]);
            normal.cost += residual.value * residual.value;
            for j in 0..N {
                normal.right[j] -= residual.value * row[j];
                for i in 0..=j {
                    normal.matrix[(i, j)] += row[i] * row[j];
                }
            }
        }
        normal.matrix.fill_lower_triangle_with_upper_triangle();
        normal
    }

    /// The damped step, and the reduction of the sum of squares that the linear model predicts.
    fn step(&self, damping: f64) -> Option<(SVector<f64, N>, f64)> {
        let mut damped: SMatrix<f64, N, N> = self.matrix;
        for i in 0..N {
            // A parameter at 0 has an empty row: a 1 keeps the matrix regular and its step 0.
            damped[(i, i)] = if damped[(i, i)] > 0.0 { damped[(i, i)] * (1.0 + damping) } else { 1.0 };
        }
        let step = damped.cholesky()?.solve(&self.right);
        Some((step, step.dot(&(self.right * 2.0 - self.matrix * step))))
    }
}

#[cfg(test)]
mod tests {
    use stickslip_core::scalar::Scalar;

    use super::*;

    /// Rosenbrock's valley over positive parameters: minimum at (1, 1).
    fn valley([x, y]: [Dual<2>; 2]) -> Result<Vec<Dual<2>>, f64> {
        let here = x.value;
        if here > 50.0 { Err(here) } else { Ok(vec![(y - x * x) * Dual::of(10.0), Dual::of(1.0) - x]) }
    }

    const FREE: [[f64; 2]; 2] = [[0.0, f64::INFINITY]; 2];
    const STOP: Stop = Stop { step: 1e-12, fall: f64::NEG_INFINITY, evaluations: 200 };

    #[test]
    fn it_walks_down_a_crooked_valley() {
        let minimum = minimise([0.01, 3.0], FREE, STOP, valley).unwrap();
        assert!(minimum.converged && minimum.cost < 1e-20, "{minimum:?}");
        assert!(minimum.parameters.iter().all(|p| (p - 1.0).abs() < 1e-9));
    }

    #[test]
    fn bounds_and_zeros_hold_and_a_small_budget_is_admitted() {
        assert_eq!(minimise([0.3, 0.2], [[0.0, 0.5], [0.0, f64::INFINITY]], STOP, valley).unwrap().parameters[0], 0.5);
        assert_eq!(minimise([0.0, 0.2], FREE, STOP, valley).unwrap().parameters[0], 0.0);
        assert!(!minimise([0.01, 3.0], FREE, Stop { evaluations: 3, ..STOP }, valley).unwrap().converged);
    }

    #[test]
    fn steps_side_by_side_walk_down_the_same_valley_with_slopes_that_are_a_little_wrong() {
        fn rows<T: Scalar>([x, y]: [T; 2], bend: f64) -> Result<Vec<T>, f64> {
            Ok(vec![(y - x * x * T::of(bend)) * T::of(10.0), T::of(1.0) - x])
        }
        let trials = |p| rows(p, 1.0);
        let minimum = minimise_side_by_side([0.01, 3.0], FREE, STOP, trials, |p| rows(p, 1.02)).unwrap();
        assert!(minimum.parameters.iter().all(|p| (p - 1.0).abs() < 1e-6), "{minimum:?}");
        let few = minimise_side_by_side([0.01, 3.0], FREE, Stop { evaluations: 3, ..STOP }, trials, |p| rows(p, 1.0));
        assert!(!few.unwrap().converged);
        let stop = Stop { fall: 1e-3, ..STOP };
        assert!(minimise_side_by_side([0.9, 0.8], FREE, stop, trials, |p| rows(p, 1.0)).unwrap().converged);
        let undefined = |p: [Lanes<f64, TRIALS>; 2]| rows(p.map(|x| x * Lanes::of(f64::NAN)), 1.0);
        let start = [0.5, 0.5];
        assert_eq!(minimise_side_by_side(start, FREE, STOP, undefined, |p| rows(p, 1.0)).unwrap().parameters, start);
        assert_eq!(minimise_side_by_side(start, FREE, STOP, trials, |_| Err(7.0)).unwrap_err(), 7.0);
    }

    #[test]
    fn an_error_of_the_residuals_ends_the_search() {
        assert_eq!(minimise([60.0, 3.0], FREE, STOP, valley), Err(60.0));
    }
}
