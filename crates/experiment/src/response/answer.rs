//! Measured response: gains, intervals and coherence.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::{ResponsePlan, Sample};
use stickslip_base::Error;
use stickslip_design::linear::{Operating, StateSpace, decibels, port};
use stickslip_fit::student_t95;

/// Least counts of an angle; with fewer, its gain is that of the counter's steps.
const COUNTS: f64 = 8.0;
/// Coherence from which on a line is evaluated.
pub const COHERENT: f64 = 0.9;

/// Response of one sensor at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Sensor over commanded torque.
    pub gain: Complex<f64>,
    /// Half-width of the 95 % interval over the gain: of the magnitude, and of the phase in rad.
    pub half_width: f64,
    /// Share of the power at this frequency that follows the excitation, of the sensor's or of the torque's, the
    /// smaller of both: 1 without noise and distortion.
    pub coherence: f64,
    /// The same gain of the modelled axis.
    pub expected: Complex<f64>,
}

impl Answer {
    /// Measured over expected: magnitude [dB] and phase [°].
    pub fn deviation(&self) -> [f64; 2] {
        let ratio = self.gain / self.expected;
        [decibels(ratio), libm::atan2(ratio.im, ratio.re).to_degrees()]
    }

    /// Half-widths of the 95 % interval: magnitude [dB] and phase [°].
    pub fn interval(&self) -> [f64; 2] {
        let share = self.half_width;
        [20.0 * libm::log10(1.0 + share), libm::asin(share.min(1.0)).to_degrees()]
    }
}

/// Response of both sensors at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Frequency [Hz].
    pub frequency: f64,
    /// Angle by the encoder [rad/(N m)].
    pub angle: Answer,
    /// Motor velocity by the tacho [rad/(N m s)].
    pub velocity: Answer,
}

/// A frequency response.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Regime of the load.
    pub operating: Operating,
    /// All frequencies, rising.
    pub lines: Vec<Line>,
    /// Number of evaluated periods.
    pub periods: usize,
    /// Number of periods left out for missed ticks.
    pub broken: usize,
    /// Share of the time in which a sliding load was slower than a tenth of its velocity.
    pub stuck: f64,
    /// Way of a load at rest [rad].
    pub crept: f64,
    /// Level of the drive motor's own friction, which the modelled axis lacks, over the torque of the excitation of a
    /// load at rest.
    pub motor_friction: f64,
    /// Whether the plan was completed.
    pub complete: bool,
    /// Bench time [s].
    pub duration: f64,
}

impl Response {
    /// Largest deviation of one sensor from the modelled axis where it is coherent: magnitude [dB] and phase [°], and
    /// the number of coherent frequencies.
    pub fn deviation(&self, sensor: impl Fn(&Line) -> Answer) -> ([f64; 2], usize) {
        let coherent = self.lines.iter().map(sensor).filter(|answer| answer.coherence > COHERENT);
        coherent.fold(([0.0; 2], 0), |([magnitude, phase], count), answer| {
            let [by, turned] = answer.deviation();
            ([magnitude.max(by.abs()), phase.max(turned.abs())], count + 1)
        })
    }

    /// Warnings for the report.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.stuck > 0.0 {
            warnings.push(format!(
                "The load was nearly at rest in {:.1} % of the time, so that the response is not linear. Use a higher \
                 velocity or a smaller share.",
                100.0 * self.stuck
            ));
        }
        if self.crept > 0.0 {
            warnings.push(format!(
                "The load at rest moved by {:.1e} rad: its bristles slid. Use a smaller share.",
                self.crept
            ));
        }
        if self.broken > 0 {
            warnings.push(format!(
                "{} of {} periods were left out because of missed ticks.",
                self.broken,
                self.broken + self.periods
            ));
        }
        if self.motor_friction > 0.01 {
            warnings.push(format!(
                "The drive motor's own friction, {:.0} % of the excitation's RMS torque, damps an axis at rest; the \
                 modelled axis lacks it. A larger share reduces its effect.",
                100.0 * self.motor_friction
            ));
        }
        let deaf = |sensor: fn(&Line) -> Answer| self.deviation(sensor).1 == 0;
        for (name, sensor) in [("encoder", deaf(|line| line.angle)), ("tacho", deaf(|line| line.velocity))] {
            if sensor {
                warnings.push(format!(
                    "The {name} shows no response: at every frequency it is below noise or counts. Use a larger share or \
                     more periods."
                ));
            }
        }
        if !self.complete {
            warnings.push("Cancelled: results of the periods measured until then.".into());
        }
        warnings
    }
}

/// Amplitude of a period at a multiple of 1/T, as half a phasor.
fn spectrum(values: impl Iterator<Item = f64>, multiple: usize, turn: &[Complex<f64>]) -> Complex<f64> {
    let samples = turn.len();
    let sum =
        values.enumerate().fold(Complex::default(), |sum, (k, value)| sum + turn[(multiple * k) % samples] * value);
    sum / samples as f64
}

/// Complete periods, each with its number, and the number of incomplete ones before the last.
fn whole(ticks: &[Sample], length: usize) -> (Vec<(usize, &[Sample])>, usize) {
    let mut all: Vec<&[Sample]> = ticks.chunk_by(|one, next| one.period == next.period).collect();
    let without_gap =
        |period: &&[Sample]| period.len() == length && period[length - 1].cycle - period[0].cycle == length as u64 - 1;
    // The last may have been cancelled.
    if all.last().is_some_and(|last| !without_gap(last)) {
        all.pop();
    }
    let begun = all.len();
    let complete: Vec<_> = all.into_iter().filter(without_gap).map(|period| (period[0].period, period)).collect();
    let broken = begun - complete.len();
    (complete, broken)
}

