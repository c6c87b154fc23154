//! Output-error fit of the linear response over segments, each with a start of its own.
//!
//! What went to the converters is known exactly, and nothing else drives the machine: the prediction is a simulation, and
//! its errors are those of the instruments. Segments keep what the model lacks from adding up: each has its own state at
//! the begin, its own friction level and its own ripple of the tacho, which are eliminated from the normal equations
//! (Golub & Pereyra 1973). Each channel's residuals are whitened by an autoregression of their own, so that the
//! covariance is that of correlated noise.

use nalgebra::{DMatrix, SMatrix, SVector};
use stickslip_core::friction::Stribeck;
use stickslip_core::scalar::{Dual, Scalar};

use super::parameters::{Index, PARAMETERS, SOUGHT};
use super::response::{Acting, CHANNELS, Regime, Response, STATES};
use crate::{Error, Watch};

/// What each segment has of its own: twist, both velocities and angle at its begin, friction level, ripple of the tacho
/// by sine and cosine.
const OWN: usize = 7;
const LEVEL: usize = 4;
const RIPPLE: usize = 5;
/// Ticks at the begin of a segment that do not count: in them forgets what has no number of its own (motor torque,
/// current, instruments), whose time constants are a millisecond at most.
pub(super) const LEAD_IN: usize = 40;
const VARIABLES: usize = PARAMETERS + OWN;
/// Order of the autoregression that whitens the residuals.
const MEMORY: usize = 4;
/// Most steps of a descent.
const STEPS: usize = 25;
/// Longest step, in logarithms: beyond, the linear model says nothing.
const LONGEST: f64 = 0.7;
/// Ticks to both sides over which the encoder's speed is taken for the little that is left of the Stribeck drop.
const SMOOTHING: usize = 10;
/// Highest order of the tacho's ripple that is looked for, in periods a revolution.
const HIGHEST_ORDER: usize = 64;

/// What was measured at a tick, and what acted from then on until the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// At the servo amplifier [V].
    pub(super) servo_voltage: f64,
    /// At the load motor's winding [V].
    pub(super) winding_voltage: f64,
    /// Of the screw, from its zero [rad].
    pub(super) angle: f64,
    /// What is left of the Stribeck drop at its speed, of the velocity's sign [N m].
    pub(super) drop: f64,
    /// Angle [rad] since the begin of the segment, tacho [V], accelerometer [V], current [A].
    pub(super) measured: [f64; CHANNELS],
}

/// A piece of a record over which the model is believed without a disturbance.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Segment {
    /// How the contacts behave.
    pub(super) regime: Regime,
    /// One a tick.
    pub(super) samples: Vec<Sample>,
    /// Where the search for its state starts.
    pub(super) own: [f64; OWN],
}

impl Segment {
    /// At this speed [rad/s] by the set-point.
    pub(super) fn new(regime: Regime, samples: Vec<Sample>, velocity: f64) -> Self {
        let mut own = [0.0; OWN];
        (own[1], own[2]) = (velocity, velocity);
        Segment { regime, samples, own }
    }

    /// Counts with what is left of the drop of a friction curve at the speeds of the encoder.
    pub(super) fn count_drop(&mut self, curve: &Stribeck<f64>, dt: f64) {
        let angles: Vec<f64> = self.samples.iter().map(|sample| sample.angle).collect();
        for (k, sample) in self.samples.iter_mut().enumerate() {
            let (from, to) = (k.saturating_sub(SMOOTHING), (k + SMOOTHING).min(angles.len() - 1));
            let velocity = (angles[to] - angles[from]) / ((to - from) as f64 * dt);
            sample.drop = libm::copysign(curve.level(velocity.abs()) - curve.kinetic_torque, velocity);
        }
    }

    /// Level of the load's friction that the fit found [N m].
    pub(super) fn friction_level(&self) -> f64 {
        self.own[LEVEL]
    }

