//! A position loop for the page: numbers, poles, frequency response, steps.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::poles::{DampingRay, LoopPole, PoleGrip};
use super::{Item, kind_of};
use stickslip_base::Error;
use stickslip_base::quantity::number;
use stickslip_design::linear::{Operating, Peak, decibels, size, unwrapped};
use stickslip_design::{CORNER_LIMIT, NOISE_LIMIT, SENSITIVITY_LIMIT};
use stickslip_experiment::workflow::position_loop::{LoopRun, OperatingLoop, SHOWN, numbers};

/// Maximum number of frequencies in a picture, and the lowest frequency [Hz].
const FREQUENCIES: usize = 500;
const LOWEST: f64 = 0.1;
/// Maximum number of instants of a step in a picture.
const INSTANTS: usize = 400;
/// The load torque of a step [N m].
const LOAD: f64 = 0.1;
/// Corners of the polygon that shows the circle of the sensitivity limit.
const CIRCLE: usize = 96;
/// Shown range of the pole plane, as a factor of the coupling's frequency.
const REACH: f64 = 1.25;

/// A position controller on the identified model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopView {
    /// Values that differ from the active ones, by path, as for `set`.
    pub values: BTreeMap<String, String>,
    /// Kind of controller, as in a file.
    pub kind: String,
    /// The fields of the controller.
    pub items: Vec<Item>,
    /// The loop with the load sliding, then stuck.
    pub loads: Vec<LoopAt>,
    /// Robustness limits.
    pub limits: LoopLimits,
    /// Directions of constant damping ratio.
    pub rays: Vec<DampingRay>,
    /// Shown range of the pole plane [1/s].
    pub reach: f64,
    /// The pair of poles that can be dragged; `null` for a controller given by matrices.
    pub grip: Option<PoleGrip>,
    /// Robustness check; `null` unless the draft is thorough.
    pub verdict: Option<LoopVerdict>,
}

/// A loop at one operating point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopAt {
    /// `sliding` or `stuck`.
    pub load: String,
    /// Whether it is stable.
    pub stable: bool,
    /// The numbers of `stickslip loop`.
    pub numbers: Vec<LoopNumber>,
    /// Poles of the closed loop, the slowest first.
    pub poles: Vec<LoopPole>,
    /// Poles of the plant.
    pub plant: Vec<LoopPole>,
    /// Frequencies of the loop gain, rising [Hz].
    pub frequency: Vec<f64>,
    /// Magnitude of the loop gain [dB].
    pub decibels: Vec<f64>,
    /// Phase of the loop gain, without jumps [°].
    pub phase: Vec<f64>,
    /// Real part of the loop gain.
    pub real: Vec<f64>,
    /// Imaginary part of the loop gain.
    pub imaginary: Vec<f64>,
    /// Margins.
    pub marks: Vec<LoopMark>,
    /// Instants of the step responses [s].
    pub time: Vec<f64>,
    /// Angle after a set-point step of 1 rad [rad]; empty for an unstable loop.
    pub setpoint: Vec<f64>,
    /// How far the angle exceeds a set-point step, as a share of the step; `null` for an unstable loop.
    pub overshoot: Option<f64>,
    /// Angle after a load torque step of 0.1 N m [mrad]; empty for an unstable loop.
    pub disturbed: Vec<f64>,
}

/// A number of a loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopNumber {
    /// Key in `summary.json`, after `loop.sliding.`.
    pub key: String,
    /// Name.
    pub name: String,
    /// Unit: gain margins in dB, delays in ms, else SI.
    pub unit: String,
    /// Value in this unit; `null` if unlimited or if the loop is not stable.
    pub value: Option<f64>,
}

/// A margin at its point of the loop gain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopMark {
    /// Kind: `gain margin`, `phase margin`, `M_s`.
    pub name: String,
    /// Kind, value and frequency in words.
    pub text: String,
    /// Short label for a point in a picture: `GM 11.8 dB`.
    pub short: String,
    /// Frequency [Hz].
    pub frequency: f64,
    /// Magnitude of the loop gain [dB].
    pub decibels: f64,
    /// Phase of the loop gain [°].
    pub phase: f64,
    /// Real part of the loop gain.
    pub real: f64,
    /// Imaginary part of the loop gain.
    pub imaginary: f64,
}

/// Robustness limits of a tuning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopLimits {
    /// Limit of the sensitivity peak, sliding and stuck.
    pub sensitivity: f64,
    /// Limit of the sensitivity peak in each corner.
    pub corner: f64,
    /// Limit of the noise of the commanded torque [N m RMS].
    pub noise_torque: f64,
    /// Circle in the Nyquist plot that the loop gain must not enter, from the limit of the sensitivity peak.
    pub circle: Vec<[f64; 2]>,
}

