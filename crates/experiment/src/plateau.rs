//! One speed of a friction measurement: mean torque with its error, and a check that the load slid.

use std::fmt;

use stickslip_core::friction::Friction;

use stickslip_bench::Frame;

use super::missed::with_missed;

/// Rate up to which the velocity loop follows a motion and the encoder resolves it [1/s].
const SWAY_RATE: f64 = 100.0;
/// Blocks of a plateau in figures.
const BLOCKS: usize = 20;
/// Frequencies, in periods a plateau, whose power gives the error of the mean.
const FREQUENCIES: usize = 4;
/// Counts of a window for the mean speed.
const WINDOW_COUNTS: f64 = 30.0;
/// Least ticks of a window; above that speed no load sticks.
const WINDOW_TICKS: f64 = 20.0;
/// Relative deviation of the windows' speeds above which a load sticks or hunts.
const LARGEST_DEVIATION: f64 = 0.15;

/// Means over a part of a plateau, for figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Velocity [rad/s].
    pub velocity: f64,
    /// Friction torque [N m].
    pub torque: f64,
    /// Torque commanded to the load motor, against positive motion [N m].
    pub difference_torque: f64,
    /// Torque of the load motor by its current, against positive motion [N m].
    pub load_torque: f64,
}

/// Reason for which a plateau is not valid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dropped {
    /// The load sticks or hunts.
    Sticks {
        /// RMS deviation of the encoder's mean speed over windows of 30 counts, relative to the set speed.
        deviation: f64,
    },
}

impl fmt::Display for Dropped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Dropped::Sticks { deviation } = self;
        write!(
            f,
            "the load sticks or hunts (its speed deviates by {:.0} %, limit {:.0} %). Use a stiffer coupling, more inertia \
             or a stiffer velocity loop, or start at a higher speed.",
            100.0 * deviation,
            100.0 * LARGEST_DEVIATION
        )
    }
}

/// Measurement at one speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Plateau {
    /// Set velocity [rad/s].
    pub set_velocity: f64,
    /// Mean velocity by the encoder [rad/s].
    pub velocity: f64,
    /// Standard deviation of the estimated velocity about its mean: noise of the observer and true motion [rad/s].
    pub velocity_spread: f64,
    /// Friction torque of the load side, of the velocity's sign [N m].
    pub torque: f64,
    /// Its standard error [N m].
    pub standard_error: f64,
    /// RMS deviation of the speed over windows of counts, relative.
    pub deviation: f64,
    /// RMS speed of the quick motion caused by noise of the drive torque, below the encoder's resolution [rad/s].
    pub sway: f64,
    /// Reason for which it is not valid, if so.
    pub dropped: Option<Dropped>,
    /// Means over its parts.
    pub blocks: Vec<Block>,
    /// Frequency [Hz] and density [N² m² s] of the lowest noise of its torque balance.
    pub(super) noise: [[f64; 2]; FREQUENCIES],
    /// Time of a rectangle that averages white noise as its window does [s].
    pub(super) averaging_time: f64,
    /// Part of the torque that is the machine's own friction, without the load motor's [N m].
    pub(super) own: f64,
    /// Amplitudes of cosine and sine of the angle and its multiples as shares of the own friction, if the plateau has
    /// whole turns.
    pub(super) harmonics: Option<[[f64; 2]; HARMONICS]>,
}

/// Multiples of the screw's angle whose share of the friction is determined.
pub(super) const HARMONICS: usize = 3;

/// Machine data for the torque balance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balance<'a> {
    /// J_M + J_L [kg m²].
    pub(super) inertia: f64,
    /// Friction of the drive motor, not of the load.
    pub(super) motor_friction: &'a Friction<f64>,
    /// Angle of an encoder count [rad].
    pub(super) count: f64,
    /// Time of a tick [s].
    pub(super) dt: f64,
    /// Rise and fall time of a plateau's window [s].
    pub(super) edge_time: f64,
    /// Whether the load motor renders a part of the friction.
    pub(super) renders: bool,
}

