//! Sensitivities: elementary effects and Sobol's indices, from the numbers of all cases in their order.

use stickslip_base::statistics::{bootstrap, mean};

/// Elementary effects of an axis: change of a measure over change of the place within 0 … 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Effects {
    /// μ*: mean of their magnitudes; importance of the axis.
    pub(super) magnitude: f64,
    /// 95 % interval of μ* over the trajectories.
    pub(super) ci95: [f64; 2],
    /// σ: their standard deviation; large where the axis has a nonlinear effect or interacts with others.
    pub(super) sd: f64,
}

/// The effects of each axis over trajectories of as many steps as there are axes, with the places of each case; a
/// non-finite value only invalidates its own effect. Morris, *Technometrics* 33 (1991); μ* by Campolongo et al. (2007).
pub(super) fn elementary_effects(axes: usize, values: &[f64], places: impl Fn(u64) -> Vec<f64>) -> Vec<Effects> {
    let mut effects: Vec<Vec<f64>> = vec![Vec::new(); axes];
    for (trajectory, values) in values.chunks_exact(axes + 1).enumerate() {
        let begin = (trajectory * (axes + 1)) as u64;
        let mut before = places(begin);
        for step in 0..axes {
            let after = places(begin + step as u64 + 1);
            let moved = (0..axes).find(|&axis| after[axis] != before[axis]);
            let axis = moved.expect("each step of a trajectory moves an axis");
            let effect = (values[step + 1] - values[step]) / (after[axis] - before[axis]);
            effects[axis].extend(effect.is_finite().then_some(effect));
            before = after;
        }
    }
    effects.iter().map(|of_axis| judged(of_axis)).collect()
}

fn judged(effects: &[f64]) -> Effects {
    if effects.len() < 2 {
        return Effects { magnitude: f64::NAN, ci95: [f64::NAN; 2], sd: f64::NAN };
    }
    let magnitude = |drawn: &mut dyn ExactSizeIterator<Item = f64>| mean(drawn.map(f64::abs));
    let centre = mean(effects.iter().copied());
    let squares: f64 = effects.iter().map(|effect| (effect - centre) * (effect - centre)).sum();
    Effects {
        magnitude: magnitude(&mut effects.iter().copied()),
        ci95: bootstrap(effects.len(), |drawn| magnitude(&mut drawn.iter().map(|&k| effects[k]))),
        sd: libm::sqrt(squares / (effects.len() - 1) as f64),
    }
}

/// A share of the variance of a measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Share {
    pub(super) value: f64,
    /// 95 % interval over the rows of the samples.
    pub(super) ci95: [f64; 2],
}

/// Sobol's indices of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Indices {
    /// Share of the axis alone.
    pub(super) first: Share,
    /// Share of the axis with all interactions.
    pub(super) total: Share,
}

