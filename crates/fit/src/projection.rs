//! Variable projection: for a given Stribeck velocity, the other three parameters are linear.
//!
//! In the basis e, 1 − e, v with e = exp(−v/Ω_Strib) the coefficients are M_S, M_K and b, and none may be negative. Three
//! columns have seven subsets, so the best non-negative fit is found by trying all. The rest is a search in one dimension,
//! which a grid makes global: no start values, hence no wrong ones.

use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::Scalar;

/// M_S, M_K, Ω_Strib, b; torque in N m, speed in rad/s.
pub(super) type Parameters<T> = [T; 4];

/// A point in the units of the fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) speed: f64,
    pub(super) torque: f64,
    pub(super) weight: f64,
}

/// Equation (1).
#[inline(always)]
pub(super) fn curve<T: Scalar>(parameters: Parameters<T>) -> Stribeck<T> {
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = parameters;
    let decay = Decay::Exponential;
    Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, decay }
}

/// Weighted sum of squares.
pub(super) fn cost(parameters: Parameters<f64>, samples: &[Sample]) -> f64 {
    let curve = curve(parameters);
    samples.iter().map(|s| s.weight * (s.torque - curve.magnitude(s.speed)).powi(2)).sum()
}

/// Largest spacing of the grid in ln Ω_Strib: the residual of a point changes over 1 and more.
const SPACING: f64 = 0.35;
/// Points of a finer grid between the neighbours of a valley.
const FINER: usize = 8;
/// Smallest independent part of a column, squared: below, the normal equations leave less than two digits.
const INDEPENDENT: f64 = 1e-14;

/// The bottom of a valley of the sum of squares over ln Ω_Strib, on the grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Valley {
    pub(super) parameters: Parameters<f64>,
    /// Explained part of the sum of squares of the torques.
    explained: f64,
    /// ln Ω_Strib of its neighbours.
    between: [f64; 2],
}

/// All valleys within `range` of Ω_Strib; at least one.
pub(super) fn valleys(samples: &[Sample], range: [f64; 2]) -> Vec<Valley> {
    let between = range.map(libm::log);
    let count = ((between[1] - between[0]) / SPACING).ceil().max(1.0) as usize + 1;
    let grid: Vec<Valley> = grid(samples, between, count).collect();
    let last = grid.len() - 1;
    let is_valley = |i: &usize| {
        (*i == 0 || grid[*i].explained >= grid[*i - 1].explained)
            && (*i == last || grid[*i].explained > grid[*i + 1].explained)
    };
    let valleys: Vec<Valley> = (0..=last).filter(is_valley).map(|i| grid[i]).collect();
    // Without one the sums are not finite.
    if valleys.is_empty() { vec![grid[0]] } else { valleys }
}

/// The bottom of a valley by finer and finer grids.
pub(super) fn bottom(samples: &[Sample], valley: Valley) -> Parameters<f64> {
    let mut best = valley;
    // Each iteration leaves two sevenths: twelve bring a spacing of the grid below the square root of the precision.
    for _ in 0..12 {
        let finer = grid(samples, best.between, FINER);
        let Some(deepest) = finer.max_by(|a, b| a.explained.total_cmp(&b.explained)) else { break };
        let between = deepest.between;
        best = if deepest.explained >= best.explained { deepest } else { Valley { between, ..best } };
    }
    best.parameters
}

/// The best fits at a number of values of ln Ω_Strib.
fn grid(samples: &[Sample], [low, high]: [f64; 2], count: usize) -> impl Iterator<Item = Valley> {
    let spacing = (high - low) / (count - 1) as f64;
    let at = move |k: usize| if k + 1 == count { high } else { low + spacing * k as f64 };
    (0..count).map(move |k| {
        let velocity = libm::exp(at(k));
        let (explained, [breakaway, kinetic, viscous]) = project(samples, velocity);
        let between = [at(k.saturating_sub(1)), at((k + 1).min(count - 1))];
        Valley { parameters: [breakaway, kinetic, velocity, viscous], explained, between }
    })
}