    fn index(&self) -> usize {
        usize::from(self.regime == Regime::Stuck)
    }
}

/// What is fixed for all segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Setting {
    /// Time of a tick [s].
    pub(super) dt: f64,
    /// h/2π [m/rad].
    pub(super) carriage_ratio: f64,
    /// Periods of the tacho's ripple in a revolution; 0 for none.
    pub(super) ripple_order: usize,
}

/// What is known of a channel's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Noise {
    /// Coefficients of the autoregression.
    pub(super) memory: [f64; MEMORY],
    /// Standard deviation of what is new in each tick; infinite for a channel that does not count.
    pub(super) deviation: f64,
}

/// Of each channel: sliding, stuck.
pub(super) type Noises = [[Noise; CHANNELS]; 2];

/// The predicted channels at each tick of a segment.
fn predict<T: Scalar>(
    p: &[T; PARAMETERS],
    own: &[T; OWN],
    segment: &Segment,
    setting: &Setting,
    mut visit: impl FnMut(usize, [T; CHANNELS]),
) {
    let response = Response::new(p, segment.regime, setting.dt);
    let get = |index: Index| p[index as usize];
    let per_angle = get(Index::AccelerometerScale) * T::of(setting.carriage_ratio);
    let offset = get(Index::AccelerometerScale) * get(Index::AccelerometerOffset);
    let first = &segment.samples[0];
    let torque = get(Index::TorquePerVolt) * T::of(first.servo_voltage);
    let [twist, motor, load, angle] = [own[0], own[1], own[2], own[3]];
    let none = T::of(0.0);
    let mut state: [T; STATES] = [twist, motor, load, T::of(first.measured[3]), torque, angle, motor, none, none];
    let level = if let Regime::Sliding { level, .. } = segment.regime { level } else { 0.0 };
    let order = setting.ripple_order as f64;
    let mut before = state[1];
    for (k, sample) in segment.samples.iter().enumerate() {
        let tacho = get(Index::TachoScale) * state[6];
        visit(k, [state[5], tacho, per_angle * state[7] + offset, state[3] + get(Index::CurrentOffset)]);
        let (mut load_resistance, mut ripple_velocity) = (T::of(0.0), T::of(0.0));
        if segment.regime != Regime::Stuck {
            // What depends on the angle is taken in the middle of the tick.
            let next = segment.samples.get(k + 1).map_or(sample.angle, |next| next.angle);
            let middle = 0.5 * (sample.angle + next);
            let (sin, cos) = libm::sincos(middle);
            let ripple = get(Index::RippleCosine) * T::of(cos) + get(Index::RippleSine) * T::of(sin);
            load_resistance = own[LEVEL] * (T::of(1.0) + ripple) + T::of(sample.drop);
            if order > 0.0 {
                // The motor is ahead of the screw by the twist, which is small.
                let (sin, cos) = libm::sincos(order * middle);
                let ahead = T::of(order) * state[0];
                let ripple = own[RIPPLE] * (T::of(sin) + ahead * T::of(cos))
                    + own[RIPPLE + 1] * (T::of(cos) - ahead * T::of(sin));
                let velocity = state[1] + T::of(0.5) * (state[1] - before);
                ripple_velocity = velocity * ripple;
            }
        }
        before = state[1];
        let acting = Acting {
            servo_voltage: T::of(sample.servo_voltage),
            winding_voltage: T::of(sample.winding_voltage),
            motor_resistance: T::of(level),
            load_resistance,
            ripple_velocity,
        };
        response.step(&mut state, acting);
    }
}

/// Measured minus predicted, each channel in its unit.
pub(super) fn residuals(values: &[f64; PARAMETERS], segment: &Segment, setting: &Setting) -> Vec<[f64; CHANNELS]> {
    let mut out = Vec::with_capacity(segment.samples.len());
    predict(values, &segment.own, segment, setting, |k, predicted| {
        out.push(std::array::from_fn(|c| segment.samples[k].measured[c] - predicted[c]));
    });
    out
}

