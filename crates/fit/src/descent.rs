//! From a start to the minimum: Newton's method within bounds, on all points at once.
//!
//! The Stribeck velocity goes by its logarithm q. With d = M_S − M_K the gradient of the curve is e, 1 − e, d·h, v, and its
//! only second derivatives are those with q: h, −h and d·h·(x − 1). They make the convergence quadratic, so that from near
//! by one pass over the points or two are enough; and the minimum proves itself: the Hessian is positive definite there,
//! and no parameter at its bound wants to leave it.

use super::points::{Plain, Points, Sums};
use super::projection::Parameters;

/// A minimum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Minimum {
    pub(super) parameters: Parameters<f64>,
    /// Weighted sum of squares.
    pub(super) cost: f64,
    /// JᵀWJ in M_S, M_K, Ω_Strib, b, one step before.
    pub(super) normal: [[f64; 4]; 4],
}

/// Most passes: from the next place of a grid some five are needed.
const PASSES: usize = 30;
/// Smallest pivot of a matrix with ones on its diagonal that rounding has not made.
const PIVOT: f64 = 1e-13;
/// Rise of the sum of squares that is rounding.
const ROUNDING: f64 = 1e-9;

/// Goes down from a start until what is left is a smaller share than `precision`. `None` where it does not go down, or to
/// no minimum that is one: then a slower search has to tell.
pub(super) fn descend(points: &Points, start: Parameters<f64>, bounds: [f64; 2], precision: f64) -> Option<Minimum> {
    let mut parameters = start;
    let (mut last, mut before) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..PASSES {
        let sums = points.sums(parameters);
        // Below the roundings of the torques nothing falls.
        let most = last * (1.0 + ROUNDING) + 1e-28 * points.plain.torque_torque;
        if sums.rr.is_nan() || sums.rr > most {
            return None;
        }
        last = sums.rr;
        let normal = normal(parameters, &points.plain, &sums);
        let (next, moved) = step(parameters, bounds, points, &sums, &normal)?;
        // Quadratic: what is left goes with the square of the step, by as much as it did before, or by 1.
        let bend = if before < 0.1 { (moved / (before * before)).max(1.0) } else { 1.0 };
        let error = bend * moved * moved;
        (parameters, before) = (next, moved);
        if error <= precision && moved <= 1e-3 {
            return Some(Minimum { cost: sums.rr, normal: in_velocity(normal, parameters), parameters });
        }
    }
    None
}

/// One step, and how far it went as a share of each parameter.
fn step(
    mut parameters: Parameters<f64>,
    bounds: [f64; 2],
    points: &Points,
    sums: &Sums,
    normal: &[[f64; 4]; 4],
) -> Option<(Parameters<f64>, f64)> {
    let [breakaway, kinetic, velocity, _] = parameters;
    let drop = breakaway - kinetic;
    let down = [sums.re, sums.r - sums.re, drop * sums.rh, sums.rv];
    let scales: [f64; 4] = std::array::from_fn(|i| 1.0 / normal[i][i].sqrt());
    // What is at its bound stays there unless the sum of squares falls inwards.
    let inwards = |i: usize| down[i] * scales[i] > ROUNDING * sums.rr.sqrt();
    let mut free: [bool; 4] = std::array::from_fn(|i| parameters[i] > 0.0 || inwards(i));
    free[2] = (velocity > bounds[0] || down[2] > 0.0) && (velocity < bounds[1] || down[2] < 0.0);
    let mut hessian = *normal;
    hessian[0][2] -= sums.rh;
    hessian[1][2] += sums.rh;
    hessian[2][2] -= drop * (sums.rhx - sums.rh);
    (hessian[2][0], hessian[2][1]) = (hessian[0][2], hessian[1][2]);
    // Far from the minimum curvature may point anywhere; what Gauss and Newton leave of it does not.
    let solved = |matrix| solve(matrix, &down, &free, &scales);
    let step = solved(&hessian).or_else(|| solved(normal))?;

    let torque = breakaway.max(kinetic);
    let sizes = [torque, torque, 1.0, torque / points.speeds[1]];
    let mut moved = step[2].abs();
    for i in [0, 1, 3] {
        let next = (parameters[i] + step[i]).max(0.0);
        moved = moved.max((next - parameters[i]).abs() / sizes[i]);
        parameters[i] = next;
    }
    // At most a factor of e at once: beyond, the quadratic says nothing.
    parameters[2] = (velocity * libm::exp(step[2].clamp(-1.0, 1.0))).clamp(bounds[0], bounds[1]);
    Some((parameters, moved))
}

/// JᵀWJ in M_S, M_K, q, b.
fn normal([breakaway, kinetic, velocity, _]: Parameters<f64>, plain: &Plain, sums: &Sums) -> [[f64; 4]; 4] {
    let drop = breakaway - kinetic;
    let (ev, falling) = (velocity * sums.h, sums.e - sums.ee);
    let (by_velocity, rest) = (drop * sums.he, drop * (sums.h - sums.he));
    let (v, hv) = (plain.v - ev, drop * sums.hv);
    [
        [sums.ee, falling, by_velocity, ev],
        [falling, plain.one - sums.e - falling, rest, v],
        [by_velocity, rest, drop * drop * sums.hh, hv],
        [ev, v, hv, plain.vv],
    ]
}

/// JᵀWJ of points at a curve, in M_S, M_K, Ω_Strib, b.
pub(super) fn normal_at(points: &Points, parameters: Parameters<f64>) -> [[f64; 4]; 4] {
    in_velocity(normal(parameters, &points.plain, &points.sums(parameters)), parameters)
}

fn in_velocity(mut normal: [[f64; 4]; 4], parameters: Parameters<f64>) -> [[f64; 4]; 4] {
    for k in 0..4 {
        normal[2][k] /= parameters[2];
        normal[k][2] /= parameters[2];
    }
    normal
}

/// Cholesky over the free rows, scaled to ones on the diagonal of JᵀWJ; others do not move.
fn solve(matrix: &[[f64; 4]; 4], right: &[f64; 4], free: &[bool; 4], scales: &[f64; 4]) -> Option<[f64; 4]> {
    let (mut lower, mut solution) = ([[0.0; 4]; 4], [0.0; 4]);
    for i in (0..4).filter(|i| free[*i]) {
        for j in (0..=i).filter(|j| free[*j]) {
            let known: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let left = matrix[i][j] * scales[i] * scales[j] - known;
            if i != j {
                lower[i][j] = left / lower[j][j];
            } else if left > PIVOT {
                lower[i][i] = left.sqrt();
            } else {
                return None;
            }
        }
        let known: f64 = (0..i).map(|k| lower[i][k] * solution[k]).sum();
        solution[i] = (right[i] * scales[i] - known) / lower[i][i];
    }
    for i in (0..4).rev().filter(|i| free[*i]) {
        let known: f64 = (i + 1..4).map(|k| lower[k][i] * solution[k]).sum();
        solution[i] = (solution[i] - known) / lower[i][i];
    }
    Some(std::array::from_fn(|i| solution[i] * scales[i]))
}
