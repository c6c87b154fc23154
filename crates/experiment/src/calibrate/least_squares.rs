//! Least squares by orthogonal transformations: the information of each segment on the parameters, and of all together.

use nalgebra::{DMatrix, SMatrix, SVector};
use stickslip_core::scalar::{Dual, Scalar};

use super::noise::{MEMORY, Noise, Noises};
use super::parameters::{PARAMETERS, sloped};
use super::response::CHANNELS;
use super::segment::{LEAD_IN, LEVEL, OWN, Segment, Setting, predict};

/// The parameters and a segment's own numbers.
pub(super) const VARIABLES: usize = PARAMETERS + OWN;

/// Bounds of the state of a shaken load at rest: twist [rad], velocities [rad/s], angle [rad], each many times what
/// occurs. Without them a state that decays before the samples count would be undetermined.
const REST: [f64; LEVEL] = [0.01, 1.0, 1.0, 0.01];

/// Over the parameters.
pub(super) type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;
/// Over the parameters.
pub(super) type Vector = SVector<f64, PARAMETERS>;

/// Rows that are collected before they are folded into a triangle.
const ROWS: usize = 256;

/// Least squares by orthogonal transformations, row by row: the triangle R of all rows so far. Normal equations would
/// lose precision once a segment's own numbers are eliminated.
struct Triangle {
    rows: DMatrix<f64>,
    filled: usize,
}

impl Triangle {
    fn new(columns: usize) -> Self {
        Triangle { rows: DMatrix::zeros(columns + ROWS, columns), filled: 0 }
    }

    fn push(&mut self, row: impl Iterator<Item = f64>) {
        if self.filled == self.rows.nrows() {
            self.fold();
        }
        for (column, value) in row.enumerate() {
            self.rows[(self.filled, column)] = value;
        }
        self.filled += 1;
    }

    fn fold(&mut self) {
        let columns = self.rows.ncols();
        let r = self.rows.rows(0, self.filled.max(columns)).into_owned().qr().r();
        self.rows.fill(0.0);
        self.rows.rows_mut(0, columns).copy_from(&r);
        self.filled = columns;
    }

    fn finish(mut self) -> DMatrix<f64> {
        self.fold();
        self.rows.rows(0, self.rows.ncols()).into_owned()
    }
}

/// Information of a segment, as a triangle over its own numbers, the parameters and the right side.
pub(super) struct Block {
    triangle: DMatrix<f64>,
    /// Number of its own numbers: a load at rest has no level of friction.
    own: usize,
}

impl Block {
    pub(super) fn of(coordinates: &[f64; PARAMETERS], segment: &Segment, setting: &Setting, noises: &Noises) -> Self {
        let p = widened(&sloped(coordinates, setting.amplifiers));
        let own: [Dual<VARIABLES>; OWN] = std::array::from_fn(|i| Dual::variable(segment.own[i], PARAMETERS + i));
        let noise = &noises[usize::from(segment.is_stuck())];
        let owned = if segment.is_stuck() { LEVEL } else { OWN };
        let mut triangle = Triangle::new(owned + PARAMETERS + 1);
        let mut past = [[Dual::<VARIABLES>::default(); CHANNELS]; MEMORY];
        predict(&p, &own, segment, setting, |k, _, predicted| {
            let mut now = [Dual::default(); CHANNELS];
            for c in 0..CHANNELS {
                now[c] = predicted[c] - Dual::of(segment.samples[k].measured[c]);
                let Noise { memory, deviation } = noise[c];
                if k < LEAD_IN || !deviation.is_finite() {
                    continue;
                }
                let mut new = now[c];
                for (lag, a) in memory.iter().enumerate() {
                    let Dual { value, gradient } = &past[(k - 1 - lag) % MEMORY][c];
                    new.value -= a * value;
                    for i in 0..VARIABLES {
                        new.gradient[i] -= a * gradient[i];
                    }
                }
                let (of_parameters, of_own) = new.gradient.split_at(PARAMETERS);
                let slopes = of_own[..owned].iter().chain(of_parameters).copied();
                triangle.push(slopes.chain([-new.value]).map(|value| value / deviation));
            }
            past[k % MEMORY] = now;
        });
        if segment.is_stuck() {
            for (i, scale) in REST.iter().enumerate() {
                let own_row = (0..owned).map(|k| if k == i { 1.0 / scale } else { 0.0 });
                let right = std::iter::once(-segment.own[i] / scale);
                triangle.push(own_row.chain([0.0; PARAMETERS]).chain(right));
            }
        }
        Block { triangle: triangle.finish(), own: owned }
    }