impl Balance<'_> {
    /// Evaluates the frames of one plateau.
    pub(super) fn evaluate(&self, set_velocity: f64, frames: &[Frame], whole_turns: bool) -> Plateau {
        let frames = &*with_missed(frames);
        let window = Window::new(frames.len(), self.edge_time / self.dt);
        let weights = window.weights();
        let velocity = self.velocity(frames, &weights);
        // Friction is the torque at constant speed, without the inertia's torque and the motor's own friction.
        let motor_friction = self.motor_friction.steady_torque(velocity, 0.0, 0.0);
        let torque = self.torque(frames, &weights) - motor_friction;
        let no_friction = mean(frames, |frame| frame.signals.commanded_torque) - torque;
        let rendered = if self.renders { mean(frames, |frame| frame.signals.measured_load_torque) } else { 0.0 };
        let own = torque - rendered;
        let blocks: Vec<Block> = (0..BLOCKS)
            .map(|k| &frames[k * frames.len() / BLOCKS..(k + 1) * frames.len() / BLOCKS])
            .filter(|part| !part.is_empty())
            .map(|part| Block {
                velocity: mean(part, |frame| frame.signals.estimated_velocity),
                torque: mean(part, |frame| frame.signals.commanded_torque) - no_friction,
                difference_torque: mean(part, |frame| frame.signals.difference_torque),
                load_torque: mean(part, |frame| frame.signals.measured_load_torque),
            })
            .collect();
        let deviation = self.deviation(set_velocity, frames);
        let averaging_time = self.dt / weights[1..=frames.len()].iter().map(|weight| weight.powi(2)).sum::<f64>();
        // The angle dependence is at the first frequencies of whole turns.
        let noise = self.noise(frames, (&window, &weights), averaging_time, if whole_turns { HARMONICS } else { 0 });
        let estimate = mean(frames, |frame| frame.signals.estimated_velocity);
        let variance = mean(frames, |frame| (frame.signals.estimated_velocity - estimate).powi(2));
        Plateau {
            set_velocity,
            velocity,
            velocity_spread: variance.sqrt(),
            torque,
            standard_error: standard_error(noise.iter(), averaging_time),
            noise,
            averaging_time,
            deviation,
            sway: self.sway(frames),
            // Without a single window the deviation is infinite, and the plateau is not valid either.
            dropped: (deviation > LARGEST_DEVIATION).then_some(Dropped::Sticks { deviation }),
            own,
            harmonics: whole_turns.then(|| harmonics(frames, no_friction + rendered, own)),
            blocks,
        }
    }

    /// Mean of torque minus inertia times acceleration [N m] under weights of sum 1 that begin and end at 0: those of
    /// the tick before the first frame, of the frames, and of the tick after the last one.
    ///
    /// By parts, Σ w·φ̈ = Σ ẅ·φ: the weights are differentiated, not the encoder's counts. (Shinbrot, Trans. ASME 79
    /// (1957) 547, modulating functions.)
    fn torque(&self, frames: &[Frame], weights: &[f64]) -> f64 {
        let Some(first) = frames.first() else { return 0.0 };
        let (mut torque, mut acceleration) = (0.0, 0.0);
        for (frame, weight) in frames.iter().zip(weights.windows(3)) {
            let [before, here, after] = [weight[0], weight[1], weight[2]];
            torque += here * frame.signals.commanded_torque;
            acceleration += (after - 2.0 * here + before) * (frame.angle - first.angle);
        }
        torque - self.inertia * acceleration / (self.dt * self.dt)
    }

    /// Mean velocity [rad/s] under the window, by parts as well.
    fn velocity(&self, frames: &[Frame], weights: &[f64]) -> f64 {
        let Some(first) = frames.first() else { return 0.0 };
        let slopes = weights.windows(3).map(|weight| 0.5 * (weight[2] - weight[0]));
        -frames.iter().zip(slopes).map(|(frame, slope)| slope * (frame.angle - first.angle)).sum::<f64>() / self.dt
    }

    /// Frequency [Hz] and spectral density [N² m² s] of the torque balance at the lowest frequencies after the first
    /// `skipped`.
    ///
    /// The torque alone is coloured by the velocity loop, which turns the noise of its tacho into motion, and its
    /// density rises with the square of the frequency; the balance is not.
    fn noise(
        &self,
        frames: &[Frame],
        (window, weights): (&Window, &[f64]),
        time: f64,
        skipped: usize,
    ) -> [[f64; 2]; FREQUENCIES] {
        std::array::from_fn(|k| {
            let step = std::f64::consts::TAU * (skipped + k + 1) as f64 / window.core();
            let wave = |(index, weight): (usize, &f64)| {
                let (sin, cos) = libm::sincos(step * (index as f64 - 1.0));
                (weight * cos, weight * sin)
            };
            let (cosines, sines): (Vec<f64>, Vec<f64>) = weights.iter().enumerate().map(wave).unzip();
            let [real, imaginary] = [cosines, sines].map(|weights| self.torque(frames, &weights));
            [step / std::f64::consts::TAU / self.dt, time * (real * real + imaginary * imaginary)]
        })
    }

    /// RMS speed [rad/s] of the inertia under the commanded torque at frequencies above [`SWAY_RATE`].
    fn sway(&self, frames: &[Frame]) -> f64 {
        let mean = mean(frames, |frame| frame.signals.commanded_torque);
        let (mut speed, mut squares) = (0.0, 0.0);
        for frame in frames {
            speed += self.dt * ((frame.signals.commanded_torque - mean) / self.inertia - SWAY_RATE * speed);
            squares += speed * speed;
        }
        (squares / frames.len().max(1) as f64).sqrt()
    }

    /// RMS deviation of the encoder's mean speed over windows of counts from the set speed, relative; infinite
    /// without a single window.
    fn deviation(&self, set_velocity: f64, frames: &[Frame]) -> f64 {
        let Some(first) = frames.first() else { return f64::INFINITY };
        let speed = set_velocity.abs();
        let window = (WINDOW_COUNTS * self.count).max(WINDOW_TICKS * self.dt * speed);
        let (mut sum, mut windows) = (0.0, 0usize);
        let mut judge = |duration: f64, way: f64| {
            sum += (way / duration.max(self.dt) / speed - 1.0).powi(2);
            windows += 1;
        };
        // Time since the last edge of a window [s], way since the first edge [rad].
        let (mut time, mut edge, mut last) = (0.0, window, 0.0);
        for frame in &frames[1..] {
            let way = (frame.angle - first.angle) * set_velocity.signum();
            time += self.dt;
            while way >= edge {
                // The edge is within this tick, between `last` and `way`.
                let beyond = self.dt * (way - edge) / (way - last);
                judge(time - beyond, window);
                time = beyond;
                edge += window;
            }
            last = way;
        }
        // A rest longer than two windows: the load is stuck.
        if time * speed > 2.0 * window {
            judge(time, last - (edge - window));
        }
        if windows == 0 { f64::INFINITY } else { (sum / windows as f64).sqrt() }
    }
}

