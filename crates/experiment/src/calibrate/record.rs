//! The runs for the fit: both motors excited while the axis turns fast, and the load shaken at rest.

use std::f64::consts::TAU;

use stickslip_core::Fields;
use stickslip_core::control::reference::Setpoint;

use super::response::Regime;
use super::segment::{Sample, Segment};
use stickslip_base::{Error, Watch};
use stickslip_bench::{Bench, Command, Frame, SpeedRamp};

/// Plan of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Fields)]
pub struct CalibrationPlan<T> {
    /// Mean speed of the fast runs over the Stribeck velocity of the model.
    #[field(symbol = "Ω/Ω_Strib", unit = "1", range = 3.0..=100.0, default = 14.0)]
    pub speed_ratio: T,
    /// Duration of each fast run; one run in each direction.
    #[field(symbol = "T", unit = "s", range = 1.0..=60.0, default = 5.0)]
    pub duration: T,
    /// Relative amplitude of the set speed.
    #[field(symbol = "ΔΩ/Ω", unit = "1", range = 0.0..=0.5, default = 0.15)]
    pub swing: T,
    /// RMS acceleration of the screw by the excitation of each motor.
    #[field(symbol = "Ω̇_rms", unit = "rad/s^2", range = 1.0..=1e4, default = 80.0)]
    pub acceleration: T,
    /// Lowest frequency of the excitation.
    #[field(symbol = "f_1", unit = "Hz", range = 0.1..=100.0, default = 3.0)]
    pub lowest_frequency: T,
    /// Highest frequency of the excitation.
    #[field(symbol = "f_2", unit = "Hz", range = 10.0..=2000.0, default = 500.0)]
    pub highest_frequency: T,
    /// Time for which the load is shaken at rest.
    #[field(symbol = "T_0", unit = "s", range = 0.5..=60.0, default = 4.0)]
    pub rest_duration: T,
    /// RMS torque of the excitation at rest over the measured breakaway torque.
    #[field(symbol = "M/M_S", unit = "1", range = 1e-3..=0.3, default = 0.15)]
    pub rest_share: T,
    /// Length of the segments of a record.
    #[field(symbol = "T_s", unit = "s", range = 0.05..=10.0, default = 0.25)]
    pub segment: T,
}

/// Lines of a multisine.
const LINES: usize = 48;
/// Acceleration between the runs [rad/s²].
const TRAVEL: f64 = 200.0;
/// Frequencies between which the load is shaken at rest [Hz]: around the resonance of its mass on its bristles.
const REST_BAND: [f64; 2] = [20.0, 350.0];
/// Time at speed before the excitation begins [s].
const SETTLING: f64 = 0.1;
/// Time at rest before the load is shaken [s].
const REST: f64 = 0.3;
/// Slowest and fastest mean speed of a run [rad/s].
const SPEEDS: [f64; 2] = [25.0, 50.0];

/// Sines at frequencies spaced evenly on a logarithmic scale, with the same amplitude and phases that keep their sum
/// low. Two of them, interleaved, have no frequency in common.
struct Multisine {
    amplitude: f64,
    lines: Vec<[f64; 2]>,
}

impl Multisine {
    fn new(rms: f64, lowest: f64, highest: f64, second: bool) -> Self {
        let shift = if second { 0.5 } else { 0.0 };
        let ratio = libm::log(highest / lowest) / LINES as f64;
        let lines = (0..LINES)
            .map(|n| {
                let n = n as f64 + shift;
                // Multiples of the golden section spread the phases evenly.
                [lowest * libm::exp(ratio * n), TAU * ((n * n * 0.618_033_988_749_895) % 1.0)]
            })
            .collect();
        Multisine { amplitude: rms * libm::sqrt(2.0 / LINES as f64), lines }
    }

    fn at(&self, time: f64) -> f64 {
        let sum: f64 = self.lines.iter().map(|[f, phase]| libm::sin(TAU * ((f * time) % 1.0) + phase)).sum();
        self.amplitude * sum
    }
}

impl CalibrationPlan<f64> {
    /// Mean speed of the fast runs [rad/s] for a Stribeck velocity [rad/s].
    pub(super) fn speed(&self, stribeck_velocity: f64) -> f64 {
        (self.speed_ratio * stribeck_velocity).clamp(SPEEDS[0], SPEEDS[1])
    }