type Matrix = SMatrix<f64, PARAMETERS, PARAMETERS>;
type Vector = SVector<f64, PARAMETERS>;

/// Rows that are collected before they are folded into a triangle.
const ROWS: usize = 256;

/// Least squares by orthogonal transformations, row by row: the triangle R of all rows so far. Normal equations would
/// lose what is left of the parameters once a segment's own numbers are eliminated.
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

/// What a segment says, as a triangle over its own numbers, the parameters and the right side.
struct Block {
    triangle: DMatrix<f64>,
    /// Which of its own numbers it has.
    own: Vec<usize>,
}

impl Block {
    fn of(coordinates: &[f64; PARAMETERS], segment: &Segment, setting: &Setting, noises: &Noises) -> Self {
        let p = widened(&super::parameters::sloped(coordinates));
        let own: [Dual<VARIABLES>; OWN] = std::array::from_fn(|i| Dual::variable(segment.own[i], PARAMETERS + i));
        let noise = &noises[segment.index()];
        let owned: Vec<usize> = match segment.regime {
            Regime::Stuck => (0..LEVEL).collect(),
            Regime::Sliding { .. } if setting.ripple_order == 0 => (0..=LEVEL).collect(),
            Regime::Sliding { .. } => (0..OWN).collect(),
        };
        let mut triangle = Triangle::new(owned.len() + PARAMETERS + 1);
        let mut past = [[Dual::<VARIABLES>::default(); CHANNELS]; MEMORY];
        predict(&p, &own, segment, setting, |k, predicted| {
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
                let sensitivities =
                    owned.iter().map(|i| new.gradient[PARAMETERS + i]).chain(new.gradient.into_iter().take(PARAMETERS));
                triangle.push(sensitivities.chain([-new.value]).map(|value| value / deviation));
            }
            past[k % MEMORY] = now;
        });
        Block { triangle: triangle.finish(), own: owned }
    }

    /// Sum of squares.
    fn cost(&self) -> f64 {
        self.triangle.column(self.triangle.ncols() - 1).norm_squared()
    }

    /// What it says of the parameters alone: rows over them and the right side.
    fn reduced(&self) -> impl Iterator<Item = [f64; PARAMETERS + 1]> + '_ {
        let (n, size) = (self.own.len(), self.triangle.nrows());
        (n..size).map(move |row| std::array::from_fn(|column| self.triangle[(row, n + column)]))
    }

    /// Moves its own numbers to where they are best once the parameters have moved by `step`.
    fn move_own(&self, step: &Vector, own: &mut [f64; OWN]) {
        let n = self.own.len();
        let mut moved = vec![0.0; n];
        for row in (0..n).rev() {
            let mut left = self.triangle[(row, n + PARAMETERS)];
            (0..PARAMETERS).for_each(|i| left -= self.triangle[(row, n + i)] * step[i]);
            (row + 1..n).for_each(|i| left -= self.triangle[(row, i)] * moved[i]);
            let pivot = self.triangle[(row, row)];
            moved[row] = if pivot.abs() > 1e-9 { left / pivot } else { 0.0 };
        }
        self.own.iter().zip(moved).for_each(|(i, moved)| own[*i] += moved);
    }
}

/// The parameters as numbers that have slopes over a segment's own numbers too.
fn widened(values: &[Dual<PARAMETERS>; PARAMETERS]) -> [Dual<VARIABLES>; PARAMETERS] {
    values.map(|narrow| {
        let mut dual = Dual::of(narrow.value);
        dual.gradient[..PARAMETERS].copy_from_slice(&narrow.gradient);
        dual
    })
}

/// All segments' say on the parameters, as one triangle.
fn joined(blocks: &[Block]) -> DMatrix<f64> {
    let mut triangle = Triangle::new(PARAMETERS + 1);
    blocks.iter().flat_map(Block::reduced).for_each(|row| triangle.push(row.into_iter()));
    triangle.finish()
}