/// Robustness check of a loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopVerdict {
    /// Whether all robustness limits are met.
    pub fair: bool,
    /// Reasons, in sentences.
    pub sentences: Vec<String>,
    /// The worst corner.
    pub worst: CornerView,
}

/// A corner: a machine that deviates from the model by these factors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CornerView {
    /// `sliding` or `stuck`.
    pub load: String,
    /// Factor of the load inertia.
    pub load_inertia: f64,
    /// Factor of the coupling stiffness.
    pub coupling_stiffness: f64,
    /// Peak of the sensitivity; `null` if the loop is not stable.
    pub sensitivity: Option<f64>,
}

impl LoopView {
    pub(super) fn of(
        run: &LoopRun,
        values: BTreeMap<String, String>,
        items: Vec<Item>,
        thorough: bool,
    ) -> Result<Self, Error> {
        let controller = &run.preset.bench.controller;
        let loads = run.operating.iter().map(LoopAt::of).collect::<Result<Vec<_>, _>>()?;
        let grip = PoleGrip::of(controller, loads.first().map_or(&[], |at| &at.poles));
        let far = grip.map_or(0.0, |grip| grip.bandwidth);
        Ok(LoopView {
            values,
            kind: kind_of(controller).into(),
            items,
            loads,
            limits: LoopLimits::of(controller.torque_limit()),
            rays: DampingRay::all(),
            reach: REACH * far.max(run.preset.model.drive.vibration()),
            grip,
            verdict: if thorough { LoopVerdict::of(run) } else { None },
        })
    }
}

impl LoopAt {
    pub(super) fn of(it: &OperatingLoop) -> Result<Self, Error> {
        let all = it.gain.response(&it.frequencies);
        let phases = unwrapped(all.iter().copied(), -180.0);
        let points: Vec<Bode> = it
            .frequencies
            .iter()
            .zip(all)
            .zip(phases)
            .map(|((&frequency, gain), phase)| Bode { frequency, gain, phase })
            .filter(|it| it.frequency >= TAU * LOWEST && size(it.gain).is_finite())
            .collect();
        let points = thinned(&points);
        let column = |value: &dyn Fn(&Bode) -> f64| points.iter().map(|it| short(value(it))).collect::<Vec<_>>();
        let dt = it.closed.dt.unwrap_or(SHOWN);
        let count = (SHOWN / dt) as usize;
        let every = count.div_ceil(INSTANTS).max(1);
        let stable = it.quality.stable;
        let step = |input: usize, scale: f64| -> Result<Vec<f64>, Error> {
            if !stable {
                return Ok(Vec::new());
            }
            let angles = it.closed.channel(input, 0)?.step_response(count, dt)?;
            Ok(angles.into_iter().step_by(every).map(|angle| short(scale * angle)).collect())
        };
        let setpoint = step(0, 1.0)?;
        let highest = setpoint.iter().copied().fold(1.0, f64::max);
        Ok(LoopAt {
            load: it.name.into(),
            stable,
            numbers: numbers(&it.quality).into_iter().map(LoopNumber::of).collect(),
            poles: LoopPole::all(&it.closed, &it.quality.poles),
            plant: LoopPole::all(&it.axis, &it.axis.poles()?),
            frequency: column(&|it| it.frequency / TAU),
            decibels: column(&|it| decibels(it.gain)),
            phase: column(&|it| it.phase),
            real: column(&|it| it.gain.re),
            imaginary: column(&|it| it.gain.im),
            marks: marks(it, &points),
            time: (0..count).step_by(every).map(|k| short(k as f64 * dt)).collect(),
            overshoot: stable.then_some(short(highest - 1.0)),
            setpoint,
            disturbed: step(2, 1e3 * LOAD)?,
        })
    }
}

impl LoopNumber {
    fn of((key, name, unit, value): (&str, &str, &str, Option<f64>)) -> Self {
        let (unit, value) = match key {
            "gain_margin" | "lower_gain_margin" => ("dB", value.map(|ratio| 20.0 * libm::log10(ratio))),
            "delay_margin" => ("ms", value.map(|seconds| 1e3 * seconds)),
            _ => (unit, value),
        };
        let value = value.filter(|value| value.is_finite());
        LoopNumber { key: key.into(), name: name.into(), unit: unit.into(), value }
    }
}

