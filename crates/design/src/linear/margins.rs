//! Stability margins of a closed loop.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::StateSpace;
use super::spectrum::size;
use stickslip_base::Error;

/// Points per decade of the first scan.
const DENSITY: f64 = 60.0;
/// Halvings of an interval with a crossing, and cuts of an interval with a peak.
const HALVINGS: usize = 60;
const CUTS: usize = 90;

/// A value and its frequency [rad/s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// The value.
    pub value: f64,
    /// The frequency [rad/s].
    pub frequency: f64,
}

/// Margins of the loop that L closes with −1. An unlimited margin is `None`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Smallest factor above 1 at which it oscillates.
    pub gain: Option<Peak>,
    /// Largest factor below 1 at which it oscillates.
    pub gain_reduction: Option<Peak>,
    /// Smallest phase lag at which it oscillates [rad].
    pub phase: Option<Peak>,
    /// Smallest additional delay at which it oscillates [s].
    pub delay: Option<Peak>,
    /// Peak M_s of the sensitivity |1/(1 + L)|: one over the distance of L from −1.
    pub sensitivity: Peak,
    /// Peak M_t of the complementary sensitivity |L/(1 + L)|.
    pub complementary: Peak,
}

impl Margins {
    /// Margins of a loop gain over the frequency [rad/s], scanned first at these rising frequencies. Between two of
    /// them it may turn once.
    pub fn of(gain: impl Fn(f64) -> Complex<f64>, frequencies: &[f64]) -> Self {
        let scan: Vec<(f64, Complex<f64>)> =
            frequencies.iter().map(|&frequency| (frequency, gain(frequency))).collect();
        let one = Complex::new(1.0, 0.0);
        let sensitivity = highest(&scan, &gain, |l| 1.0 / size(one + l));
        let complementary = highest(&scan, &gain, |l| size(l) / size(one + l));

        let mut real: Vec<Peak> = crossings(&scan, &gain, |l| l.im)
            .map(|frequency| Peak { value: -1.0 / gain(frequency).re, frequency })
            .collect();
        // At half a sampling rate a loop gain is real: it ends there on the axis instead of crossing it.
        real.extend(
            scan.last()
                .filter(|(_, l)| l.im.abs() < 1e-9 * size(*l))
                .map(|&(frequency, l)| Peak { value: -1.0 / l.re, frequency }),
        );
        let above = real.iter().filter(|factor| factor.value > 1.0);
        let below = real.iter().filter(|factor| (0.0..1.0).contains(&factor.value));
        let unit: Vec<Peak> = crossings(&scan, &gain, |l| libm::log(size(l)))
            .map(|frequency| {
                let l = -gain(frequency);
                Peak { value: libm::atan2(l.im, l.re), frequency }
            })
            .collect();
        let late = unit.iter().map(|phase| Peak { value: phase.value.rem_euclid(TAU) / phase.frequency, ..*phase });
        Margins {
            gain: above.min_by(|x, y| x.value.total_cmp(&y.value)).copied(),
            gain_reduction: below.max_by(|x, y| x.value.total_cmp(&y.value)).copied(),
            phase: unit.iter().min_by(|x, y| x.value.abs().total_cmp(&y.value.abs())).copied(),
            delay: late.min_by(|x, y| x.value.total_cmp(&y.value)),
            sensitivity,
            complementary,
        }
    }
}

