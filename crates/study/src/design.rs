//! Designs of a study: from the number of a case to a place on each axis.
//!
//! A place is a number within 0 … 1, which the axis turns into its value. Each case follows from its number alone, so
//! that a study of millions of cases takes no memory and any part of it can be run separately.

use serde::{Deserialize, Serialize};

use super::{Axis, sobol};
use stickslip_base::noise::Normals;
use stickslip_base::statistics::splitmix;

/// Distribution of the cases.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Design {
    /// Each value of each axis with each of the others; the last axis changes first.
    Grid,
    /// Latin hypercube: each of as many equal parts of an axis as there are cases is met once (McKay et al. 1979).
    LatinHypercube {
        /// Cases.
        samples: u64,
        /// Seed.
        seed: u64,
    },
    /// Sobol's sequence: even, the same each time, and each doubling keeps what there is.
    Sobol {
        /// Cases; a power of two fills evenly.
        samples: u64,
    },
    /// Normals about the means of the axes.
    Normal {
        /// Cases.
        samples: u64,
        /// Seed.
        seed: u64,
        /// Lower triangle L of the correlation of the axes, L·Lᵀ, row by row.
        factor: Vec<Vec<f64>>,
    },
    /// Trajectories that change one axis after the other (Morris 1991), from a random start.
    Morris {
        /// Number of trajectories.
        trajectories: u64,
        /// Levels of an axis; an even number.
        levels: u64,
        /// Seed.
        seed: u64,
    },
    /// For Sobol's indices: two samples A and B, and A with one column after the other of B (Saltelli et al. 2010).
    Saltelli {
        /// Rows of A and of B; a power of two.
        samples: u64,
    },
}

/// Place of a case: within 0 … 1 on each axis, or in standard deviations off the mean.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    Within(Vec<f64>),
    Normal(Vec<f64>),
}

impl Design {
    /// Number of cases; `None` where it overflows.
    pub(super) fn cases(&self, axes: &[Axis]) -> Option<u64> {
        let count = axes.len() as u64;
        match self {
            Design::Grid => axes.iter().try_fold(1_u64, |all, axis| all.checked_mul(axis.levels() as u64)),
            Design::LatinHypercube { samples, .. } | Design::Sobol { samples } | Design::Normal { samples, .. } => {
                Some(*samples)
            }
            Design::Morris { trajectories, .. } => trajectories.checked_mul(count + 1),
            Design::Saltelli { samples } => samples.checked_mul(count + 2),
        }
    }

    /// Place of the case of this number.
    pub(super) fn place(&self, case: u64, axes: &[Axis]) -> Place {
        let count = axes.len();
        let all = 0..count;
        Place::Within(match self {
            Design::Grid => grid(case, axes),
            Design::LatinHypercube { samples, seed } => all.map(|axis| latin(case, axis, *samples, *seed)).collect(),
            // The check of the plan guarantees that each case is a point of the sequence.
            Design::Sobol { .. } => all.map(|axis| sobol::coordinate(case as u32, axis)).collect(),
            Design::Normal { seed, factor, .. } => {
                let normals = Normals::new(*seed);
                let drawn: Vec<f64> = all.map(|axis| normals.pair((axis / 2) as u32, case)[axis % 2]).collect();
                let mixed = |row: &Vec<f64>| row.iter().zip(&drawn).map(|(weight, normal)| weight * normal).sum();
                return Place::Normal(factor.iter().map(mixed).collect());
            }
            Design::Morris { levels, seed, .. } => {
                let cases = count as u64 + 1;
                morris(case / cases, (case % cases) as usize, count, *levels, *seed)
            }
            Design::Saltelli { .. } => {
                let cases = count as u64 + 2;
                let (row, block) = ((case / cases) as u32, (case % cases) as usize);
                // A, then A with each column of B, then B.
                let of_b = |axis: usize| block == count + 1 || block == axis + 1;
                all.map(|axis| sobol::coordinate(row, if of_b(axis) { count + axis } else { axis })).collect()
            }
        })
    }
}

