//! Ripple of the tacho: the commutator's bars pass at a rate given by the motor's angle.

use stickslip_core::scalar::Scalar;

use super::parameters::{Index, PARAMETERS, values};
use super::response::STATES;
use super::segment::{LEAD_IN, Segment, Setting, residuals};

/// Highest order searched, in periods a revolution.
const HIGHEST_ORDER: usize = 64;
/// Strength, relative to noise, from which an order is significant.
const SIGNIFICANT: f64 = 20.0;

/// Contribution of the ripple to the tacho: Ω_M·(r_s·sin nφ_M + r_c·cos nφ_M) through its low-pass.
///
/// A tick is a twentieth of a period only, so that the product is taken as a parabola over the tick and flows exactly.
#[derive(Clone, Copy, Debug)]
pub(super) struct TachoRipple<T> {
    order: T,
    amplitudes: [T; 2],
    /// Angle of the screw at the start of the segment [rad].
    start: T,
    dt: T,
    /// Weights of the product at start, middle and end of a tick.
    weights: [T; 3],
}

impl<T: Scalar> TachoRipple<T> {
    /// The ripple of a segment that starts at this angle of the screw [rad].
    pub(super) fn new(p: &[T; PARAMETERS], start: f64, setting: &Setting) -> Self {
        let ticks = T::of(setting.dt) / p[Index::TachoLag as usize];
        // Moments of the low-pass's memory over the tick.
        let whole = T::of(1.0) - (-ticks).exp();
        let first = T::of(1.0) - whole / ticks;
        let second = T::of(1.0) - T::of(2.0) * first / ticks;
        TachoRipple {
            order: T::of(setting.ripple_order as f64),
            amplitudes: [p[Index::TachoSine as usize], p[Index::TachoCosine as usize]],
            start: T::of(start),
            dt: T::of(setting.dt),
            weights: [
                whole - T::of(3.0) * first + T::of(2.0) * second,
                T::of(4.0) * (first - second),
                T::of(2.0) * second - first,
            ],
        }
    }

    /// Output of the low-pass at the end of a tick [rad/s], by the states at both ends.
    pub(super) fn over_a_tick(&self, from: &[T; STATES], to: &[T; STATES]) -> T {
        let motor = |state: &[T; STATES]| [self.start + state[5] + state[0], state[1]];
        let ([a, u], [b, v]) = (motor(from), motor(to));
        // The cubic through both angles and both velocities.
        let middle = [
            T::of(0.5) * (a + b) + T::of(0.125) * self.dt * (u - v),
            T::of(1.5) * (b - a) / self.dt - T::of(0.25) * (u + v),
        ];
        let [start, half, end] = self.weights;
        start * self.generated([a, u]) + half * self.generated(middle) + end * self.generated([b, v])
    }

    fn generated(&self, [angle, velocity]: [T; 2]) -> T {
        let phase = self.order * angle;
        velocity * (self.amplitudes[0] * phase.sin() + self.amplitudes[1] * phase.cos())
    }
}

/// The order of the tacho's ripple, in periods a revolution; 0 if none is significant.
pub(super) fn ripple_order(coordinates: &[f64; PARAMETERS], segments: &[Segment], setting: &Setting) -> usize {
    let values = values(coordinates);
    let mut sums = vec![[0.0; 2]; HIGHEST_ORDER + 1];
    let (mut squares, mut weights) = (0.0, 0.0);
    for segment in segments.iter().filter(|segment| !segment.is_stuck()) {
        let residual = residuals(&values, segment, setting);
        // Each direction has its own phase behind the low-pass: amplitudes add up, segment by segment.
        let mut own = vec![[0.0; 2]; HIGHEST_ORDER + 1];
        for (sample, residual) in segment.samples.iter().zip(&residual).skip(LEAD_IN) {
            squares += residual[1] * residual[1];
            weights += 1.0;
            for (order, sum) in own.iter_mut().enumerate().skip(1) {
                let (sin, cos) = libm::sincos(order as f64 * sample.angle);
                *sum = [sum[0] + residual[1] * sin, sum[1] + residual[1] * cos];
            }
        }
        for (sum, own) in sums.iter_mut().zip(own) {
            *sum = [sum[0] + own[0] * own[0] + own[1] * own[1], sum[1] + (residual.len() - LEAD_IN) as f64];
        }
    }
    // Of white noise with variance σ² a segment's squares have the mean n·σ².
    let strength = |order: usize| sums[order][0] / (sums[order][1].max(1.0) * squares / f64::max(weights, 1.0));
    let strongest = (1..=HIGHEST_ORDER).max_by(|a, b| strength(*a).total_cmp(&strength(*b))).unwrap_or(0);
    if strength(strongest) > SIGNIFICANT { strongest } else { 0 }
}
