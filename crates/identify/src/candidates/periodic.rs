//! A periodic force over position: cogging of a linear motor, a screw or gear that runs out of true.
//!
//! Its period is the highest peak in the periodogram of the residuals over position, then refined by least squares.

use std::f64::consts::TAU;

use crate::balance::{Balance, Solved, TURN, Terms, Wave};
use crate::machine::Axis;
use stickslip_base::quantity::{Estimate, tied};
use stickslip_fit::fit_instrumented;

/// Fewest periods within the stroke.
const FEWEST: f64 = 3.0;
/// Most spatial frequencies in the periodogram.
const MOST: usize = 4000;

/// A periodic force over position.
#[derive(Clone, Debug, PartialEq)]
pub struct PeriodicForce {
    /// Period [m or rad], and its 95 % interval.
    pub period: (f64, [f64; 2]),
    /// Amplitude of the fundamental wave [N or N m], and its 95 % interval.
    pub amplitude: (f64, [f64; 2]),
}

impl PeriodicForce {
    pub(super) fn sentence(&self, axis: Axis) -> String {
        let (length, scale, force) = match axis {
            Axis::Linear => ("mm", 1e3, "N"),
            Axis::Rotary => ("°", 1.0f64.to_degrees(), "N m"),
        };
        let number = |(value, [low, high]): (f64, [f64; 2]), scale: f64, unit| {
            tied(&Estimate::new(scale * value, unit).with_half_width(0.5 * scale * (high - low)))
        };
        format!(
            "A periodic force over position has an amplitude of {} and a period of {}: cogging of the motor, or a screw or \
             gear that runs out of true. It was taken into account in mass and friction and subtracted before the \
             friction curve and the verdict on a Stribeck drop. model.toml does not contain it.",
            number(self.amplitude, 1.0, force),
            number(self.period, scale, length),
        )
    }
}

/// The waves of the highest peak in the residuals of some terms; none without a clear peak.
pub(super) fn search(balance: &Balance<'_>, terms: &Terms) -> Option<Vec<Wave>> {
    let low_pass = balance.recipe.low_pass;
    let solved = balance.solve(terms, &balance.whole()).ok()?;
    let (positions, speeds) = places(balance, &solved);
    let [low, high] = positions.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], q| [l.min(*q), h.max(*q)]);
    let stroke = high - low;
    let mut sorted = speeds;
    sorted.sort_by(f64::total_cmp);
    let slow = sorted[sorted.len() / 4];
    let step = TAU / (4.0 * stroke);
    // Slow motion must keep the wave below half of the cut-off.
    let last = 0.5 * TAU * low_pass / slow;
    let first = FEWEST * TAU / stroke;
    let count = (((last - first) / step) as usize).min(MOST);
    if count < 8 || !stroke.is_finite() {
        return None;
    }
    let power = periodogram(&positions, &solved.fit.residuals, first, step, count);
    let peak = (0..count).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    // Powers of noise are exponentially distributed: the largest of n exceeds their mean ln n times. Their local level
    // counts, since residuals are stronger at long waves.
    let mut around: Vec<f64> = power[peak.saturating_sub(100)..(peak + 100).min(count)].to_vec();
    around.sort_by(f64::total_cmp);
    let level = around[around.len() / 2] / std::f64::consts::LN_2;
    if power[peak] < 2.0 * libm::log(count as f64) * level {
        return None;
    }
    let with = |numbers: &[f64]| {
        let waves = numbers.iter().map(|number| balance.wave(*number));
        Terms { waves: terms.waves.iter().copied().chain(waves).collect(), ..terms.clone() }
    };
    let cost = |number: f64| balance.relative_error(&with(&[number]), &balance.whole()).unwrap_or(f64::INFINITY);
    let middle = first + peak as f64 * step;
    let best = golden(middle - step, middle + step, cost);
    let (single, double) = (with(&[best]), with(&[best, 2.0 * best]));
    let chosen = balance.gains(&[terms.clone(), single.clone(), double.clone()])?;
    [None, Some(single.waves), Some(double.waves)].into_iter().nth(chosen)?
}

/// Positions and speeds of the rows of a solved balance.
fn places(balance: &Balance<'_>, solved: &Solved) -> (Vec<f64>, Vec<f64>) {
    let at = |row: &usize| balance.track.at(*row as f64 + solved.terms.timing.delay);
    solved.rows.iter().map(at).map(|at| (at.position, at.velocity.abs())).unzip()
}

/// |Σ e·exp(i·k·x)|² for `count` spatial frequencies k.
fn periodogram(positions: &[f64], errors: &[f64], first: f64, step: f64, count: usize) -> Vec<f64> {
    let mut sums = vec![[0.0f64; 2]; count];
    for (x, e) in positions.iter().zip(errors) {
        let (mut cosine, mut sine) = (e * libm::cos(first * x), e * libm::sin(first * x));
        let (turn_cosine, turn_sine) = (libm::cos(step * x), libm::sin(step * x));
        for sum in &mut sums {
            sum[0] += cosine;
            sum[1] += sine;
            (cosine, sine) = (cosine * turn_cosine - sine * turn_sine, cosine * turn_sine + sine * turn_cosine);
        }
    }
    sums.iter().map(|[a, b]| a * a + b * b).collect()
}

/// The argument of the minimum between two bounds.
fn golden(mut low: f64, mut high: f64, cost: impl Fn(f64) -> f64) -> f64 {
    const SECTION: f64 = 0.618_033_988_749_894_9;
    let mut inner = [high - SECTION * (high - low), low + SECTION * (high - low)];
    let mut costs = inner.map(&cost);
    for _ in 0..20 {
        if costs[0] < costs[1] {
            high = inner[1];
            inner = [high - SECTION * (high - low), inner[0]];
            costs = [cost(inner[0]), costs[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + SECTION * (high - low)];
            costs = [costs[1], cost(inner[1])];
        }
    }
    0.5 * (low + high)
}

/// Period and amplitude of the fundamental wave, with intervals.
pub(super) fn found(balance: &Balance<'_>, solved: &Solved) -> Option<PeriodicForce> {
    let place = solved.terms.waves.iter().position(|wave| wave.number != TURN)?;
    let (wave, index) = (&solved.terms.waves[place], solved.terms.wave(place));
    let (fit, number) = (&solved.fit, wave.number);
    let (amplitude, ci95) = solved.amplitude(place)?;
    let (sine, cosine) = (fit.coefficients[index], fit.coefficients[index + 1]);
    // The derivative by the spatial frequency, beside sine and cosine, gives the error of the period.
    let positions = places(balance, solved).0;
    let middle = positions.iter().sum::<f64>() / positions.len() as f64;
    let columns = solved.rows.iter().map(|row| {
        let at = balance.track.at(*row as f64 + solved.terms.timing.delay);
        let [s, c] = wave.columns(at);
        [s, c, (at.position - middle) * (sine * c - cosine * s)]
    });
    let rows: Vec<[f64; 3]> = columns.collect();
    let columns: Vec<Vec<f64>> = (0..3).map(|k| rows.iter().map(|row| row[k]).collect()).collect();
    let slope = fit_instrumented(&columns, &columns, &fit.residuals).ok()?;
    let error = 0.5 * (slope.ci95[2][1] - slope.ci95[2][0]);
    let period = TAU / number;
    let spread = period * error / number;
    Some(PeriodicForce { period: (period, [period - spread, period + spread]), amplitude: (amplitude, ci95) })
}