    /// Bench time of both fast runs and the ways between them [s].
    pub(super) fn turning_time(&self, stribeck_velocity: f64) -> f64 {
        let speed = self.speed(stribeck_velocity);
        // Half a run's way out and half a run's way back, two runs, and a ramp up and down for each.
        3.0 * self.duration + 8.0 * speed / TRAVEL + 2.0 * SETTLING
    }

    /// Bench time at rest [s].
    pub(super) fn resting_time(&self) -> f64 {
        REST + self.rest_duration
    }
}

/// Collects frames as samples: the output of a frame acts from the next one on.
struct Recorder {
    /// Stretches without a missed tick.
    stretches: Vec<Vec<Sample>>,
    /// Number of the next tick.
    next: u64,
    before: Option<[f64; 2]>,
    /// Winding voltage, or current, per volt for the load amplifier.
    gain: f64,
    per_ampere: f64,
}

impl Recorder {
    fn new(bench: &dyn Bench) -> Self {
        let model = bench.model();
        let takes_torque = bench.settings().torque_amplifier > 0.5;
        let gain = if takes_torque { 1.0 } else { model.load_amplifier.gain };
        let per_ampere = model.scaling.current_sensor;
        Recorder { stretches: Vec::new(), next: 0, before: None, gain, per_ampere }
    }

    fn push(&mut self, frame: &Frame) {
        let measurement = &frame.measurement;
        if let (Some([servo_voltage, amplifier_voltage]), true) = (self.before, frame.cycle == self.next) {
            let Some(stretch) = self.stretches.last_mut() else { return };
            stretch.push(Sample {
                servo_voltage,
                load_command: self.gain * amplifier_voltage,
                angle: frame.angle,
                measured: [
                    0.0,
                    measurement.tacho_voltage,
                    measurement.accelerometer_voltage,
                    measurement.current_voltage / self.per_ampere,
                ],
            });
        } else {
            self.stretches.push(Vec::new());
        }
        self.next = frame.cycle + 1;
        self.before = Some([frame.signals.servo_voltage, frame.signals.amplifier_voltage]);
    }

    /// The record in segments of `length` samples without a missed tick; angles count from the start of each.
    fn cut(self, length: usize, regime: Regime, velocity: f64) -> Vec<Segment> {
        let pieces = self.stretches.iter().flat_map(|stretch| stretch.chunks_exact(length));
        pieces
            .map(|piece| {
                let mut samples = piece.to_vec();
                let start = samples[0].angle;
                samples.iter_mut().for_each(|sample| sample.measured[0] = sample.angle - start);
                Segment::new(regime, samples, velocity)
            })
            .collect()
    }
}

