//! A simulated axis with known truth, and its recording: strokes under a cascade of position and velocity loop.

use std::f64::consts::TAU;

/// The truth.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    pub(crate) inertia: f64,
    pub(crate) viscous: f64,
    pub(crate) coulomb: f64,
    /// Force per command.
    pub(crate) gain: f64,
    /// Constant force against positive motion.
    pub(crate) offset: f64,
    /// Friction per drive force.
    pub(crate) load: f64,
    /// Amplitude and period of a force over position.
    pub(crate) ripple: Option<[f64; 2]>,
    /// Time constant of the drive [s].
    pub(crate) lag: f64,
    /// Samples by which the recorded position is late.
    pub(crate) delay: usize,
    /// Step of the encoder.
    pub(crate) grid: f64,
    /// Standard deviation of the noise of the position.
    pub(crate) noise: f64,
    /// Standard deviation and time constant [s] of a random force.
    pub(crate) disturbance: [f64; 2],
    /// Share by which friction falls from start to end.
    pub(crate) warm_up: f64,
    /// Share of the inertia behind a spring, and its frequency with the motor held [Hz].
    pub(crate) elastic: Option<[f64; 2]>,
}

/// The movement.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) rate: f64,
    pub(crate) seconds: f64,
    pub(crate) stroke: f64,
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
    /// Whether the axis never reverses.
    pub(crate) forward_only: bool,
    /// Amplitude of pulses added to the command, as a force divided by the gain.
    pub(crate) pulses: f64,
    pub(crate) seed: u64,
}

/// What a logger would have of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Record {
    pub(crate) position: Vec<f64>,
    pub(crate) reference: Vec<f64>,
    /// Command of the controller, without the pulses.
    pub(crate) command: Vec<f64>,
    pub(crate) injected: Vec<f64>,
}

/// Random numbers (SplitMix64).
#[derive(Clone, Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Evenly between two bounds.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let share = ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * share
    }

    /// Evenly in the logarithm.
    pub(crate) fn decades(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.between(libm::log(low), libm::log(high)))
    }

    /// Normal, standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        let (u, v) = (self.between(1e-300, 1.0), self.between(0.0, 1.0));
        (-2.0 * libm::log(u)).sqrt() * libm::cos(TAU * v)
    }
}

impl Plan {
    /// Strokes with trapezoidal speed, some of them slower, with pauses; corners rounded over 40 ms.
    fn reference(&self, random: &mut Random) -> Vec<f64> {
        let (samples, period) = ((self.rate * self.seconds) as usize, 1.0 / self.rate);
        let mut speeds: Vec<f64> = Vec::new();
        let mut sign = 1.0;
        while speeds.len() < samples {
            let acceleration = self.acceleration * random.between(0.3, 1.0);
            let distance = self.stroke * random.between(0.4, 1.0);
            let speed = (self.speed * random.between(0.15, 1.0)).min(0.9 * (distance * acceleration).sqrt());
            let rise = (speed / acceleration * self.rate) as usize + 1;
            let plateau = ((distance / speed - speed / acceleration) * self.rate) as usize + 1;
            let level = if self.forward_only { 0.3 * self.speed } else { 0.0 };
            let ramp =
                |k: usize| level + sign * speed * k as f64 / rise as f64 * if self.forward_only { 0.7 } else { 1.0 };
            let top = ramp(rise);
            speeds.extend((0..rise).map(ramp));
            speeds.extend(std::iter::repeat_n(top, plateau));
            speeds.extend((0..rise).rev().map(ramp));
            speeds.extend(std::iter::repeat_n(level, random.between(0.0, 0.2 * self.rate) as usize));
            sign = if self.forward_only { 1.0 } else { -sign };
        }
        let width = ((0.04 * self.rate) as usize).max(2);
        let window: Vec<f64> = (1..width).map(|k| 1.0 - libm::cos(TAU * k as f64 / width as f64)).collect();
        let total: f64 = window.iter().sum();
        let mut position = 0.0;
        (0..samples)
            .map(|i| {
                let terms = window.iter().enumerate().map(|(k, w)| w * speeds[i.saturating_sub(k)]);
                position += period * terms.sum::<f64>() / total;
                position
            })
            .collect()
    }
}

impl Axis {
    /// The recording of a movement.
    pub(crate) fn record(&self, plan: &Plan) -> Record {
        let mut random = Random(plan.seed);
        let reference = plan.reference(&mut random);
        let period = 1.0 / plan.rate;
        // Closed loop: a bandwidth that the sampling allows.
        let bandwidth = (0.1 * plan.rate).min(120.0);
        let (outer, inner) = (0.3 * bandwidth, bandwidth * self.inertia / self.gain);
        let steps = ((1e4 / plan.rate) as usize).clamp(4, 40);
        let dt = period / steps as f64;
        // Of the force behind the lag: its change over a step, and its mean over it.
        let (change, mean) = match self.lag > 0.0 {
            true => (1.0 - libm::exp(-dt / self.lag), 1.0 - self.lag / dt * (1.0 - libm::exp(-dt / self.lag))),
            false => (1.0, 1.0),
        };
        let memory = libm::exp(-period / self.disturbance[1]);
        let [share, frequency] = self.elastic.unwrap_or([0.0, 1.0]);
        let (motor, far) = (self.inertia * (1.0 - share), self.inertia * share);
        let stiffness = far * (TAU * frequency).powi(2);
        let damping = 0.04 * (stiffness * far).sqrt();
        let (mut x, mut v, mut y, mut w, mut behind) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let (mut random_force, mut before) = (0.0, [0.0; 2]);
        let mut record = Record::default();
        for (i, wanted) in reference.iter().enumerate() {
            let seen = ((x + self.noise * random.normal()) / self.grid).round() * self.grid;
            let command = inner * (outer * (wanted - seen) - (seen - before[1]) / (2.0 * period));
            before = [seen, before[0]];
            // Pulses of 60 ms with pauses, by turns in both directions.
            let phase = (i as f64 * period / 0.06) as usize % 8;
            let pulse = plan.pulses * (f64::from(phase == 0) - f64::from(phase == 4));
            random_force =
                memory * random_force + self.disturbance[0] * (1.0 - memory * memory).sqrt() * random.normal();
            let warm = 1.0 - self.warm_up * i as f64 / reference.len() as f64;
            for _ in 0..steps {
                let missing = self.gain * (command + pulse) - behind;
                let drive = behind + mean * missing;
                behind += change * missing;
                let spring = stiffness * (x - y) + damping * (v - w);
                let ripple = self.ripple.map_or(0.0, |[amplitude, length]| amplitude * libm::sin(TAU * x / length));
                let level = warm * self.coulomb + self.load * drive.abs();
                let free = drive + random_force - self.offset - ripple - warm * self.viscous * v - spring;
                let arrest = motor / dt * v + free;
                let next = v + dt / motor * (free - arrest.clamp(-level, level));
                x += 0.5 * dt * (v + next);
                v = next;
                if far > 0.0 {
                    w += dt / far * spring;
                    y += dt * w;
                }
            }
            record.position.push(seen);
            record.reference.push(*wanted);
            record.command.push(command);
            record.injected.push(pulse);
        }
        let late = |k: usize| record.position[k.saturating_sub(self.delay)];
        record.position = (0..reference.len()).map(late).collect();
        record
    }
}