/// The best M_S, M_K, b ≥ 0 at a Stribeck velocity, and the explained part of the sum of squares.
fn project(samples: &[Sample], velocity: f64) -> (f64, [f64; 3]) {
    let (mut gram, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for s in samples {
        let e = libm::exp(-s.speed / velocity);
        let row = [e, 1.0 - e, s.speed];
        for i in 0..3 {
            right[i] += s.weight * row[i] * s.torque;
            for j in 0..3 {
                gram[i][j] += s.weight * row[i] * row[j];
            }
        }
    }
    non_negative(&gram, right)
}

/// The best coefficients of three columns, none negative, of all subsets; and the explained part.
fn non_negative(gram: &[[f64; 3]; 3], right: [f64; 3]) -> (f64, [f64; 3]) {
    let mut best = (0.0, [0.0; 3]);
    let mut offer = |coefficients: [f64; 3], independent: bool| {
        let explained = (0..3).map(|i| right[i] * coefficients[i]).sum::<f64>();
        if independent && coefficients.iter().all(|c| *c >= 0.0) && explained > best.0 {
            best = (explained, coefficients);
        }
    };
    let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 1.0 };
    let [[g00, g01, g02], [_, g11, g12], [_, _, g22]] = *gram;
    let [r0, r1, r2] = right;
    let [enough1, enough2] = [g11, g22].map(|g| INDEPENDENT * g);
    let [d0, d1, d2] = [g00, g11, g22].map(inverse);
    offer([r0 * d0, 0.0, 0.0], true);
    offer([0.0, r1 * d1, 0.0], true);
    offer([0.0, 0.0, r2 * d2], true);
    // The first eliminated from the others, by pairs.
    let (l1, l2, l12) = (g01 * d0, g02 * d0, g12 * d1);
    let (p1, p2, p12) = (g11 - l1 * g01, g22 - l2 * g02, g22 - l12 * g12);
    let (y1, y2) = (r1 - l1 * r0, r2 - l2 * r0);
    let q1 = inverse(p1);
    let second = y1 * q1;
    offer([(r0 - g01 * second) * d0, second, 0.0], p1 > enough1);
    let third = y2 * inverse(p2);
    offer([(r0 - g02 * third) * d0, 0.0, third], p2 > enough2);
    let third = (r2 - l12 * r1) * inverse(p12);
    offer([0.0, (r1 - g12 * third) * d1, third], p12 > enough2);
    // The second from the third.
    let m = g12 - l1 * g02;
    let l3 = m * q1;
    let p = p2 - l3 * m;
    let third = (y2 - l3 * y1) * inverse(p);
    let second = (y1 - m * third) * q1;
    offer([(r0 - g01 * second - g02 * third) * d0, second, third], p1 > enough1 && p > enough2);
    best
}

#[cfg(test)]
mod tests {
    use super::super::tests::normal;
    use super::*;

    /// The best of all subsets by Gaussian elimination of their normal equations.
    fn by_subsets(gram: &[[f64; 3]; 3], right: [f64; 3]) -> f64 {
        let mut best = 0.0_f64;
        for subset in 1..8_usize {
            let chosen: Vec<usize> = (0..3).filter(|i| subset >> i & 1 == 1).collect();
            let n = chosen.len();
            let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| gram[chosen[i]][chosen[j]]);
            let side = nalgebra::DVector::from_fn(n, |i, _| right[chosen[i]]);
            let Some(solution) = matrix.lu().solve(&side) else { continue };
            if solution.iter().all(|c| *c >= 0.0) {
                best = best.max(solution.dot(&side));
            }
        }
        best
    }

    #[test]
    fn no_subset_explains_more_than_the_one_that_is_taken() {
        let (mut several, mut lacking) = (0, 0);
        for seed in 0..200 {
            let rows: Vec<[f64; 3]> = (0..6).map(|k| [0, 1, 2].map(|c| normal(seed, 10 * c + k))).collect();
            let torques: Vec<f64> = (0..6).map(|k| normal(seed, 100 + k)).collect();
            let gram = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rows.iter().map(|row| row[i] * row[j]).sum::<f64>()));
            let right = [0, 1, 2].map(|i| rows.iter().zip(&torques).map(|(row, torque)| row[i] * torque).sum::<f64>());
            let (explained, coefficients) = non_negative(&gram, right);
            assert!(coefficients.iter().all(|c| *c >= 0.0));
            // Six rows of condition 1 … 100.
            assert!((explained - by_subsets(&gram, right)).abs() < 1e-9, "{seed}");
            let positive = coefficients.iter().filter(|c| **c > 0.0).count();
            (several, lacking) = (several + usize::from(positive > 1), lacking + usize::from(positive < 3));
        }
        assert!(several > 50 && lacking > 50, "{several} {lacking}");
    }

    #[test]
    fn dependent_columns_are_not_taken_together() {
        let column = [1.0, 2.0, 4.0];
        let gram = [0, 1, 2].map(|i| [0, 1, 2].map(|j| column[i] * column[j] * 3.0));
        let (_, coefficients) = non_negative(&gram, column.map(|c| c * 5.0));
        assert_eq!(coefficients.iter().filter(|c| **c > 0.0).count(), 1, "{coefficients:?}");
    }
}