    /// Sum of squares at the optimum of its own numbers.
    pub(super) fn cost(&self) -> f64 {
        self.reduced().map(|row| row[PARAMETERS] * row[PARAMETERS]).sum()
    }

    /// Its information on the parameters alone: rows over them and the right side.
    pub(super) fn reduced(&self) -> impl Iterator<Item = [f64; PARAMETERS + 1]> + '_ {
        let (n, size) = (self.own, self.triangle.nrows());
        (n..size).map(move |row| std::array::from_fn(|column| self.triangle[(row, n + column)]))
    }

    /// Moves its own numbers to their optimum after the parameters have moved by `step`.
    pub(super) fn move_own(&self, step: &Vector, own: &mut [f64; OWN]) {
        let n = self.own;
        let mut moved = vec![0.0; n];
        for row in (0..n).rev() {
            let mut rest = self.triangle[(row, n + PARAMETERS)];
            (0..PARAMETERS).for_each(|i| rest -= self.triangle[(row, n + i)] * step[i]);
            (row + 1..n).for_each(|i| rest -= self.triangle[(row, i)] * moved[i]);
            let pivot = self.triangle[(row, row)];
            moved[row] = if pivot.abs() > 1e-9 { rest / pivot } else { 0.0 };
        }
        own.iter_mut().zip(moved).for_each(|(own, moved)| *own += moved);
    }
}

/// The parameters as numbers that have slopes over a segment's own numbers too.
pub(super) fn widened(values: &[Dual<PARAMETERS>; PARAMETERS]) -> [Dual<VARIABLES>; PARAMETERS] {
    values.map(|narrow| {
        let mut dual = Dual::of(narrow.value);
        dual.gradient[..PARAMETERS].copy_from_slice(&narrow.gradient);
        dual
    })
}

/// Information of each segment.
pub(super) fn blocks(
    coordinates: &[f64; PARAMETERS],
    segments: &[Segment],
    setting: &Setting,
    noises: &Noises,
) -> Vec<Block> {
    segments.iter().map(|segment| Block::of(coordinates, segment, setting, noises)).collect()
}

/// Information of all segments on the parameters, as one triangle.
pub(super) fn joined(blocks: &[Block]) -> DMatrix<f64> {
    let mut triangle = Triangle::new(PARAMETERS + 1);
    blocks.iter().flat_map(Block::reduced).for_each(|row| triangle.push(row.into_iter()));
    triangle.finish()
}

/// Step that solves the joined triangle, damped in units of the data's information on each parameter.
pub(super) fn solve(joined: &DMatrix<f64>, damping: f64) -> Vector {
    let mut triangle = Triangle::new(PARAMETERS + 1);
    for row in joined.row_iter().take(PARAMETERS) {
        triangle.push(row.iter().copied());
    }
    for i in 0..PARAMETERS {
        let norm = joined.column(i).norm().max(1e-9);
        triangle.push((0..=PARAMETERS).map(|k| if k == i { norm * damping.sqrt() } else { 0.0 }));
    }
    let r = triangle.finish();
    let mut step = Vector::zeros();
    for row in (0..PARAMETERS).rev() {
        let mut rest = r[(row, PARAMETERS)];
        (row + 1..PARAMETERS).for_each(|i| rest -= r[(row, i)] * step[i]);
        step[row] = rest / r[(row, row)];
    }
    step
}

