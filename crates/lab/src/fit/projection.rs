//! Variable projection: with the Stribeck velocity given, the other three parameters are linear.
//!
//! In the basis 1 − e, e, v with e = exp(−v/Ω_Strib) the coefficients are M_K, M_S and b, and none may be negative.
//! Three columns have seven subsets, so the best non-negative fit is found by trying all. What is left is a search in
//! one dimension, which a grid makes global: no start values, hence none that could be wrong.

use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::Scalar;

use super::stribeck::Sample;

/// M_S, M_K, Ω_Strib, b; torque in N m, speed in rad/s.
pub(super) type Parameters<T> = [T; 4];

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

/// The best parameters over all Stribeck velocities within `range`.
pub(super) fn search(samples: &[Sample], range: [f64; 2]) -> Parameters<f64> {
    const GRID: usize = 96;
    let (low, high) = (libm::log(range[0]), libm::log(range[1]));
    let at = |logarithm: f64| {
        let parameters = project(samples, libm::exp(logarithm).clamp(range[0], range[1]));
        (cost(parameters, samples), parameters)
    };
    let spacing = (high - low) / (GRID - 1) as f64;
    let grid: Vec<_> = (0..GRID).map(|i| at(low + spacing * i as f64)).collect();
    let mut best = grid[0];
    for i in 0..GRID {
        let is_valley = (i == 0 || grid[i].0 <= grid[i - 1].0) && (i + 1 == GRID || grid[i].0 <= grid[i + 1].0);
        if !is_valley {
            continue;
        }
        let middle = low + spacing * i as f64;
        let refined = golden_section(&at, (middle - spacing).max(low), (middle + spacing).min(high));
        for candidate in [grid[i], refined] {
            if candidate.0 < best.0 {
                best = candidate;
            }
        }
    }
    best.1
}

type Valued = (f64, Parameters<f64>);

fn golden_section(at: &impl Fn(f64) -> Valued, mut low: f64, mut high: f64) -> Valued {
    const RATIO: f64 = 0.618_033_988_749_894_8;
    let (mut left, mut right) = (high - RATIO * (high - low), low + RATIO * (high - low));
    let (mut at_left, mut at_right) = (at(left), at(right));
    // The interval shrinks by 0.618 a turn: 40 turns take a grid spacing below the square root of the precision.
    for _ in 0..40 {
        if at_left.0 < at_right.0 {
            (high, right, at_right) = (right, left, at_left);
            left = high - RATIO * (high - low);
            at_left = at(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + RATIO * (high - low);
            at_right = at(right);
        }
    }
    if at_left.0 < at_right.0 { at_left } else { at_right }
}

/// The best M_S, M_K, b ≥ 0 at one Stribeck velocity.
fn project(samples: &[Sample], stribeck_velocity: f64) -> Parameters<f64> {
    let (mut gram, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for s in samples {
        let falling = libm::exp(-s.speed / stribeck_velocity);
        let columns = [falling, 1.0 - falling, s.speed];
        for i in 0..3 {
            right[i] += s.weight * columns[i] * s.torque;
            for j in 0..3 {
                gram[i][j] += s.weight * columns[i] * columns[j];
            }
        }
    }
    let mut best = (0.0, [0.0; 3]);
    for subset in 1..8usize {
        let Some(coefficients) = solve_subset(&gram, &right, subset) else { continue };
        // What the fit explains: the sum of squares falls by right·coefficients.
        let explained: f64 = (0..3).map(|i| right[i] * coefficients[i]).sum();
        if explained > best.0 {
            best = (explained, coefficients);
        }
    }
    let [breakaway, kinetic, viscous] = best.1;
    [breakaway, kinetic, stribeck_velocity, viscous]
}

/// Cholesky on the columns of the subset; `None` if they are dependent or a coefficient is negative.
fn solve_subset(gram: &[[f64; 3]; 3], right: &[f64; 3], subset: usize) -> Option<[f64; 3]> {
    let chosen: Vec<usize> = (0..3).filter(|i| subset >> i & 1 == 1).collect();
    let scale = |i: usize| gram[i][i].sqrt();
    if chosen.iter().any(|&i| scale(i) == 0.0) {
        return None;
    }
    let n = chosen.len();
    let matrix =
        nalgebra::DMatrix::from_fn(n, n, |i, j| gram[chosen[i]][chosen[j]] / (scale(chosen[i]) * scale(chosen[j])));
    let factor = matrix.cholesky()?;
    // A diagonal below 1e-7 leaves less than two digits in the normal equations.
    if (0..n).any(|i| factor.l_dirty()[(i, i)] < 1e-7) {
        return None;
    }
    let solution = factor.solve(&nalgebra::DVector::from_fn(n, |i, _| right[chosen[i]] / scale(chosen[i])));
    let mut coefficients = [0.0; 3];
    for (i, &column) in chosen.iter().enumerate() {
        coefficients[column] = solution[i] / scale(column);
    }
    coefficients.iter().all(|&c| c >= 0.0).then_some(coefficients)
}