impl LoopLimits {
    fn of(torque_limit: f64) -> Self {
        let radius = 1.0 / SENSITIVITY_LIMIT;
        let corner = |k: usize| {
            let angle = k as f64 * TAU / CIRCLE as f64;
            [short(radius * libm::cos(angle) - 1.0), short(radius * libm::sin(angle))]
        };
        LoopLimits {
            sensitivity: SENSITIVITY_LIMIT,
            corner: CORNER_LIMIT,
            noise_torque: NOISE_LIMIT * torque_limit,
            circle: (0..=CIRCLE).map(corner).collect(),
        }
    }
}

impl LoopVerdict {
    /// The check of a loop with evaluated corners.
    fn of(run: &LoopRun) -> Option<Self> {
        let worst = run.corners.first()?;
        let quiet = run.is_quiet() || !run.operating[0].quality.stable;
        let mut sentences = if quiet || !run.is_fair() { run.remarks() } else { Vec::new() };
        if !quiet {
            let share = run.operating[0].quality.noise_torque / run.preset.bench.controller.torque_limit();
            sentences.push(format!(
                "Encoder counts and tacho noise cause a torque noise of {} % of the torque limit, above the limit of {} %: \
                 reduce the velocity gain.",
                number(100.0 * share, 1),
                number(100.0 * NOISE_LIMIT, 0)
            ));
        }
        Some(LoopVerdict {
            fair: run.is_fair() && run.is_quiet(),
            sentences,
            worst: CornerView {
                load: if worst.at == Operating::Stuck { "stuck" } else { "sliding" }.into(),
                load_inertia: worst.load_inertia,
                coupling_stiffness: worst.coupling_stiffness,
                sensitivity: Some(worst.sensitivity).filter(|value| value.is_finite()),
            },
        })
    }
}

/// The loop gain at a frequency [rad/s].
#[derive(Clone, Copy)]
struct Bode {
    frequency: f64,
    gain: Complex<f64>,
    /// [°]
    phase: f64,
}

/// Reduces the loop gain to the points that a picture needs: each differs visibly from the previous one.
fn thinned(points: &[Bode]) -> Vec<Bode> {
    let mut selected: Vec<Bode> = Vec::new();
    for (k, it) in points.iter().enumerate() {
        let differs = selected.last().is_none_or(|last| {
            let near = size(it.gain) < 4.0;
            libm::log(it.frequency / last.frequency) > 0.05
                || (decibels(it.gain) - decibels(last.gain)).abs() > 0.4
                || (it.phase - last.phase).abs() > 2.5
                || near && size(it.gain - last.gain) > 0.04
        });
        if differs || k + 1 == points.len() {
            selected.push(*it);
        }
    }
    let every = selected.len().div_ceil(FREQUENCIES).max(1);
    selected.into_iter().step_by(every).collect()
}

/// The margins of a loop, on its gain.
fn marks(it: &OperatingLoop, points: &[Bode]) -> Vec<LoopMark> {
    let margins = &it.quality.margins;
    let at = |[name, sign]: [&str; 2], peak: Option<Peak>, words: &dyn Fn(f64) -> String| {
        let peak = peak.filter(|peak| peak.value.is_finite() && peak.frequency.is_finite())?;
        let gain = it.gain.at_frequency(peak.frequency).map(|gain| gain[(0, 0)]).filter(|l| size(*l).is_finite())?;
        let near = points.iter().min_by(|x, y| {
            let off = |it: &Bode| libm::log(it.frequency / peak.frequency).abs();
            off(x).total_cmp(&off(y))
        })?;
        let phase = *unwrapped([gain], near.phase).first()?;
        let hertz = peak.frequency / TAU;
        let value = words(peak.value);
        let text = format!("{name} {value} at {} Hz", number(hertz, if hertz < 10.0 { 2 } else { 1 }));
        let label = format!("{sign} {value}");
        let [frequency, decibels, phase, real, imaginary] = [hertz, decibels(gain), phase, gain.re, gain.im].map(short);
        Some(LoopMark { name: name.into(), text, short: label, frequency, decibels, phase, real, imaginary })
    };
    [
        at(["gain margin", "GM"], margins.gain, &|value| format!("{} dB", number(20.0 * libm::log10(value), 1))),
        at(["phase margin", "PM"], margins.phase, &|value| format!("{}°", number(value.to_degrees(), 1))),
        at(["M_s", "Mₛ"], Some(margins.sensitivity), &|value| number(value, 2)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Rounded to the digits that a picture can show.
pub(super) fn short(value: f64) -> f64 {
    // A number in scientific notation always parses.
    format!("{value:.5e}").parse().unwrap_or(value)
}