/// The middle of the part of 0 … 1 that belongs to a value.
fn grid(case: u64, axes: &[Axis]) -> Vec<f64> {
    let mut rest = case;
    let mut places: Vec<f64> = axes
        .iter()
        .rev()
        .map(|axis| {
            let levels = axis.levels() as u64;
            let level = rest % levels;
            rest /= levels;
            (level as f64 + 0.5) / levels as f64
        })
        .collect();
    places.reverse();
    places
}

/// Start of an independent random stream; only outputs of [`splitmix`] are mixed, not its state.
fn state(seed: u64, stream: u64, number: u64) -> u64 {
    let mut state = seed;
    let mut state = splitmix(&mut state) ^ stream.wrapping_mul(0xD6E8_FEB8_6659_FD93);
    splitmix(&mut state) ^ number.wrapping_mul(0xA076_1D64_78BD_642F)
}

/// Within 0 … 1, both ends excluded.
fn uniform(state: &mut u64) -> f64 {
    ((splitmix(state) >> 12) as f64 + 0.5) / 4_503_599_627_370_496.0
}

fn latin(case: u64, axis: usize, samples: u64, seed: u64) -> f64 {
    let part = permuted(case, samples, state(seed, axis as u64, 0));
    (part as f64 + uniform(&mut state(seed, axis as u64, case + 1))) / samples as f64
}

/// Position of a number in a permutation of 0 … count − 1: a Feistel network over the bits of the count, repeated until
/// the result is below the count (Black and Rogaway 2002).
fn permuted(number: u64, count: u64, key: u64) -> u64 {
    let half = (64 - (count - 1).leading_zeros()).div_ceil(2).max(1);
    let mask = (1_u64 << half) - 1;
    let mut number = number;
    loop {
        let (mut left, mut right) = (number >> half, number & mask);
        for round in 0..8 {
            (left, right) = (right, left ^ (splitmix(&mut state(key, round, right)) & mask));
        }
        number = left << half | right;
        if number < count {
            return number;
        }
    }
}