impl StateSpace {
    /// Margins of the loop that this system closes with −1, from its first output to its first input.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn margins(&self) -> Result<Margins, Error> {
        let frequencies = self.frequencies()?;
        let infinite = Complex::new(f64::INFINITY, 0.0);
        let mut margins =
            Margins::of(|frequency| self.at_frequency(frequency).map_or(infinite, |l| l[(0, 0)]), &frequencies);
        // A peak at standstill or beyond all frequencies.
        let ends = [(0.0, self.dc_gain()), (f64::INFINITY, self.dt.is_none().then(|| self.d.clone()))];
        for (frequency, gain) in ends {
            let Some(l) = gain.map(|gain| gain[(0, 0)]) else { continue };
            for (peak, value) in
                [(&mut margins.sensitivity, 1.0 / (1.0 + l).abs()), (&mut margins.complementary, (l / (1.0 + l)).abs())]
            {
                if value > peak.value {
                    *peak = Peak { value, frequency };
                }
            }
        }
        Ok(margins)
    }

    /// Frequencies that resolve the response of the system [rad/s], rising: evenly in the logarithm, and close together
    /// about each resonance of it and of its loop with −1.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn frequencies(&self) -> Result<Vec<f64>, Error> {
        let mut modes = self.rates(&self.poles()?);
        modes.extend(self.rates(&self.zeros().unwrap_or_default()));
        if self.b.ncols() == self.c.nrows() {
            let around = StateSpace::gain(nalgebra::DMatrix::identity(self.b.ncols(), self.c.nrows()), self.dt)?;
            if let Ok(closed) = self.feedback(&around) {
                modes.extend(self.rates(&closed.poles()?));
            }
        }
        let last = self.dt.map(|dt| PI / dt);
        let sizes = modes.iter().map(|&rate| size(rate)).filter(|&rate| rate > 1e-6 && rate < 1e9);
        let (slowest, fastest) =
            sizes.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), rate| (low.min(rate), high.max(rate)));
        let (slowest, fastest) = if fastest > 0.0 { (slowest, fastest) } else { (1.0, 1.0) };
        let top = last.unwrap_or(1e3 * fastest);
        let bottom = (1e-3 * slowest).min(0.1 * top);
        let count = (DENSITY * libm::log10(top / bottom)).ceil().max(2.0) as usize;
        let mut all: Vec<f64> =
            (0..count).map(|k| bottom * libm::pow(top / bottom, k as f64 / (count - 1) as f64)).collect();
        for rate in modes {
            let (centre, width) = (rate.im.abs(), rate.re.abs());
            // Around a resonance from outside its width to inside, on both sides.
            let near = (-24..=24).map(|k| centre + width * libm::sinh(f64::from(k) * 0.25));
            all.extend(near.filter(|frequency| (bottom..top).contains(frequency)));
        }
        all.sort_by(f64::total_cmp);
        all.dedup_by(|next, last| *next - *last <= 1e-9 * *last);
        if let Some(end) = all.last_mut() {
            *end = end.min(top);
        }
        Ok(all)
    }

    /// The rates of these poles or zeros in continuous time, ln z/T [1/s].
    pub fn rates(&self, points: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let Some(dt) = self.dt else { return points.to_vec() };
        let there = points.iter().filter(|&&point| size(point) > 1e-9);
        there.map(|&point| Complex::new(libm::log(size(point)), libm::atan2(point.im, point.re)) / dt).collect()
    }
}

/// Frequencies at which a measure of the loop gain changes its sign [rad/s].
fn crossings<'a>(
    scan: &'a [(f64, Complex<f64>)],
    gain: &'a impl Fn(f64) -> Complex<f64>,
    measure: impl Fn(Complex<f64>) -> f64 + 'a,
) -> impl Iterator<Item = f64> + 'a {
    scan.windows(2).filter_map(move |pair| {
        let (mut low, mut high) = (pair[0].0, pair[1].0);
        let (first, last) = (measure(pair[0].1), measure(pair[1].1));
        if first == 0.0 {
            return Some(low);
        }
        if !first.is_finite() || !last.is_finite() || first * last >= 0.0 {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if measure(gain(middle)) * first > 0.0 { low = middle } else { high = middle }
        }
        Some(0.5 * (low + high))
    })
}

/// The highest value of a measure of the loop gain, by the golden section about each of its peaks.
fn highest(
    scan: &[(f64, Complex<f64>)],
    gain: &impl Fn(f64) -> Complex<f64>,
    measure: impl Fn(Complex<f64>) -> f64,
) -> Peak {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let values: Vec<f64> = scan.iter().map(|(_, l)| measure(*l)).collect();
    let best = values.iter().copied().filter(|value| !value.is_nan()).fold(0.0, f64::max);
    let mut peak = Peak { value: 0.0, frequency: f64::NAN };
    for k in 0..scan.len() {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(scan.len() - 1));
        let value = values[k];
        // Between two points a peak is a few per cent higher than at them.
        if value.is_nan() || value < values[before] || value < values[after] || value < 0.8 * best {
            continue;
        }
        if value > peak.value {
            peak = Peak { value, frequency: scan[k].0 };
        }
        let (mut low, mut high) = (scan[before].0, scan[after].0);
        for _ in 0..CUTS {
            let span = GOLDEN * (high - low);
            let (left, right) = (high - span, low + span);
            let [on_left, on_right] = [left, right].map(|frequency| measure(gain(frequency)));
            if on_left > peak.value {
                peak = Peak { value: on_left, frequency: left };
            }
            if on_right > peak.value {
                peak = Peak { value: on_right, frequency: right };
            }
            if on_left > on_right {
                high = right
            } else {
                low = left
            }
            if high - low <= 1e-9 * high {
                break;
            }
        }
    }
    peak
}