/// Step that solves the joined triangle, damped in units of what the data say of each parameter.
fn solve(joined: &DMatrix<f64>, damping: f64) -> Vector {
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
        let mut left = r[(row, PARAMETERS)];
        (row + 1..PARAMETERS).for_each(|i| left -= r[(row, i)] * step[i]);
        step[row] = left / r[(row, row)];
    }
    step
}

/// R⁻¹ of the joined triangle; columns of what nothing is known of are huge.
fn inverse(joined: &DMatrix<f64>) -> Matrix {
    let mut r = joined.fixed_view::<PARAMETERS, PARAMETERS>(0, 0).into_owned();
    (0..PARAMETERS).for_each(|i| {
        if r[(i, i)].abs() < 1e-9 {
            r[(i, i)] = 1e-9
        }
    });
    r.solve_upper_triangular(&Matrix::identity()).expect("no zero on the diagonal")
}

/// What the fit found.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// In the search's coordinates.
    pub(super) coordinates: [f64; PARAMETERS],
    /// Covariance of the values by the noise.
    pub(super) covariance: Matrix,
    /// The segments, each with its own numbers.
    pub(super) segments: Vec<Segment>,
    /// With the ripple that was found.
    pub(super) setting: Setting,
}

/// Seeks the parameters from a start.
pub(super) fn fit(
    start: [f64; PARAMETERS],
    mut segments: Vec<Segment>,
    mut setting: Setting,
    rough: [f64; CHANNELS],
    watch: &Watch,
) -> Result<Solution, Error> {
    let mut coordinates = start;
    // At first every channel is taken for bad, so that none rules before the model is near, and a third of the data do.
    let rough = rough.map(|deviation| Noise { memory: [0.0; MEMORY], deviation });
    let mut noises: Noises = [rough, rough];
    noises[1][0].deviation = f64::INFINITY;
    let mut first: Vec<Segment> = segments.iter().step_by(3).cloned().collect();
    // Five descents, of which most end early.
    let stage = |descent: usize| {
        move |step: usize| watch.stage("fit of the drive", (descent as f64 + step as f64 / STEPS as f64) / 5.0)
    };
    descend(&mut coordinates, &mut first, &setting, &noises, STEPS, &stage(0))?;
    setting.ripple_order = ripple_order(&coordinates, &first, &setting);
    learn_noise(&mut noises, &coordinates, &first, &setting, 0);
    descend(&mut coordinates, &mut first, &setting, &noises, STEPS, &stage(1))?;
    // Then all of them, twice under the noise that is left.
    learn_noise(&mut noises, &coordinates, &first, &setting, 0);
    descend(&mut coordinates, &mut segments, &setting, &noises, STEPS, &stage(2))?;
    for round in [3, 4] {
        learn_noise(&mut noises, &coordinates, &segments, &setting, MEMORY);
        descend(&mut coordinates, &mut segments, &setting, &noises, STEPS, &stage(round))?;
    }
    let blocks = blocks(&coordinates, &segments, &setting, &noises);
    let root = inverse(&joined(&blocks));
    let information_inverse = root * root.transpose();
    let sloped = super::parameters::sloped(&coordinates);
    let jacobian = Matrix::from_fn(|i, j| sloped[i].gradient[j]);
    let covariance = jacobian * information_inverse * jacobian.transpose();
    Ok(Solution { coordinates, covariance, segments, setting })
}

fn blocks(coordinates: &[f64; PARAMETERS], segments: &[Segment], setting: &Setting, noises: &Noises) -> Vec<Block> {
    segments.iter().map(|segment| Block::of(coordinates, segment, setting, noises)).collect()
}

