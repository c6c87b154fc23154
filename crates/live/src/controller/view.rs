//! What is to be seen of a loop.

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

/// Frequencies that a picture shows, at most, and the lowest of them [Hz].
const FREQUENCIES: usize = 500;
const LOWEST: f64 = 0.1;
/// Instants of a step that a picture shows, at most.
const INSTANTS: usize = 400;
/// The load torque of a step [N m].
const LOAD: f64 = 0.1;
/// Corners of the circle that a fair loop gain stays out of.
const CIRCLE: usize = 96;
/// Of the coupling's frequency so much is shown in the plane of the poles.
const REACH: f64 = 1.25;

/// A position controller on the machine as believed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopView {
    /// What is not as in force: value by path, as for `set`.
    pub values: BTreeMap<String, String>,
    /// Its kind, as in a file.
    pub kind: String,
    /// The fields of the controller.
    pub items: Vec<Item>,
    /// The load sliding, then stuck.
    pub loads: Vec<LoopAt>,
    /// What a fair tuning keeps to.
    pub limits: LoopLimits,
    /// Directions in which poles of one damping lie.
    pub rays: Vec<DampingRay>,
    /// So far the plane of the poles is worth looking at [1/s].
    pub reach: f64,
    /// The pair of poles that can be dragged; `null` where the poles follow from gains.
    pub grip: Option<PoleGrip>,
    /// Whether it keeps what a fair tuning asks for; `null` unless it was asked thoroughly.
    pub verdict: Option<LoopVerdict>,
}

/// A loop about one operating point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopAt {
    /// `sliding` or `stuck`.
    pub load: String,
    /// Whether it is stable.
    pub stable: bool,
    /// What it is worth: the numbers of `stickslip loop`.
    pub numbers: Vec<LoopNumber>,
    /// Poles of the closed loop, the slowest first.
    pub poles: Vec<LoopPole>,
    /// Poles of the axis alone.
    pub plant: Vec<LoopPole>,
    /// Frequencies of the loop gain, rising [Hz].
    pub frequency: Vec<f64>,
    /// Its magnitude [dB].
    pub decibels: Vec<f64>,
    /// Its phase, without jumps [°].
    pub phase: Vec<f64>,
    /// Its real part.
    pub real: Vec<f64>,
    /// Its imaginary part.
    pub imaginary: Vec<f64>,
    /// Its margins.
    pub marks: Vec<LoopMark>,
    /// Instants of the steps [s].
    pub time: Vec<f64>,
    /// The angle after a set-point of 1 rad [rad]; empty where the loop is not stable.
    pub setpoint: Vec<f64>,
    /// The angle after a load torque of 0.1 N m [mrad]; empty where the loop is not stable.
    pub disturbed: Vec<f64>,
}

/// A number of a loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopNumber {
    /// As in `summary.json`, behind `loop.sliding.`.
    pub key: String,
    /// In words.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// `null` where nothing limits it, and where the loop is not stable.
    pub value: Option<f64>,
}

/// A margin, where it is on the loop gain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopMark {
    /// Which: `gain margin`, `phase margin`, `M_s`.
    pub name: String,
    /// It in words.
    pub text: String,
    /// The same beside a point of a picture: `GM 3.9`.
    pub short: String,
    /// [Hz].
    pub frequency: f64,
    /// [dB].
    pub decibels: f64,
    /// [°].
    pub phase: f64,
    /// Real part of the loop gain.
    pub real: f64,
    /// Imaginary part.
    pub imaginary: f64,
}

/// What a fair tuning keeps to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopLimits {
    /// Peak of the sensitivity, sliding and stuck.
    pub sensitivity: f64,
    /// The same in each corner.
    pub corner: f64,
    /// Noise of the commanded torque [N m RMS].
    pub noise_torque: f64,
    /// The circle that a loop gain within the first of them stays out of.
    pub circle: Vec<[f64; 2]>,
}

/// Whether a loop keeps what a fair tuning asks for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LoopVerdict {
    /// It does.
    pub fair: bool,
    /// Why, in sentences.
    pub sentences: Vec<String>,
    /// The worst of the machines that are off.
    pub worst: CornerView,
}

/// A machine that is off by a factor each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CornerView {
    /// `sliding` or `stuck`.
    pub load: String,
    /// Factor of the load inertia.
    pub load_inertia: f64,
    /// Factor of the coupling stiffness.
    pub coupling_stiffness: f64,
    /// Peak of the sensitivity; `null` where the loop is not stable.
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
        let grip = PoleGrip::of(controller);
        let far = grip.map_or(0.0, |grip| grip.bandwidth);
        Ok(LoopView {
            values,
            kind: kind_of(controller).into(),
            items,
            loads: run.operating.iter().map(LoopAt::of).collect::<Result<_, _>>()?,
            limits: LoopLimits::of(controller.torque_limit()),
            rays: DampingRay::all(),
            reach: REACH * far.max(run.preset.model.drive.vibration()),
            grip,
            verdict: if thorough { LoopVerdict::of(run) } else { None },
        })
    }
}

