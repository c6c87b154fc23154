//! Iterative learning: the same motion is repeated, each time with a torque corrected by the deviation of the
//! repetition before.
//!
//!   U⁺ = Q·(U + L·E),   L = γ·S*/(|S|² + (ρ·max|S|)²)
//!
//! over the harmonics of the motion: E of the deviation, U of the torque added to the controller's, and S from that
//! torque to the angle under control, by the modelled axis. Q passes the frequencies below a cut-off, without phase.
//! D. A. Bristow, M. Tharayil, A. G. Alleyne, IEEE Control Systems 26 (3) (2006) 96.
//!
//! A deviation that does not repeat cannot be learnt: where a load sticks and slips by chance, learning makes it worse.
//! Therefore the best torque so far is stored, and learning ends after two repetitions in a row without improvement.

use std::f64::consts::TAU;

use nalgebra::Complex;
use stickslip_core::Fields;
use stickslip_core::control::reference::{Generator, Reference, Sine};

use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame};
use stickslip_design::linear::{Operating, size};
use stickslip_design::{PositionLoop, axis_control};

/// Time in which a motion and its torque fade in [s].
const FADE: f64 = 0.5;
/// Periods between the fade-in and the evaluated period.
const RUN_IN: usize = 2;
/// Smallest improvement over the best repetition before, as a share.
const WORTH_IT: f64 = 0.02;
/// Number of repetitions in a row without improvement that end the learning.
const PATIENCE: usize = 2;

/// Plan of iterative learning along a sine.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct LearningPlan<T> {
    /// Amplitude of the sine.
    #[field(symbol = "r₀", unit = "rad", range = 1e-3..=1e3, default = 2.0)]
    pub amplitude: T,
    /// Frequency of the sine; rounded so that a period is a whole number of ticks.
    #[field(symbol = "f", unit = "Hz", range = 0.02..=50.0, default = 2.0)]
    pub frequency: T,
    /// Largest number of repetitions; the first has no learnt torque.
    #[field(symbol = "n", unit = "1", range = 2.0..=200.0, default = 11.0, whole)]
    pub repetitions: T,
    /// Share of the deviation learnt in one repetition.
    #[field(symbol = "γ", unit = "1", range = 0.01..=1.0, default = 0.6)]
    pub share: T,
    /// Share of its peak below which the drive's response is not inverted.
    #[field(symbol = "ρ", unit = "1", range = 1e-3..=1.0, default = 0.2)]
    pub regularisation: T,
    /// Frequency up to which the torque is learnt completely; above twice this frequency nothing is learnt.
    #[field(symbol = "f_Q", unit = "Hz", range = 0.1..=1000.0, default = 60.0)]
    pub cutoff: T,
}

/// One repetition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repetition {
    /// Deviation by the encoder, RMS over the period [rad].
    pub deviation: f64,
    /// Largest magnitude of the deviation [rad].
    pub peak: f64,
    /// RMS of the added torque [N m].
    pub torque: f64,
}

/// Result of the learning.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// All repetitions.
    pub repetitions: Vec<Repetition>,
    /// Index of the best repetition.
    pub best: usize,
    /// Its torque over a period, one value for each tick [N m].
    pub torque: Vec<f64>,
    /// Its deviation over a period, and that of the first repetition [rad].
    pub deviations: [Vec<f64>; 2],
    /// Time of a tick [s].
    pub dt: f64,
    /// Whether it ended because the deviation no longer decreased.
    pub stopped: bool,
    /// Whether it was completed.
    pub complete: bool,
    /// Time on the bench [s].
    pub duration: f64,
}

impl LearningPlan<f64> {
    /// Ticks of a period.
    fn ticks(&self, dt: f64) -> usize {
        (1.0 / (self.frequency * dt)).round().max(2.0) as usize
    }

    /// Periods before the evaluated one, with ticks of this length [s].
    fn periods_before(&self, dt: f64) -> usize {
        (FADE / (self.ticks(dt) as f64 * dt)).ceil().max(1.0) as usize + RUN_IN
    }

    /// Longest bench time, with ticks of this length [s].
    pub fn duration(&self, dt: f64) -> f64 {
        // And half a second to come to rest.
        self.repetitions * ((self.periods_before(dt) + 1) as f64 * self.ticks(dt) as f64 * dt + 0.5)
    }
}