/// R⁻¹ of the joined triangle; columns of undetermined parameters are huge.
pub(super) fn inverse(joined: &DMatrix<f64>) -> Matrix {
    let mut r = joined.fixed_view::<PARAMETERS, PARAMETERS>(0, 0).into_owned();
    (0..PARAMETERS).for_each(|i| {
        if r[(i, i)].abs() < 1e-9 {
            r[(i, i)] = 1e-9
        }
    });
    r.solve_upper_triangular(&Matrix::identity()).expect("no zero on the diagonal")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::parameters::{self, Amplifiers, Index};
    use crate::calibrate::response::Regime;
    use crate::calibrate::segment::{Sample, residuals};

    #[test]
    fn slopes_are_those_of_differences() {
        slopes_agree(Amplifiers { take_torque: false, are_late: false });
        slopes_agree(Amplifiers { take_torque: true, are_late: true });
    }

    fn slopes_agree(amplifiers: Amplifiers) {
        let preset: stickslip_base::Preset<f64> =
            stickslip_base::parameters::presets::find("clm-bench").unwrap().read().unwrap();
        let mut values = parameters::start(&preset.model);
        (values[Index::TachoSine as usize], values[Index::TachoCosine as usize]) = (0.01, 0.02);
        (values[Index::ServoDelay as usize], values[Index::LoadDelay as usize]) = (0.6e-3, 0.3e-3);
        let at = parameters::coordinates(&values);
        let rubbed = preset.model.own;
        let setting =
            Setting { dt: 250e-6, carriage_ratio: 8e-4, ripple_order: 13, amplifiers, has_instruments: true, rubbed };
        for regime in [Regime::Sliding { level: 0.01, slope: 2e-5 }, Regime::Stuck] {
            let samples: Vec<Sample> = (0..200)
                .map(|k| {
                    let x = f64::from(k);
                    Sample {
                        servo_voltage: 2.0 + libm::sin(0.9 * x * x / 200.0),
                        load_command: libm::sin(1.3 * x * x / 200.0),
                        angle: 0.01 * x,
                        measured: [0.0; 4],
                    }
                })
                .collect();
            let mut segment = Segment::new(regime, samples, 40.0);
            segment.own = [0.01, 40.0, 40.1, 0.3, 0.2];
            let run = |at: [f64; PARAMETERS], own: [f64; OWN]| {
                let mut s = segment.clone();
                s.own = own;
                residuals(&parameters::values(&at), &s, &setting)
            };
            let p = widened(&parameters::sloped(&at, setting.amplifiers));
            let own: [Dual<VARIABLES>; OWN] = std::array::from_fn(|i| Dual::variable(segment.own[i], PARAMETERS + i));
            let mut exact = Vec::new();
            predict(&p, &own, &segment, &setting, |_, _, y| exact.push(y));
            for i in 0..VARIABLES {
                let h = 1e-5;
                let moved = |sign: f64| {
                    let (mut a, mut o) = (at, segment.own);
                    if i < PARAMETERS {
                        a[i] += sign * h
                    } else {
                        o[i - PARAMETERS] += sign * h
                    }
                    run(a, o)
                };
                let (up, down) = (moved(1.0), moved(-1.0));
                for c in 0..4 {
                    let largest = exact.iter().map(|y| y[c].gradient[i].abs()).fold(0.0, f64::max);
                    let free = i >= PARAMETERS || amplifiers.frees(i);
                    let off = (0..if free { 200 } else { 0 })
                        .map(|k| ((down[k][c] - up[k][c]) / (2.0 * h) - exact[k][c].gradient[i]).abs())
                        .fold(0.0, f64::max);
                    // A difference over 1e-5 has its own error of h² times the curvature, and rounding over h.
                    assert!(off <= 1e-4 * largest + 1e-7, "{regime:?} variable {i} channel {c}: {off} of {largest}");
                }
            }
        }
    }
}