impl LoopAt {
    fn of(it: &OperatingLoop) -> Result<Self, Error> {
        let all = it.gain.response(&it.frequencies);
        let phases = unwrapped(all.iter().copied(), -180.0);
        let seen: Vec<Bode> = it
            .frequencies
            .iter()
            .zip(all)
            .zip(phases)
            .map(|((&frequency, gain), phase)| Bode { frequency, gain, phase })
            .filter(|it| it.frequency >= TAU * LOWEST && size(it.gain).is_finite())
            .collect();
        let seen = thinned(&seen);
        let column = |value: &dyn Fn(&Bode) -> f64| seen.iter().map(|it| short(value(it))).collect::<Vec<_>>();
        let dt = it.closed.dt.unwrap_or(SHOWN);
        let count = (SHOWN / dt) as usize;
        let every = count.div_ceil(INSTANTS).max(1);
        let stable = it.quality.stable;
        let step = |input: usize, scale: f64| -> Result<Vec<f64>, Error> {
            if !stable {
                return Ok(Vec::new());
            }
            let answers = it.closed.channel(input, 0)?.step_response(count, dt)?;
            Ok(answers.into_iter().step_by(every).map(|angle| short(scale * angle)).collect())
        };
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
            marks: marks(it, &seen),
            time: (0..count).step_by(every).map(|k| short(k as f64 * dt)).collect(),
            setpoint: step(0, 1.0)?,
            disturbed: step(2, 1e3 * LOAD)?,
        })
    }
}

impl LoopNumber {
    fn of((key, name, unit, value): (&str, &str, &str, Option<f64>)) -> Self {
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
    /// Of a loop whose corners have been judged.
    fn of(run: &LoopRun) -> Option<Self> {
        let worst = run.corners.first()?;
        let quiet = run.is_quiet() || !run.operating[0].quality.stable;
        let mut sentences = if quiet || !run.is_fair() { run.remarks() } else { Vec::new() };
        if !quiet {
            let share = run.operating[0].quality.noise_torque / run.preset.bench.controller.torque_limit();
            sentences.push(format!(
                "Counts and tacho make a torque noise of {} % of the torque limit, beyond the {} % of a fair tuning: lower \
                 what answers the velocity.",
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

/// What a picture of it needs: a point wherever it has turned or gone on since the one before.
fn thinned(seen: &[Bode]) -> Vec<Bode> {
    let mut kept: Vec<Bode> = Vec::new();
    for (k, it) in seen.iter().enumerate() {
        let tells = kept.last().is_none_or(|last| {
            let near = size(it.gain) < 4.0;
            libm::log(it.frequency / last.frequency) > 0.05
                || (decibels(it.gain) - decibels(last.gain)).abs() > 0.4
                || (it.phase - last.phase).abs() > 2.5
                || near && size(it.gain - last.gain) > 0.04
        });
        if tells || k + 1 == seen.len() {
            kept.push(*it);
        }
    }
    let every = kept.len().div_ceil(FREQUENCIES).max(1);
    kept.into_iter().step_by(every).collect()
}

/// The margins of a loop, on its gain.
fn marks(it: &OperatingLoop, seen: &[Bode]) -> Vec<LoopMark> {
    let margins = &it.quality.margins;
    let at = |[name, sign]: [&str; 2], peak: Option<Peak>, words: &dyn Fn(f64) -> String| {
        let peak = peak.filter(|peak| peak.value.is_finite() && peak.frequency.is_finite())?;
        let gain = it.gain.at_frequency(peak.frequency).map(|gain| gain[(0, 0)]).filter(|l| size(*l).is_finite())?;
        let near = seen.iter().min_by(|x, y| {
            let off = |it: &Bode| libm::log(it.frequency / peak.frequency).abs();
            off(x).total_cmp(&off(y))
        })?;
        let phase = *unwrapped([gain], near.phase).first()?;
        let hertz = peak.frequency / TAU;
        let value = words(peak.value);
        let text = format!("{name} {value} at {} Hz", number(hertz, if hertz < 10.0 { 2 } else { 1 }));
        let beside = format!("{sign} {value}");
        let [frequency, decibels, phase, real, imaginary] = [hertz, decibels(gain), phase, gain.re, gain.im].map(short);
        Some(LoopMark { name: name.into(), text, short: beside, frequency, decibels, phase, real, imaginary })
    };
    [
        at(["gain margin", "GM"], margins.gain, &|value| number(value, 2)),
        at(["phase margin", "PM"], margins.phase, &|value| format!("{}°", number(value.to_degrees(), 1))),
        at(["M_s", "Mₛ"], Some(margins.sensitivity), &|value| number(value, 2)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// In as many digits as a picture can show.
pub(super) fn short(value: f64) -> f64 {
    // A number in scientific notation always parses.
    format!("{value:.5e}").parse().unwrap_or(value)
}