/// Learns the torque that a sine requires in addition to the controller's. The bench must be homed and running.
///
/// # Errors
/// [`Error::NotHomed`]; errors of the loop's design; [`Error::BenchFault`]; [`Error::TooFew`] if all periods had missed
/// ticks; [`Error::Cancelled`] before the second repetition has ended; afterwards a cancelled learning returns the best
/// so far as not complete.
pub fn learn_torque(plan: &LearningPlan<f64>, bench: &mut dyn Bench, watch: &Watch) -> Result<Learned, Error> {
    if bench.zero().is_none() {
        return Err(Error::NotHomed);
    }
    let dt = bench.settings().tick_time();
    let filter = Filter::new(plan, bench)?;
    let first = bench.step(Command::default())?;
    let mut learned = Learned {
        repetitions: Vec::new(),
        best: 0,
        torque: vec![0.0; filter.ticks],
        deviations: [Vec::new(), Vec::new()],
        dt,
        stopped: false,
        complete: true,
        duration: 0.0,
    };
    let mut harmonics = vec![Complex::new(0.0, 0.0); filter.gains.len()];
    let mut in_vain = 0;
    for number in 0..plan.repetitions as usize {
        let torque = filter.wave(&harmonics);
        let deviations = match repeat(plan, &torque, first.angle, number, bench, watch) {
            Err(Error::Cancelled) if number > 1 => {
                learned.complete = false;
                bench.come_to_rest()?;
                break;
            }
            Err(error) => {
                if matches!(error, Error::Cancelled) {
                    bench.come_to_rest()?;
                }
                return Err(error);
            }
            Ok(deviations) => deviations,
        };
        let rms = |values: &[f64]| libm::sqrt(values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64);
        let peak = deviations.iter().fold(0.0f64, |peak, deviation| peak.max(deviation.abs()));
        learned.repetitions.push(Repetition { deviation: rms(&deviations), peak, torque: rms(&torque) });
        filter.learn(&mut harmonics, &deviations);
        let best = learned.repetitions[learned.best].deviation;
        if number == 0 {
            learned.deviations = [deviations.clone(), deviations];
        } else if learned.repetitions[number].deviation < (1.0 - WORTH_IT) * best {
            in_vain = 0;
            learned.best = number;
            learned.torque = torque;
            learned.deviations[0] = deviations;
        } else {
            in_vain += 1;
        }
        if in_vain >= PATIENCE {
            learned.stopped = true;
            break;
        }
    }
    let last = bench.step(Command::default())?;
    learned.duration = (last.cycle - first.cycle) as f64 * dt;
    Ok(learned)
}

