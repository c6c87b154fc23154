//! Computation time of a sample of position control, controller and compensation together.

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

use stickslip::design::axis_control;
use stickslip::{
    CompensationChoice, ControllerChoice, FeedforwardChoice, FrictionObserverChoice, NetworkChoice, PredictiveFeedback,
    Preset, StateFeedback, parameters,
};
use stickslip_core::block::Block as _;
use stickslip_core::control::reference::Setpoint;
use stickslip_core::control::{AxisControl, AxisControlInput, AxisControlState, Pid};

/// Samples of a round.
const SAMPLES: u32 = 200_000;

/// Name of the measurement, nanoseconds per sample in the best round, and the limit. For predictive control: the time
/// that 99.99 % of the samples do not exceed without interrupts.
type Row = (&'static str, f64, f64);

/// Measures all controllers.
pub(crate) fn run(rounds: usize) -> Result<[Row; 6], Box<dyn Error>> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    let mut time = |controller, compensation| -> Result<f64, Box<dyn Error>> {
        (preset.bench.controller, preset.bench.compensation) = (controller, compensation);
        let control = axis_control(&preset.model, &preset.bench)?;
        Ok((0..rounds).map(|_| round(&control)).fold(f64::INFINITY, f64::min))
    };
    let pid = ControllerChoice::Pid(Pid::default());
    let predictive = ControllerChoice::Predictive(PredictiveFeedback { speed_limit: 0.5, ..Default::default() });
    let state_feedback = ControllerChoice::StateFeedback(StateFeedback::default());
    let feedforward = CompensationChoice::Feedforward(FeedforwardChoice::default());
    let observer = CompensationChoice::FrictionObserver(FrictionObserverChoice::default());
    let network = CompensationChoice::Network(NetworkChoice::default());
    Ok([
        (NAMES[0], time(pid, CompensationChoice::Nothing)?, 20.0),
        (NAMES[1], time(state_feedback, CompensationChoice::Nothing)?, 150.0),
        (NAMES[2], time(state_feedback, feedforward)?, 150.0),
        (NAMES[3], time(pid, observer)?, 1000.0),
        (NAMES[4], time(pid, network)?, 500.0),
        (NAMES[5], slowest(predictive, rounds)?, 15_000.0),
    ])
}

/// Names of the measurements.
pub(crate) const NAMES: [&str; 6] = [
    "control_pid/20ns",
    "control_state_feedback/150ns",
    "control_state_feedback_feedforward/150ns",
    "control_friction_observer/1us",
    "control_network/500ns",
    "control_predictive_99.99%/15us",
];

/// Nanoseconds per sample on a ramp under control.
fn round(control: &AxisControl<f64>) -> f64 {
    let mut state = AxisControlState::default();
    let start = Instant::now();
    for sample in 0..SAMPLES {
        black_box(control.step(&mut state, black_box(input(sample)), 1e-3));
    }
    start.elapsed().as_secs_f64() * 1e9 / f64::from(SAMPLES)
}

/// Time that one sample in ten thousand exceeds, at an active limit, each sample timed separately. All rounds have the
/// same samples; the minimum over the rounds removes the effect of interrupts.
fn slowest(controller: ControllerChoice<f64>, rounds: usize) -> Result<f64, Box<dyn Error>> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    preset.bench.controller = controller;
    let control = axis_control(&preset.model, &preset.bench)?;
    let mut times = vec![u128::MAX; SAMPLES as usize];
    for _ in 0..rounds {
        let mut state = AxisControlState::default();
        for (sample, best) in (0..).zip(&mut times) {
            let start = Instant::now();
            black_box(control.step(&mut state, black_box(input(sample)), 1e-3));
            *best = (*best).min(start.elapsed().as_nanos());
        }
    }
    times.sort_unstable();
    Ok(times[times.len() - times.len() / 10_000 - 1] as f64)
}

/// Input of position control in a sample.
fn input(sample: u32) -> AxisControlInput<f64> {
    let position = f64::from(sample % 1000) * 1e-3;
    let reference = Setpoint { position, velocity: 1.0, ..Setpoint::default() };
    AxisControlInput { reference, measured_angle: position - 1e-4, measured_velocity: 0.9 }
}