/// Both directions at high speed, both motors excited. The bench must be homed and under its speed holder.
pub(super) fn turning(
    plan: &CalibrationPlan<f64>,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Vec<Segment>, Error> {
    let (model, dt) = (*bench.model(), bench.settings().tick_time());
    let speed = plan.speed(model.own.stribeck_velocity);
    let rms = plan.acceleration * model.drive.inertia();
    let drive = Multisine::new(rms, plan.lowest_frequency, plan.highest_frequency, false);
    let load = Multisine::new(rms, plan.lowest_frequency, plan.highest_frequency, true);
    let mut segments = Vec::new();
    let mut traveller = SpeedRamp::new(bench.step(Command::default())?.angle, TRAVEL, dt);
    let out = -0.5 * speed * plan.duration - 0.5 * speed * speed / TRAVEL;
    travel(bench, &mut traveller, out, speed, watch)?;
    for sign in [1.0, -1.0] {
        let friction = |at: f64| model.motor_friction.steady_torque(sign * at, 0.0, 0.0);
        let slope = (friction(1.1 * speed) - friction(0.9 * speed)) * sign / (0.2 * speed);
        let regime = Regime::Sliding { level: friction(speed) - slope * sign * speed, slope };
        while traveller.setpoint.velocity != sign * speed {
            bench.hand_over(under_control(traveller.toward(sign * speed)))?;
        }
        for _ in 0..(SETTLING / dt) as u64 {
            bench.hand_over(under_control(traveller.toward(sign * speed)))?;
        }
        let mut recorder = Recorder::new(bench);
        let mark = if sign > 0.0 { 1 } else { 2 };
        let mut see = |frame: &Frame| {
            if frame.command.mark == mark {
                recorder.push(frame);
            }
        };
        let mut target = 1.0 + plan.swing;
        for tick in 0..(plan.duration / dt) as u64 {
            let time = tick as f64 * dt;
            if traveller.setpoint.velocity == sign * speed * target {
                target = 2.0 - target;
            }
            let setpoint = traveller.toward(sign * speed * target);
            let (added_torque, added_load_torque) = (drive.at(time), load.at(time));
            let command = Command { added_torque, added_load_torque, mark, ..under_control(setpoint) };
            bench.hand_over(command)?.iter().for_each(&mut see);
            if tick % 2048 == 0 {
                let part = if sign > 0.0 { 0.0 } else { 0.5 };
                watch.stage("both motors excited at speed", part + 0.5 * time / plan.duration)?;
            }
        }
        while traveller.setpoint.velocity != 0.0 {
            bench.hand_over(under_control(traveller.toward(0.0)))?.iter().for_each(&mut see);
        }
        bench.drain(&mut see)?;
        segments.extend(recorder.cut((plan.segment / dt).round() as usize, regime, sign * speed));
    }
    travel(bench, &mut traveller, 0.0, speed, watch)?;
    Ok(segments)
}

/// The load shaken at rest, far below breakaway [N m].
pub(super) fn resting(
    plan: &CalibrationPlan<f64>,
    breakaway_torque: f64,
    bench: &mut dyn Bench,
    watch: &Watch,
) -> Result<Vec<Segment>, Error> {
    let dt = bench.settings().tick_time();
    let rms = plan.rest_share * breakaway_torque;
    let load = Multisine::new(rms, REST_BAND[0], REST_BAND[1], true);
    // Without torque the bristles unbend; then the load is where their torque is zero.
    for _ in 0..(REST / dt) as u64 {
        bench.hand_over(Command::default())?;
    }
    let mut recorder = Recorder::new(bench);
    let mark = 3;
    let mut see = |frame: &Frame| {
        if frame.command.mark == mark {
            recorder.push(frame);
        }
    };
    for tick in 0..(plan.rest_duration / dt) as u64 {
        let time = tick as f64 * dt;
        let command = Command { added_load_torque: load.at(time), mark, ..Command::default() };
        bench.hand_over(command)?.iter().for_each(&mut see);
        if tick % 2048 == 0 {
            watch.stage("the load shaken at rest", time / plan.rest_duration)?;
        }
    }
    bench.drain(&mut see)?;
    Ok(recorder.cut((plan.segment / dt).round() as usize, Regime::Stuck, 0.0))
}

fn under_control(setpoint: Setpoint<f64>) -> Command {
    Command { setpoint, control: true, ..Command::default() }
}

/// Goes to an angle [rad] at up to a speed [rad/s], and stops there.
fn travel(bench: &mut dyn Bench, traveller: &mut SpeedRamp, to: f64, speed: f64, watch: &Watch) -> Result<(), Error> {
    let sign = if to < traveller.setpoint.position { -1.0 } else { 1.0 };
    while sign * (to - traveller.setpoint.position) > sign * traveller.way_to(0.0) {
        bench.hand_over(under_control(traveller.toward(sign * speed)))?;
    }
    while traveller.setpoint.velocity != 0.0 {
        bench.hand_over(under_control(traveller.toward(0.0)))?;
    }
    watch.check()
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_bench::VirtualBench;

    #[test]
    fn a_missed_tick_ends_a_segment() {
        let preset = stickslip_base::parameters::presets::find("clm-bench").unwrap().read().unwrap();
        let mut bench = VirtualBench::new(&preset, 1).unwrap();
        let frame = bench.step(Command::default()).unwrap();
        let mut recorder = Recorder::new(&bench);
        // Tick 25 is missing.
        for cycle in (0..25).chain(26..61) {
            recorder.push(&Frame { cycle, angle: cycle as f64, ..frame });
        }
        let segments = recorder.cut(10, Regime::Stuck, 0.0);
        // Each stretch lacks its first tick, whose commands are not known.
        let starts: Vec<f64> = segments.iter().map(|segment| segment.samples[0].angle).collect();
        assert_eq!(starts, [1.0, 11.0, 27.0, 37.0, 47.0]);
        assert!(segments.iter().all(|segment| segment.samples[9].measured[0] == 9.0));
    }
}