/// The case after `step` steps of a trajectory: it starts on the lower or upper half of an even number of levels, and
/// each step moves one axis to the other half.
fn morris(trajectory: u64, step: usize, axes: usize, levels: u64, seed: u64) -> Vec<f64> {
    let mut state = state(seed, u64::MAX, trajectory);
    let half = levels / 2;
    let starts: Vec<u64> = (0..axes).map(|_| splitmix(&mut state) % levels).collect();
    let mut order: Vec<usize> = (0..axes).collect();
    for last in (1..axes).rev() {
        order.swap(last, (splitmix(&mut state) % (last as u64 + 1)) as usize);
    }
    let moved = |axis: usize| order[..step].contains(&axis);
    let level = |axis: usize| if moved(axis) { (starts[axis] + half) % levels } else { starts[axis] };
    (0..axes).map(|axis| level(axis) as f64 / (levels - 1) as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spread;

    fn axes(levels: &[usize]) -> Vec<Axis> {
        let axis = |levels: &usize| Axis {
            name: format!("axis of {levels}"),
            paths: Vec::new(),
            factor: false,
            unit: "1".into(),
            spread: Spread::Values((0..*levels).map(|k| k as f64).collect()),
        };
        levels.iter().map(axis).collect()
    }

    fn within(design: &Design, case: u64, axes: &[Axis]) -> Vec<f64> {
        match design.place(case, axes) {
            Place::Within(places) => places,
            Place::Normal(_) => panic!("places within 0 … 1"),
        }
    }

    #[test]
    fn a_grid_has_each_pair_once_and_the_last_axis_changes_first() {
        let axes = axes(&[2, 3]);
        assert_eq!(Design::Grid.cases(&axes), Some(6));
        let value = |case| {
            let places = within(&Design::Grid, case, &axes);
            [axes[0].value(places[0]), axes[1].value(places[1])]
        };
        assert_eq!([0, 1, 2, 3, 5].map(value), [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [1.0, 0.0], [1.0, 2.0]]);
        let huge = self::axes(&[usize::MAX, 2][..0]);
        assert_eq!(Design::Morris { trajectories: u64::MAX, levels: 4, seed: 1 }.cases(&axes), None);
        assert_eq!(Design::Grid.cases(&huge), Some(1));
    }

    #[test]
    fn a_latin_hypercube_meets_each_part_of_each_axis_once() {
        for samples in [1, 2, 3, 7, 100, 1023] {
            let (design, axes) = (Design::LatinHypercube { samples, seed: 3 }, axes(&[2, 2, 2]));
            for axis in 0..3 {
                let mut parts: Vec<u64> =
                    (0..samples).map(|case| (within(&design, case, &axes)[axis] * samples as f64) as u64).collect();
                let order = parts.clone();
                parts.sort_unstable();
                assert_eq!(parts, (0..samples).collect::<Vec<_>>());
                // By chance alone one of 100! orders.
                assert!(samples < 100 || order != parts, "axis {axis}");
            }
        }
        // Axes are independent: the correlation of 1023 pairs has a standard error of 1/32.
        let (design, axes) = (Design::LatinHypercube { samples: 1023, seed: 3 }, axes(&[2, 2]));
        let product = |case| within(&design, case, &axes).iter().map(|u| u - 0.5).product::<f64>();
        let correlation = 12.0 * (0..1023).map(product).sum::<f64>() / 1023.0;
        assert!(correlation.abs() < 4.0 / 32.0, "{correlation}");
    }

    #[test]
    fn normals_have_the_stated_correlation() {
        let factor = vec![vec![1.0, 0.0], vec![0.8, 0.6]];
        let (design, axes) = (Design::Normal { samples: 20_000, seed: 5, factor }, axes(&[2, 2]));
        let mut sums = [0.0; 5];
        for case in 0..20_000 {
            let Place::Normal(z) = design.place(case, &axes) else { panic!("normals") };
            for (sum, value) in sums.iter_mut().zip([z[0], z[1], z[0] * z[0], z[1] * z[1], z[0] * z[1]]) {
                *sum += value / 20_000.0;
            }
        }
        // Standard errors of 1/√20000 = 0.007 for means, √2 times that for squares; four of them.
        for (sum, expected) in sums.iter().zip([0.0, 0.0, 1.0, 1.0, 0.8]) {
            assert!((sum - expected).abs() < 0.04, "{sums:?}");
        }
    }

    #[test]
    fn a_trajectory_moves_each_axis_once_by_half_of_the_levels() {
        let (levels, axes) = (4, axes(&[2; 5]));
        let design = Design::Morris { trajectories: 20, levels, seed: 9 };
        let mut starts = std::collections::BTreeSet::new();
        for trajectory in 0..20 {
            let cases: Vec<Vec<f64>> = (0..6).map(|step| within(&design, trajectory * 6 + step, &axes)).collect();
            let mut moved: Vec<usize> = cases
                .windows(2)
                .map(|pair| {
                    let moved: Vec<usize> = (0..5).filter(|&axis| pair[0][axis] != pair[1][axis]).collect();
                    let way = (pair[1][moved[0]] - pair[0][moved[0]]).abs();
                    assert!(moved.len() == 1 && (way - 2.0 / 3.0).abs() < 1e-12, "{pair:?}");
                    moved[0]
                })
                .collect();
            moved.sort_unstable();
            assert_eq!(moved, [0, 1, 2, 3, 4]);
            starts.insert(format!("{:?}", cases[0]));
        }
        assert!(starts.len() > 15, "starts differ");
    }

    #[test]
    fn saltelli_takes_one_column_of_the_other_sample_after_the_other() {
        let (design, axes) = (Design::Saltelli { samples: 8 }, axes(&[2; 3]));
        for row in 0..8 {
            let case = |block: u64| within(&design, row * 5 + block, &axes);
            let (a, b) = (case(0), case(4));
            for axis in 0..3 {
                let mut expected = a.clone();
                expected[axis] = b[axis];
                assert_eq!(case(axis as u64 + 1), expected);
            }
            // The first two points have all coordinates alike.
            assert!(row < 2 || a != b);
        }
    }
}