/// One repetition: the deviations of the evaluated period, one for each tick [rad].
fn repeat(
    plan: &LearningPlan<f64>,
    torque: &[f64],
    origin: f64,
    number: usize,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Vec<f64>, Error> {
    let dt = bench.settings().tick_time();
    let (ticks, before) = (torque.len(), plan.periods_before(dt));
    let frequency = 1.0 / (ticks as f64 * dt);
    let sine = Sine { amplitude: plan.amplitude, frequency, fade_time: FADE };
    let mut setpoints = Generator::new(Reference::Sine(sine), 1.0 / dt).with_origin(origin);
    let mut deviations = vec![f64::NAN; ticks];
    let mut see = |frame: &Frame| {
        // The mark is the tick of the evaluated period, from 1.
        if let Some(tick) = (frame.command.mark as usize).checked_sub(1) {
            deviations[tick] = frame.command.setpoint.position - frame.angle;
        }
    };
    for k in 0..(before + 1) * ticks {
        if k % ticks == 0 {
            let done = number as f64 + k as f64 / ((before + 1) * ticks) as f64;
            watch.stage("repetitions", done / plan.repetitions)?;
        } else if k % 512 == 0 {
            watch.check()?;
        }
        let share = (k as f64 * dt / FADE).min(1.0);
        let mark = (k + 1).saturating_sub(before * ticks) as u32;
        let added_torque = share * torque[k % ticks];
        let command = Command { setpoint: setpoints.next(), control: true, added_torque, mark, ..Command::default() };
        bench.hand_over(command)?.iter().for_each(&mut see);
    }
    bench.drain(&mut see)?;
    bench.come_to_rest()?;
    // A missed tick gets the deviation of the tick before.
    let first = deviations.iter().copied().find(|deviation| deviation.is_finite());
    let mut last = first.ok_or(Error::TooFew {
        what: "ticks of a repetition",
        found: 0,
        needed: 1,
        remedy: "All ticks were missed: check this computer with `stickslip doctor`.",
    })?;
    for deviation in &mut deviations {
        last = if deviation.is_finite() { *deviation } else { last };
        *deviation = last;
    }
    Ok(deviations)
}

/// The filter from deviation to torque, harmonic by harmonic.
struct Filter {
    ticks: usize,
    /// Learning gain and passed share of each harmonic from the first on.
    gains: Vec<(Complex<f64>, f64)>,
    /// e^(j·2π·k/n) for each tick.
    turns: Vec<Complex<f64>>,
}

impl Filter {
    fn new(plan: &LearningPlan<f64>, bench: &dyn Bench) -> Result<Self, Error> {
        let (model, settings) = (bench.model(), bench.settings());
        let dt = settings.tick_time();
        let ticks = plan.ticks(dt);
        let base = 1.0 / (ticks as f64 * dt);
        let count = ((2.0 * plan.cutoff / base).ceil() as usize).min(ticks / 2 - 1).max(1);
        let frequencies: Vec<f64> = (1..=count).map(|h| TAU * base * h as f64).collect();
        // A sine is near half of its greatest speed for most of its time.
        let speed = 0.5 * TAU * base * plan.amplitude;
        let control = axis_control(model, settings)?;
        let closes = PositionLoop::new(control, model, settings, Operating::Sliding(speed))?;
        // In the loop a torque is delayed by a sample of the controller; here it is delayed by a tick and held for one.
        let sooner = 1.5 * (settings.control_period() - dt);
        let answers: Vec<Complex<f64>> = closes
            .torque_to_angle(&frequencies)?
            .into_iter()
            .zip(&frequencies)
            .map(|(answer, frequency)| {
                answer * Complex::new(libm::cos(frequency * sooner), libm::sin(frequency * sooner))
            })
            .collect();
        let peak = answers.iter().map(|answer| size(*answer)).fold(0.0, f64::max);
        let floor = plan.regularisation * peak;
        let gains = answers
            .into_iter()
            .zip(&frequencies)
            .map(|(answer, frequency)| {
                // 1 up to the cut-off, 0 from twice that on.
                let beyond = (frequency / TAU / plan.cutoff - 1.0).clamp(0.0, 1.0);
                let passed = 0.5 * (1.0 + libm::cos(0.5 * TAU * beyond));
                let square = size(answer) * size(answer);
                (answer.conj() * (plan.share / (square + floor * floor)), passed)
            })
            .collect();
        let angle = |k: usize| TAU * k as f64 / ticks as f64;
        let turns = (0..ticks).map(|k| Complex::new(libm::cos(angle(k)), libm::sin(angle(k)))).collect();
        Ok(Filter { ticks, gains, turns })
    }

    /// e^(j·2π·h·k/n).
    fn turn(&self, harmonic: usize, tick: usize) -> Complex<f64> {
        self.turns[harmonic * tick % self.ticks]
    }

    /// The torque over a period [N m].
    fn wave(&self, harmonics: &[Complex<f64>]) -> Vec<f64> {
        let at = |tick: usize| harmonics.iter().enumerate().map(|(h, value)| (value * self.turn(h + 1, tick)).re).sum();
        (0..self.ticks).map(at).collect()
    }

    /// Updates the torque by a period's deviations [rad].
    fn learn(&self, harmonics: &mut [Complex<f64>], deviations: &[f64]) {
        for (h, (torque, (gain, passed))) in harmonics.iter_mut().zip(&self.gains).enumerate() {
            let sum: Complex<f64> =
                deviations.iter().enumerate().map(|(k, deviation)| self.turn(h + 1, k).conj() * *deviation).sum();
            *torque = (*torque + gain * (sum * (2.0 / self.ticks as f64))) * *passed;
        }
    }
}