/// Standard error of a mean [N m] over a time [s] under noise with the mean of these densities.
pub(super) fn standard_error<'a>(noise: impl ExactSizeIterator<Item = &'a [f64; 2]>, time: f64) -> f64 {
    let count = noise.len() as f64;
    (noise.map(|[_, density]| density).sum::<f64>() / count / time).sqrt()
}

/// A rectangle smoothed by a Hann window: its spectrum has the rectangle's zeros, so that whole turns average out the
/// angle dependence, and it has no edges, at which the noise of the speed would have its full effect.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// Ticks.
    length: f64,
    /// Ticks of its rise.
    edge: f64,
}

impl Window {
    /// A window over a number of frames; each edge is at most half of it.
    fn new(frames: usize, edge: f64) -> Self {
        let length = frames as f64;
        Window { length, edge: edge.min(0.5 * length) }
    }

    /// Length of the rectangle in ticks.
    fn core(&self) -> f64 {
        self.length - self.edge
    }

    /// Weights of all ticks, with one tick before and one after.
    fn weights(&self) -> Vec<f64> {
        (0..self.length as usize + 2).map(|index| self.weight(index as f64 - 1.0)).collect()
    }

    /// Weight of a tick, 0 outside; their sum is 1.
    fn weight(&self, tick: f64) -> f64 {
        // Ticks are the middles of their intervals.
        let x = ((tick + 0.5).min(self.length - tick - 0.5) / self.edge).clamp(0.0, 1.0);
        (x - libm::sin(std::f64::consts::TAU * x) / std::f64::consts::TAU) / self.core()
    }
}

