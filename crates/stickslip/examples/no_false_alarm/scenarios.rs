//! Scenarios of a healthy bench: the scenarios of the fidelity benchmark, speeds one after another, random strokes.

use stickslip::bench::{Bench, Command, VirtualBench};
use stickslip::experiment::home;
use stickslip::{Error, LawChoice, Preset, Settings, Watch, design, parameters};
use stickslip_core::control::reference::{
    Constant, Generator, MotionLimits, PointToPoint, Ramp, RandomStrokes, Reference, Setpoint, Sine, SpeedSweep,
};
use stickslip_core::control::{Pid, PositionController};

/// The controller: the bench's own, or a PID by bandwidth [rad/s] with its integral gain raised.
type Tuning = Option<(f64, f64)>;

/// Name, controller, reference and time [s] of each.
fn scenarios(seed: u64) -> [(&'static str, Tuning, Reference<f64>, f64); 7] {
    let limits = MotionLimits { velocity: 40.0, acceleration: 600.0, jerk: 6e6 };
    let moves = PointToPoint { distance: 10.0, limits, dwell_time: 0.5, moves: 4.0 };
    let strokes = RandomStrokes { range: 30.0, limits: MotionLimits::default(), dwell_time: 0.1, seed: seed as f64 };
    let sine = |frequency| Reference::Sine(Sine { amplitude: 2.0, frequency, fade_time: 1.0 });
    let ramp = Ramp { velocity: 0.1, acceleration: 1.0, hold_time: 1e4 };
    let sweep = SpeedSweep::default();
    [
        ("sine of 0.5 Hz", None, sine(0.5), 5.0),
        ("sine of 2 Hz", None, sine(2.0), 3.0),
        ("point to point", None, Reference::PointToPoint(moves), moves.duration()),
        ("hunting", Some((15.0, 3.0)), Reference::Constant(Constant { position: 0.5 }), 15.0),
        ("stick-slip", Some((20.0, 1.0)), Reference::Ramp(ramp), 15.0),
        ("speed sweep", None, Reference::SpeedSweep(sweep), sweep.duration().min(20.0)),
        ("random strokes", None, Reference::RandomStrokes(strokes), 20.0),
    ]
}

/// Settings of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    /// Its preset.
    pub(crate) preset: &'static str,
    /// Rate of its ticks [Hz].
    pub(crate) tick_rate: f64,
    /// Its law.
    pub(crate) law: LawChoice<f64>,
    /// Seed of noise and strokes.
    pub(crate) seed: u64,
}

/// Runs all scenarios; returns the bench time [s] and the false alarms.
///
/// # Errors
/// Errors of the bench's design.
pub(crate) fn run(case: Case) -> Result<(f64, Vec<String>), Error> {
    let mut preset: Preset<f64> = parameters::presets::find(case.preset)?.read()?;
    preset.bench.tick_rate = case.tick_rate;
    let law = design::rendering_law(&preset.model, &Settings { law: case.law, ..preset.bench })?;
    let (mut time, mut alarms) = (0.0, Vec::new());
    for (name, tuning, reference, duration) in scenarios(case.seed) {
        let mut bench = VirtualBench::new(&preset, case.seed)?;
        let ticks = (duration * case.tick_rate) as u64;
        let mut course = || {
            home(&mut bench, &Watch::silent())?;
            bench.set_law(law)?;
            if let Some((bandwidth, factor)) = tuning {
                let pid = design::pid_by_bandwidth(Pid::default(), preset.model.drive.inertia(), bandwidth)?;
                let pid = Pid { integral_gain: factor * pid.integral_gain, ..pid };
                bench.set_controller(PositionController::Pid(pid), preset.bench.divider())?;
            }
            let position = bench.step(Command::default())?.angle;
            let mut generator = Generator::new(reference, case.tick_rate).with_origin(position);
            let rest = Setpoint { position, ..Setpoint::default() };
            for k in 0..ticks {
                // A step is commanded at once, as in the benchmark.
                let setpoint = if k == 0 { rest } else { generator.next() };
                bench.hand_over(Command { setpoint, control: true, render: true, ..Command::default() })?;
            }
            bench.come_to_rest()
        };
        if let Err(error) = course() {
            alarms.push(format!("{case:?}, {name}: {error}"));
        }
        time += duration;
    }
    Ok((time, alarms))
}
