//! Limit cycles: amplitude and interval.

use super::Trace;

/// Averaging time of a motion [s].
const WINDOW: f64 = 0.03;
/// Speed below which the load sticks [rad/s]: a fifth of the slowest set-point.
const STICKS: f64 = 0.02;
/// Speed above which it slips [rad/s]. Between the two the state is unchanged.
const SLIPS: f64 = 0.15;

/// A limit cycle of sticking and slipping.
///
/// A breakaway is a change from sticking, where the load moves slower than 0.02 rad/s over 30 ms, to slipping, where it
/// moves faster than 0.15 rad/s. Even sliding along a ramp of 0.1 rad/s is neither.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitCycle {
    /// Half the distance between the extremes of the deviation from the set-point, mean over the cycles [rad]; NaN
    /// without a cycle.
    pub amplitude: f64,
    /// Mean time between breakaways [s]; NaN without a cycle.
    pub interval: f64,
    /// Number of breakaways.
    pub breakaways: usize,
}

impl LimitCycle {
    /// The cycle in a trace from a time on [s].
    pub fn find(trace: &Trace, from: f64) -> Self {
        let breakaways = breakaways(trace, from);
        let count = breakaways.len();
        if count < 2 {
            return LimitCycle { amplitude: f64::NAN, interval: f64::NAN, breakaways: count };
        }
        let extent = |span: &[usize]| {
            let deviations = (span[0]..span[1]).map(|k| trace.angle[k] - trace.reference[k]);
            let (low, high) = deviations.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
            0.5 * (high - low)
        };
        // Hunting moves forth and back: two intervals are one cycle; for stick-slip they are two cycles of equal size.
        let spans = if count > 2 { 2 } else { 1 };
        let amplitudes: Vec<f64> = breakaways.windows(spans + 1).map(|w| extent(&[w[0], w[spans]])).collect();
        LimitCycle {
            amplitude: amplitudes.iter().sum::<f64>() / amplitudes.len() as f64,
            interval: (breakaways[count - 1] - breakaways[0]) as f64 * trace.period / (count - 1) as f64,
            breakaways: count,
        }
    }
}

/// Samples at which the load breaks away.
fn breakaways(trace: &Trace, from: f64) -> Vec<usize> {
    let lag = (WINDOW / trace.period).round() as usize;
    let start = (from / trace.period) as usize;
    let mut sticks = false;
    let mut samples = Vec::new();
    for k in start.max(lag)..trace.angle.len() {
        let speed = (trace.angle[k] - trace.angle[k - lag]).abs() / (lag as f64 * trace.period);
        if speed < STICKS {
            sticks = true;
        } else if speed > SLIPS && sticks {
            sticks = false;
            samples.push(k);
        }
    }
    samples
}
