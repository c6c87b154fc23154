//! Variable projection: with the Stribeck velocity given, the other three parameters are linear.
//!
//! In the basis e, 1 − e, v with e = exp(−v/Ω_Strib) the coefficients are M_S, M_K and b, and none may be negative. Three
//! columns have seven subsets, so the best non-negative fit is found by trying all. What is left is a search in one
//! dimension, which a grid makes global: no start values, hence none that could be wrong. Eight Stribeck velocities are
//! tried at once.

use multiversion::multiversion;
use stickslip_core::friction::{Decay, Stribeck};
use stickslip_core::scalar::{Mask as _, Scalar};

use super::points::{Falling, Plain, Points, Sample, WIDTH, Wide};

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

/// Largest distance of the grid in ln Ω_Strib: what a point says of it changes over 1 and more.
const SPACING: f64 = 0.35;
/// What of a column must lie outside the others, squared: below, the normal equations leave less than two digits.
const INDEPENDENT: f64 = 1e-14;

/// The bottom of a valley of the sum of squares over ln Ω_Strib, as the grid has it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Valley {
    pub(super) parameters: Parameters<f64>,
    /// What it takes of the sum of squares of the torques.
    explained: f64,
    /// ln Ω_Strib of its neighbours.
    between: [f64; 2],
}

/// All valleys within `range`, the deepest first; at least one.
pub(super) fn valleys(points: &Points, range: [f64; 2]) -> Vec<Valley> {
    let [low, high] = range.map(libm::log);
    let vectors = ((high - low) / (SPACING * WIDTH as f64)).ceil().max(1.0) as usize;
    let spacing = (high - low) / (vectors * WIDTH - 1) as f64;
    let grid: Vec<Valley> = (0..vectors)
        .flat_map(|k| eight(points, low + spacing * (k * WIDTH) as f64, spacing))
        .map(|it| inside(it, range))
        .collect();
    let last = grid.len() - 1;
    let is_valley = |i: &usize| {
        (*i == 0 || grid[*i].explained >= grid[*i - 1].explained)
            && (*i == last || grid[*i].explained > grid[*i + 1].explained)
    };
    let mut valleys: Vec<Valley> = (0..=last).filter(is_valley).map(|i| grid[i]).collect();
    if valleys.is_empty() {
        // Sums beyond all numbers.
        valleys.push(grid[0]);
    }
    valleys.sort_by(|a, b| b.explained.total_cmp(&a.explained));
    valleys
}

/// The bottom of a valley by ever finer grids.
pub(super) fn bottom(points: &Points, valley: Valley, range: [f64; 2]) -> Valley {
    let mut best = valley;
    // Each turn leaves two sevenths: twelve bring a distance of the grid below the square root of the precision.
    for _ in 0..12 {
        let [low, high] = best.between;
        let deepest =
            eight(points, low, (high - low) / (WIDTH - 1) as f64).max_by(|a, b| a.explained.total_cmp(&b.explained));
        let Some(deepest) = deepest.map(|it| inside(it, range)) else { break };
        let between = deepest.between;
        best = if deepest.explained >= best.explained { deepest } else { Valley { between, ..best } };
    }
    best
}

fn inside(mut valley: Valley, range: [f64; 2]) -> Valley {
    valley.parameters[2] = valley.parameters[2].clamp(range[0], range[1]);
    let [low, high] = range.map(libm::log);
    valley.between = [valley.between[0].max(low), valley.between[1].min(high)];
    valley
}

/// The best fits at eight values of ln Ω_Strib.
fn eight(points: &Points, first: f64, spacing: f64) -> impl Iterator<Item = Valley> {
    let mut logarithms = Wide::of(first);
    for (lane, logarithm) in logarithms.0.iter_mut().enumerate() {
        *logarithm += spacing * lane as f64;
    }
    let velocities = logarithms.exp();
    let (explained, coefficients) = project(&points.plain, &points.falling(velocities));
    (0..WIDTH).map(move |lane| {
        let [breakaway, kinetic, viscous] = coefficients.map(|it| it.0[lane]);
        Valley {
            parameters: [breakaway, kinetic, velocities.0[lane], viscous],
            explained: explained.0[lane],
            between: [-spacing, spacing].map(|way| logarithms.0[lane] + way),
        }
    })
}

/// The best M_S, M_K, b ≥ 0 at each of eight Stribeck velocities, and what they explain of the sum of squares.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn project(plain: &Plain, falling: &Falling) -> (Wide, [Wide; 3]) {
    let &Falling { e, ee, ev, e_torque } = falling;
    let of = Wide::of;
    let (mixed, v) = (e - ee, of(plain.v) - ev);
    let gram = [[ee, mixed, ev], [mixed, of(plain.one) - e - mixed, v], [ev, v, of(plain.vv)]];
    non_negative(&gram, [e_torque, of(plain.torque) - e_torque, of(plain.v_torque)])
}

/// The best coefficients of three columns, none negative, of all subsets; and what they explain.
#[inline(always)]
fn non_negative<T: Scalar>(gram: &[[T; 3]; 3], right: [T; 3]) -> (T, [T; 3]) {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let mut best = (zero, [zero; 3]);
    // A macro, since a closure would stay a call.
    macro_rules! offer {
        ($coefficients:expr, $independent:expr) => {{
            let [a, b, c]: [T; 3] = $coefficients;
            let explained = right[0] * a + right[1] * b + right[2] * c;
            let allowed = a.ge(zero) & b.ge(zero) & c.ge(zero) & $independent;
            let better = allowed & explained.gt(best.0);
            best.0 = better.select(explained, best.0);
            best.1 = [better.select(a, best.1[0]), better.select(b, best.1[1]), better.select(c, best.1[2])];
        }};
    }
    let inverse = |x: T| one / x.gt(zero).select(x, one);
    let [[g00, g01, g02], [_, g11, g12], [_, _, g22]] = *gram;
    let [r0, r1, r2] = right;
    let [enough1, enough2] = [g11, g22].map(|g| T::of(INDEPENDENT) * g);
    let [d0, d1, d2] = [g00, g11, g22].map(inverse);
    let any = zero.le(zero);
    offer!([r0 * d0, zero, zero], any);
    offer!([zero, r1 * d1, zero], any);
    offer!([zero, zero, r2 * d2], any);
    // The first eliminated from the others, by pairs.
    let (l1, l2, l12) = (g01 * d0, g02 * d0, g12 * d1);
    let (p1, p2, p12) = (g11 - l1 * g01, g22 - l2 * g02, g22 - l12 * g12);
    let (y1, y2) = (r1 - l1 * r0, r2 - l2 * r0);
    let q1 = inverse(p1);
    let second = y1 * q1;
    offer!([(r0 - g01 * second) * d0, second, zero], p1.gt(enough1));
    let third = y2 * inverse(p2);
    offer!([(r0 - g02 * third) * d0, zero, third], p2.gt(enough2));
    let third = (r2 - l12 * r1) * inverse(p12);
    offer!([zero, (r1 - g12 * third) * d1, third], p12.gt(enough2));
    // The second from the third.
    let m = g12 - l1 * g02;
    let l3 = m * q1;
    let p = p2 - l3 * m;
    let third = (y2 - l3 * y1) * inverse(p);
    let second = (y1 - m * third) * q1;
    offer!([(r0 - g01 * second - g02 * third) * d0, second, third], p1.gt(enough1) & p.gt(enough2));
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