/// The indices of each axis from rows of A, A with each column of B, B. Rows with a non-finite value are omitted;
/// `None` where fewer than two are left, or nothing varies.
///
/// S = mean(f_B·(f_AB − f_A))/V, Saltelli et al. (2010), table 2 (b); S_T = mean((f_A − f_AB)²)/(2V), Jansen (1999).
pub(super) fn sobol_indices(axes: usize, values: &[f64]) -> Option<Vec<Indices>> {
    let whole = |row: &&[f64]| row.iter().all(|value| value.is_finite());
    let rows: Vec<&[f64]> = values.chunks_exact(axes + 2).filter(whole).collect();
    let centre = mean(rows.iter().map(|row| 0.5 * (row[0] + row[axes + 1])));
    let square = |value: f64| (value - centre) * (value - centre);
    let spread = |row: &[f64]| 0.5 * (square(row[0]) + square(row[axes + 1]));
    if rows.len() < 2 || rows.iter().all(|row| spread(row) == 0.0) {
        return None;
    }
    let share = |part: &dyn Fn(&[f64]) -> f64| {
        let of = |drawn: &[usize]| {
            let (parts, all) =
                drawn.iter().fold((0.0, 0.0), |(parts, all), &k| (parts + part(rows[k]), all + spread(rows[k])));
            parts / all
        };
        let all: Vec<usize> = (0..rows.len()).collect();
        Share { value: of(&all), ci95: bootstrap(rows.len(), of) }
    };
    let indices = |axis: usize| Indices {
        first: share(&|row| (row[axes + 1] - centre) * (row[axis + 1] - row[0])),
        total: share(&|row| 0.5 * (row[0] - row[axis + 1]) * (row[0] - row[axis + 1])),
    };
    Some((0..axes).map(indices).collect())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::design::Place;
    use crate::{Axis, Design, Spread};

    fn axes(count: usize) -> Vec<Axis> {
        let axis = |k: usize| Axis {
            name: format!("x{k}"),
            paths: Vec::new(),
            factor: false,
            unit: "1".into(),
            spread: Spread::Range { low: 0.0, high: 1.0, logarithmic: false },
        };
        (0..count).map(axis).collect()
    }

    fn place(design: &Design, case: u64, axes: &[Axis]) -> Vec<f64> {
        let Place::Within(places) = design.place(case, axes) else { panic!("places") };
        places
    }

    fn values(design: &Design, axes: &[Axis], function: impl Fn(&[f64]) -> f64) -> Vec<f64> {
        (0..design.cases(axes).unwrap()).map(|case| function(&place(design, case, axes))).collect()
    }

    /// Ishigami and Homma (1990), a = 7, b = 0.1, on places within 0 … 1.
    fn ishigami(places: &[f64]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| TAU * places[k] - PI);
        libm::sin(x) + 7.0 * libm::sin(y) * libm::sin(y) + 0.1 * libm::pow(z, 4.0) * libm::sin(x)
    }

    #[test]
    fn the_indices_of_ishigami_are_the_known_ones() {
        let (design, axes) = (Design::Saltelli { samples: 4096 }, axes(3));
        let indices = sobol_indices(3, &values(&design, &axes, ishigami)).unwrap();
        // V₁ = (1 + bπ⁴/5)²/2, V₂ = a²/8, V₁₃ = 8b²π⁸/225.
        let (first, second) = (0.5 * libm::pow(1.0 + 0.1 * libm::pow(PI, 4.0) / 5.0, 2.0), 49.0 / 8.0);
        let together = 8.0 * 0.01 * libm::pow(PI, 8.0) / 225.0;
        let all = first + second + together;
        let expected = [[first / all, (first + together) / all], [second / all, second / all], [0.0, together / all]];
        for (index, expected) in indices.iter().zip(expected) {
            for (share, expected) in [index.first, index.total].into_iter().zip(expected) {
                // An even sample of 4096; a random sample would give 0.03.
                assert!((share.value - expected).abs() < 0.01, "{indices:?}");
                assert!(share.ci95[0] <= expected && expected <= share.ci95[1], "{indices:?}");
                assert!(share.ci95[1] - share.ci95[0] < 0.2, "{indices:?}");
            }
        }
    }

    #[test]
    fn a_sum_has_the_shares_of_its_terms_and_missing_rows_are_left_out() {
        let (design, axes) = (Design::Saltelli { samples: 1024 }, axes(3));
        let mut values = values(&design, &axes, |x| 5.0 + x[0] - 2.0 * x[1] + 3.0 * x[2]);
        // One hole a row of 5, in two rows.
        values[17] = f64::NAN;
        values[500] = f64::INFINITY;
        let indices = sobol_indices(3, &values).unwrap();
        for (index, expected) in indices.iter().zip([1.0 / 14.0, 4.0 / 14.0, 9.0 / 14.0]) {
            assert!((index.first.value - expected).abs() < 0.01, "{indices:?}");
            assert!((index.total.value - expected).abs() < 0.01, "{indices:?}");
        }
        assert_eq!(sobol_indices(3, &[1.0; 50]), None);
        assert_eq!(sobol_indices(3, &[f64::NAN; 50]), None);
    }

    #[test]
    fn effects_of_a_sum_are_its_factors_and_do_not_scatter() {
        let (design, axes) = (Design::Morris { trajectories: 10, levels: 4, seed: 1 }, axes(3));
        let places = |case| place(&design, case, &axes);
        let sum = values(&design, &axes, |x| 5.0 + x[0] - 2.0 * x[1]);
        let effects = elementary_effects(3, &sum, places);
        for (effects, expected) in effects.iter().zip([1.0, 2.0, 0.0]) {
            assert!((effects.magnitude - expected).abs() < 1e-12 && effects.sd < 1e-12, "{effects:?}");
            assert!((effects.ci95[1] - effects.ci95[0]).abs() < 1e-12, "{effects:?}");
        }
        // The product scatters, with a mean of 0 for each: only the magnitudes show it.
        let product = values(&design, &axes, |x| (x[0] - 0.5) * (x[1] - 0.5));
        let effects = elementary_effects(3, &product, places);
        assert!(effects[0].magnitude > 0.1 && effects[0].sd > 0.1 && effects[2].magnitude == 0.0, "{effects:?}");
        let mut holes = sum.clone();
        holes[0] = f64::NAN;
        assert!((elementary_effects(3, &holes, places)[1].magnitude - 2.0).abs() < 1e-12);
        assert!(elementary_effects(3, &[f64::NAN; 40], places)[0].magnitude.is_nan());
    }

    #[test]
    fn effects_of_ishigami_are_those_of_its_levels() {
        let (design, axes) = (Design::Morris { trajectories: 400, levels: 4, seed: 2 }, axes(3));
        let effects = elementary_effects(3, &values(&design, &axes, ishigami), |case| place(&design, case, &axes));
        // On the levels −π, −π/3, π/3, π a step of the second goes from sin² = 0 to 3/4 and back: 7·(3/4)/(2/3) always.
        assert!((effects[1].magnitude - 7.875).abs() < 1e-9 && effects[1].sd > 7.0, "{effects:?}");
        // The third acts through the first alone: half of the steps have sin(x) = 0.
        assert!(effects[2].magnitude > 1.0 && effects[2].sd > effects[2].magnitude, "{effects:?}");
    }
}