pub(super) fn evaluate(
    plan: &ResponsePlan<f64>,
    model: &StateSpace,
    multiples: &[usize],
    waves: &[Vec<f64>],
    ticks: &[Sample],
    count: f64,
) -> Result<Response, Error> {
    let length = waves[0].len();
    let (periods, broken) = whole(ticks, length);
    if periods.len() < 2 {
        let remedy = "Use more periods (plan.periods), shorter ones (plan.period), or a slower tick.";
        return Err(Error::TooFew { what: "periods without a missed tick", found: periods.len(), needed: 2, remedy });
    }
    let turn: Vec<Complex<f64>> = (0..length)
        .map(|k| {
            let angle = -TAU * k as f64 / length as f64;
            Complex::new(libm::cos(angle), libm::sin(angle))
        })
        .collect();
    let dt = model.dt.unwrap_or_default();
    let counted = || periods.iter().flat_map(|(_, period)| period.iter().map(|tick| tick.sample));
    let slow = |s: &[f64; 3]| s[2] * plan.velocity.signum() < 0.1 * plan.velocity.abs();
    let slides = plan.velocity != 0.0;
    let all = counted().count().max(1) as f64;
    let [low, high] =
        counted().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| [low.min(s[1]), high.max(s[1])]);
    let way = high - low;
    let line = |&multiple: &usize| {
        let excited: Vec<Complex<f64>> =
            periods.iter().map(|(number, _)| spectrum(waves[*number].iter().copied(), multiple, &turn)).collect();
        let of = |index: usize| -> Vec<Complex<f64>> {
            let one = |period: &[Sample]| spectrum(period.iter().map(|tick| tick.sample[index]), multiple, &turn);
            periods.iter().map(|(_, period)| one(period)).collect()
        };
        let torque = of(0);
        let frequency = multiple as f64 / (length as f64 * dt);
        let expected = model.at_frequency(TAU * frequency);
        let answer = |index: usize, output: usize| {
            let expected = expected.as_ref().map_or(Complex::new(f64::NAN, 0.0), |g| g[(output, port::TORQUE)]);
            answer(&excited, &torque, &of(index), expected)
        };
        let mut angle = answer(1, port::ANGLE);
        if way < COUNTS * count {
            angle.coherence = 0.0;
        }
        Line { frequency, angle, velocity: answer(2, port::TACHO) }
    };
    Ok(Response {
        operating: plan.operating(),
        lines: multiples.iter().map(line).collect(),
        periods: periods.len(),
        broken,
        stuck: if slides { counted().filter(slow).count() as f64 / all } else { 0.0 },
        // One count is the resolution of the way.
        crept: if !slides && way > 2.5 * count { way } else { 0.0 },
        motor_friction: 0.0,
        complete: true,
        duration: 0.0,
    })
}

/// Gain, its interval and coherence from each period's excitation, torque and answer.
fn answer(
    excited: &[Complex<f64>],
    torque: &[Complex<f64>],
    sensor: &[Complex<f64>],
    expected: Complex<f64>,
) -> Answer {
    let count = sensor.len() as f64;
    let power = |values: &[Complex<f64>]| values.iter().map(Complex::norm_sqr).sum::<f64>() / count;
    let scale = libm::sqrt(power(excited));
    // By the phase of the excitation, which differs in each period.
    let referred =
        |values: &[Complex<f64>]| values.iter().zip(excited).map(|(v, r)| v * r.conj() / scale).collect::<Vec<_>>();
    let mean = |values: &[Complex<f64>]| values.iter().sum::<Complex<f64>>() / count;
    let (us, ys) = (referred(torque), referred(sensor));
    let (u, y) = (mean(&us), mean(&ys));
    let gain = y / u;
    // A constant counter gives no gain.
    let share = |mean: Complex<f64>, power: f64| if power > 0.0 { mean.norm_sqr() / power } else { 0.0 };
    // The residual that the torque does not explain, without the loop's share.
    let rest: f64 = us.iter().zip(&ys).map(|(u, y)| (y - gain * u).norm_sqr()).sum();
    let variance = rest / (count * (count - 1.0)) / y.norm_sqr();
    let freedom = 2.0 * (count - 1.0);
    Answer {
        gain,
        half_width: student_t95(freedom) * libm::sqrt(0.5 * variance),
        coherence: share(y, power(sensor)).min(share(u, power(torque))),
        expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_with_a_missed_tick_is_counted_a_cancelled_one_is_not() {
        let tick = |period: usize, cycle: u64| Sample { period, cycle, sample: [0.0; 3] };
        let run = |period: usize, from: u64| (from..from + 4).map(move |cycle| tick(period, cycle));
        let mut ticks: Vec<Sample> = run(0, 100).chain(run(1, 110)).chain(run(2, 120)).collect();
        assert_eq!(whole(&ticks, 4).0.len(), 3);
        // A tick was missed, once without its frame and once by a cycle more.
        ticks.remove(5);
        ticks[10].cycle += 1;
        ticks.extend(run(3, 130).take(2));
        let (complete, broken) = whole(&ticks, 4);
        assert_eq!((complete.iter().map(|(number, _)| *number).collect::<Vec<_>>(), broken), (vec![0], 2));
    }
}