/// Relative Fourier coefficients of the own friction over whole turns at constant speed.
fn harmonics(frames: &[Frame], no_friction: f64, own: f64) -> [[f64; 2]; HARMONICS] {
    let mut out = [[0.0; 2]; HARMONICS];
    for frame in frames {
        let friction = (frame.signals.commanded_torque - no_friction) / own - 1.0;
        for (order, pair) in out.iter_mut().enumerate() {
            let (sin, cos) = libm::sincos((order + 1) as f64 * frame.angle);
            pair[0] += 2.0 * friction * cos / frames.len() as f64;
            pair[1] += 2.0 * friction * sin / frames.len() as f64;
        }
    }
    out
}

fn mean(frames: &[Frame], value: impl Fn(&Frame) -> f64) -> f64 {
    frames.iter().map(value).sum::<f64>() / frames.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use stickslip_core::tick::TickOutput;
    use stickslip_software::supervise::SafetyState;

    use super::*;

    const DT: f64 = 250e-6;
    const COUNT: f64 = std::f64::consts::TAU / 10_000.0;

    fn evaluate(set_velocity: f64, seconds: f64, angle: impl Fn(f64) -> f64, torque: impl Fn(f64) -> f64) -> Plateau {
        evaluate_some(set_velocity, seconds, angle, torque, |_| true)
    }

    fn evaluate_some(
        set_velocity: f64,
        seconds: f64,
        angle: impl Fn(f64) -> f64,
        torque: impl Fn(f64) -> f64,
        is_run: impl Fn(&u64) -> bool,
    ) -> Plateau {
        let frames: Vec<Frame> = (0..(seconds / DT) as u64)
            .filter(is_run)
            .map(|cycle| {
                let t = cycle as f64 * DT;
                let signals = TickOutput { commanded_torque: torque(t), ..TickOutput::default() };
                Frame {
                    cycle,
                    angle: (angle(t) / COUNT).floor() * COUNT,
                    command: Default::default(),
                    safety: SafetyState::Running,
                    measurement: Default::default(),
                    signals,
                }
            })
            .collect();
        let balance = Balance {
            inertia: 1e-3,
            motor_friction: &Friction::default(),
            count: COUNT,
            dt: DT,
            edge_time: 0.1,
            renders: false,
        };
        balance.evaluate(set_velocity, &frames, false)
    }

    #[test]
    fn inertia_does_not_count_as_friction() {
        // 10 rad/s that still rise by 2 rad/s² take 2 mN m.
        let plateau = evaluate(10.0, 0.6, |t| 10.0 * t + t * t, |_| 0.202);
        assert!((plateau.torque - 0.2).abs() < 2e-5, "{}", plateau.torque);
        assert!((plateau.velocity - 10.6).abs() < 1e-3);
        assert_eq!(plateau.dropped, None);
    }

    #[test]
    fn the_error_of_the_mean_is_that_of_white_noise_and_ignores_a_ripple() {
        let normals = stickslip_base::noise::Normals::new(5);
        let (mut squares, mut errors) = (0.0, 0.0);
        for run in 0..200u64 {
            let torque = |t: f64| {
                let ripple = 0.05 * libm::sin(std::f64::consts::TAU * 26.0 * t / 0.5);
                0.2 + ripple + 0.01 * normals.pair(0, run * 10_000 + (t / DT).round() as u64)[0]
            };
            // Two edges of 0.1 s and a rectangle of 0.5 s.
            let plateau = evaluate(5.0, 0.6, |t| 5.0 * t, torque);
            squares += (plateau.torque - 0.2).powi(2) / 200.0;
            errors += plateau.standard_error.powi(2) / 200.0;
        }
        // 0.01 N m over √2000, a little more for the edges; 200 runs give the mean square to 10 %.
        assert!((squares.sqrt() / 2.236e-4 - 1.0).abs() < 0.15, "{}", squares.sqrt());
        assert!((errors.sqrt() / squares.sqrt() - 1.0).abs() < 0.15, "{}", errors.sqrt());
    }

    #[test]
    fn motion_by_noise_of_the_loop_does_not_count_as_friction() {
        // The speed sways by 0.05 rad/s at 7 Hz, not a whole number of periods in the plateau: at its ends the inertia
        // alone would be mistaken for 1e-3 · 0.1 / 0.2 = 5e-4 N m.
        let (omega, sway) = (std::f64::consts::TAU * 7.0, 0.05);
        let angle = |t: f64| 5.0 * t - sway / omega * libm::cos(omega * t + 0.4);
        let plateau = evaluate(5.0, 0.3, angle, |t| 0.2 + 1e-3 * sway * omega * libm::cos(omega * t + 0.4));
        assert!((plateau.torque - 0.2).abs() < 1e-5, "{}", plateau.torque);
    }

    #[test]
    fn torque_during_missed_ticks_counts() {
        // 0.1 N m more than the friction for 20 ms, which 79 of its 80 ticks miss, and as much less for 20 ms later.
        let torque = |t: f64| {
            0.2 + if (0.3..0.32).contains(&t) { 0.1 } else { 0.0 } - if (0.5..0.52).contains(&t) { 0.1 } else { 0.0 }
        };
        let angle = |t: f64| {
            let [up, down] = [0.3, 0.5].map(|start| (t - start).clamp(0.0, 0.02));
            // The axis gains 2 rad/s and loses them.
            let gain = |risen: f64, since: f64| 100.0 * risen * (since - 0.5 * risen);
            20.0 * t + gain(up, t - 0.3) - gain(down, t - 0.5)
        };
        let all = evaluate(20.0, 0.8, angle, torque);
        let some = evaluate_some(20.0, 0.8, angle, torque, |cycle| !(1201..1280).contains(cycle));
        assert!((all.torque - 0.2).abs() < 2e-5, "{}", all.torque);
        assert!((some.torque - 0.2).abs() < 5e-5, "{}", some.torque);
        assert!((some.velocity - all.velocity).abs() < 1e-2, "{} {}", some.velocity, all.velocity);
        assert_eq!(some.dropped, None);
    }

    #[test]
    fn a_sticking_load_is_dropped_and_a_sliding_one_is_not() {
        let slides = evaluate(0.1, 2.0, |t| 0.1 * t, |_| 0.3);
        assert!(slides.dropped.is_none() && slides.deviation < 0.08, "{}", slides.deviation);
        // Stick-slip: 0.5 s of rest, then the way of 0.5 s in one step.
        let jumps = evaluate(0.1, 2.0, |t| 0.05 * (t / 0.5).floor(), |_| 0.3);
        assert!(matches!(jumps.dropped, Some(Dropped::Sticks { deviation }) if deviation > 0.15));
        let stuck = evaluate(0.1, 2.0, |_| 0.0, |_| 0.3);
        assert!(stuck.dropped.is_some());
        assert!(stuck.dropped.is_some_and(|reason| reason.to_string().contains("sticks or hunts")));
    }
}