/// Levenberg and Marquardt, in the parameters; the segments' own numbers, which are linear, follow exactly.
fn descend(
    coordinates: &mut [f64; PARAMETERS],
    segments: &mut [Segment],
    setting: &Setting,
    noises: &Noises,
    steps: usize,
    tell: &dyn Fn(usize) -> Result<(), Error>,
) -> Result<(), Error> {
    // The own numbers first, at the parameters of the start.
    for segment in segments.iter_mut() {
        Block::of(coordinates, segment, setting, noises).move_own(&Vector::zeros(), &mut segment.own);
    }
    let mut now = blocks(coordinates, segments, setting, noises);
    let mut damping = 1e-3;
    for step in 0..steps {
        tell(step)?;
        let cost: f64 = now.iter().map(Block::cost).sum();
        let wanted = solve(&joined(&now), damping);
        // All of it or a part of all: parameters that hold each other must not part.
        let tied = (0..PARAMETERS).filter(|i| SOUGHT[*i].scale == 0.0 && !Index::is_loose(*i));
        let longest = tied.map(|i| wanted[i].abs()).fold(0.0, f64::max);
        let mut taken = wanted * (LONGEST / longest.max(LONGEST));
        (0..PARAMETERS).filter(|i| Index::is_loose(*i)).for_each(|i| taken[i] = taken[i].clamp(-LONGEST, LONGEST));
        let next: [f64; PARAMETERS] = std::array::from_fn(|i| coordinates[i] + taken[i]);
        let mut trial = segments.to_vec();
        for (segment, block) in trial.iter_mut().zip(&now) {
            block.move_own(&taken, &mut segment.own);
        }
        let candidate = blocks(&next, &trial, setting, noises);
        let reached: f64 = candidate.iter().map(Block::cost).sum();
        if reached <= cost * (1.0 + 1e-10) {
            *coordinates = next;
            segments.clone_from_slice(&trial);
            now = candidate;
            damping *= 0.1;
            // A fall of less than 1e-3 of a standard deviation's worth moves nothing that matters.
            if cost - reached < 1e-3 {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    Ok(())
}

/// Autoregression and new noise of each channel from what the fit leaves (Yule and Walker).
fn learn_noise(
    noises: &mut Noises,
    coordinates: &[f64; PARAMETERS],
    segments: &[Segment],
    setting: &Setting,
    order: usize,
) {
    let values = super::parameters::values(coordinates);
    let mut products = [[[0.0; MEMORY + 1]; CHANNELS]; 2];
    let mut counts = [0.0; 2];
    for segment in segments {
        let left = residuals(&values, segment, setting);
        counts[segment.index()] += (left.len() - LEAD_IN) as f64;
        for k in LEAD_IN..left.len() {
            for c in 0..CHANNELS {
                for lag in 0..=MEMORY {
                    products[segment.index()][c][lag] += left[k][c] * left[k - lag][c];
                }
            }
        }
    }
    for regime in 0..2 {
        for c in 0..CHANNELS {
            if counts[regime] == 0.0 || !noises[regime][c].deviation.is_finite() {
                continue;
            }
            let (memory, share) = levinson(&products[regime][c], order);
            let deviation = libm::sqrt(share * products[regime][c][0] / counts[regime]).max(1e-9);
            noises[regime][c] = Noise { memory, deviation };
        }
    }
}

/// Autoregression of an order from autocovariances, and the share of the variance that is new (Levinson and Durbin).
fn levinson(r: &[f64; MEMORY + 1], order: usize) -> ([f64; MEMORY], f64) {
    let mut a = [0.0; MEMORY];
    let mut share = 1.0;
    if r[0] <= 0.0 {
        return (a, share);
    }
    for n in 0..order {
        let predicted: f64 = (0..n).map(|i| a[i] * r[n - i]).sum();
        let k = (r[n + 1] - predicted) / (share * r[0]);
        let before = a;
        a[n] = k;
        (0..n).for_each(|i| a[i] = before[i] - k * before[n - 1 - i]);
        share *= 1.0 - k * k;
    }
    (a, share)
}

/// The order of the tacho's ripple, in periods a revolution; 0 where none stands out.
fn ripple_order(coordinates: &[f64; PARAMETERS], segments: &[Segment], setting: &Setting) -> usize {
    let values = super::parameters::values(coordinates);
    let mut sums = vec![[0.0; 2]; HIGHEST_ORDER + 1];
    let (mut squares, mut weights) = (0.0, 0.0);
    for segment in segments.iter().filter(|segment| segment.regime != Regime::Stuck) {
        let left = residuals(&values, segment, setting);
        // Each direction has its own phase behind the low-pass: amplitudes add up, segment by segment.
        let mut own = vec![[0.0; 2]; HIGHEST_ORDER + 1];
        for (sample, left) in segment.samples.iter().zip(&left).skip(LEAD_IN) {
            squares += left[1] * left[1];
            weights += 1.0;
            for (order, sum) in own.iter_mut().enumerate().skip(1) {
                let (sin, cos) = libm::sincos(order as f64 * sample.angle);
                *sum = [sum[0] + left[1] * sin, sum[1] + left[1] * cos];
            }
        }
        for (sum, own) in sums.iter_mut().zip(own) {
            *sum = [sum[0] + own[0] * own[0] + own[1] * own[1], sum[1] + (left.len() - LEAD_IN) as f64];
        }
    }
    // Of white noise with variance σ² a segment's squares have the mean n·σ².
    let strength = |order: usize| sums[order][0] / (sums[order][1].max(1.0) * squares / f64::max(weights, 1.0));
    let strongest = (1..=HIGHEST_ORDER).max_by(|a, b| strength(*a).total_cmp(&strength(*b))).unwrap_or(0);
    if strength(strongest) > 20.0 { strongest } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::parameters;

    #[test]
    fn slopes_are_those_of_differences() {
        let preset: crate::Preset<f64> = crate::parameters::presets::find("clm-bench").unwrap().read().unwrap();
        let values = parameters::start(&preset.model);
        let at = parameters::coordinates(&values);
        let setting = Setting { dt: 250e-6, carriage_ratio: 8e-4, ripple_order: 13 };
        for regime in [Regime::Sliding { level: 0.01, slope: 2e-5 }, Regime::Stuck] {
            let samples: Vec<Sample> = (0..200)
                .map(|k| {
                    let x = f64::from(k);
                    Sample {
                        servo_voltage: 2.0 + libm::sin(0.9 * x * x / 200.0),
                        winding_voltage: libm::sin(1.3 * x * x / 200.0),
                        angle: 0.01 * x,
                        drop: 1e-4,
                        measured: [0.0; 4],
                    }
                })
                .collect();
            let mut segment = Segment::new(regime, samples, 40.0);
            segment.own = [0.01, 40.0, 40.1, 0.3, 0.2, 0.01, 0.02];
            let run = |at: [f64; PARAMETERS], own: [f64; OWN]| {
                let mut s = segment.clone();
                s.own = own;
                residuals(&parameters::values(&at), &s, &setting)
            };
            let p = widened(&parameters::sloped(&at));
            let own: [Dual<VARIABLES>; OWN] = std::array::from_fn(|i| Dual::variable(segment.own[i], PARAMETERS + i));
            let mut exact = Vec::new();
            predict(&p, &own, &segment, &setting, |_, y| exact.push(y));
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
                    let off = (0..200)
                        .map(|k| ((down[k][c] - up[k][c]) / (2.0 * h) - exact[k][c].gradient[i]).abs())
                        .fold(0.0, f64::max);
                    // A difference over 1e-5 has its own error of h² times the curvature, and rounding over h.
                    assert!(off <= 1e-4 * largest + 1e-7, "{regime:?} variable {i} channel {c}: {off} of {largest}");
                }
            }
        }
    }
}
