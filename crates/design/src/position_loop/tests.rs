use super::*;
use crate::position_controller;
use stickslip_base::Preset;
use stickslip_base::parameters::presets;
use stickslip_core::control::{Cascade, Pid, PositionController};

const SLIDING: Operating = Operating::Sliding(10.0);

fn bench() -> Preset<f64> {
    presets::find("clm-bench").unwrap().read().unwrap()
}

fn with(preset: &Preset<f64>, controller: PositionController<f64>, at: Operating) -> PositionLoop {
    PositionLoop::new(controller, &preset.model, &preset.bench, at).unwrap()
}

fn stated(preset: &Preset<f64>) -> PositionController<f64> {
    position_controller(&preset.bench.controller, &preset.model, &preset.bench).unwrap()
}

fn one(system: &StateSpace, input: usize, output: usize, frequency: f64) -> Complex<f64> {
    system.at_frequency(frequency).unwrap()[(output, input)]
}

#[test]
fn the_closed_loop_is_that_of_its_gain() {
    let preset = bench();
    for at in [SLIDING, Operating::Stuck] {
        let closes = with(&preset, stated(&preset), at);
        let (gain, closed) = (closes.gain().unwrap(), closes.closed().unwrap());
        for frequency in [3.0, 30.0, 300.0, 1500.0] {
            let l = one(&gain, 0, 0, frequency);
            let load = one(&closes.axis, port::LOAD, port::ANGLE, frequency);
            // The response to the load's torque is that of the axis, to it and to the controller's torque.
            let answers = closes.back().unwrap();
            let measured = one(&answers, 0, 0, frequency) * load
                + one(&answers, 1, 0, frequency) * one(&closes.axis, port::LOAD, port::TACHO, frequency);
            let expected = load + one(&closes.axis, port::TORQUE, port::ANGLE, frequency) * measured / (l + 1.0);
            let response = one(&closed, 2, 0, frequency);
            let off =
                libm::hypot((response - expected).re, (response - expected).im) / libm::hypot(expected.re, expected.im);
            assert!(off < 1e-9, "{at:?} at {frequency}: {off:.1e}");
        }
    }
}

#[test]
fn a_cascade_and_its_pid_controller_have_nearly_the_same_loop() {
    let preset = bench();
    // Soft, since a stiff one depends on the side of the coupling at which its velocity is measured.
    let cascade = Cascade { velocity_gain: 0.03, integral_gain: 0.4, ..Cascade::default() };
    let pid = crate::cascade_as_pid(&cascade);
    let quality = |controller| with(&preset, controller, SLIDING).quality(&preset.model).unwrap();
    let (one, other) = (quality(PositionController::Cascade(cascade)), quality(PositionController::Pid(pid)));
    let [m_s, noise] =
        [one.margins.sensitivity.value / other.margins.sensitivity.value, one.noise_torque / other.noise_torque];
    // The cascade integrates the tacho of the motor, the PID controller has the encoder of the load.
    assert!((m_s - 1.0).abs() < 0.03 && (noise - 1.0).abs() < 0.03, "{m_s} {noise}");
}

#[test]
fn a_loop_at_its_gain_margin_oscillates() {
    let preset = bench();
    let cascade = Cascade::default();
    let scaled = |factor: f64| {
        let (velocity_gain, integral_gain) = (factor * cascade.velocity_gain, factor * cascade.integral_gain);
        let controller = PositionController::Cascade(Cascade { velocity_gain, integral_gain, ..cascade });
        with(&preset, controller, SLIDING).quality(&preset.model).unwrap()
    };
    let margin = scaled(1.0).margins.gain.unwrap().value;
    let (within, beyond) = (scaled(0.99 * margin), scaled(1.01 * margin));
    assert!(within.stable && within.noise_torque.is_finite());
    assert!(!beyond.stable && beyond.noise_torque.is_infinite());
    // Close to the margin the sensitivity is one over its rest.
    assert!(within.margins.sensitivity.value > 50.0, "{:?}", within.margins.sensitivity);
}

#[test]
fn the_corners_are_worse_than_the_modelled_machine() {
    let preset = bench();
    let both = [SLIDING, Operating::Stuck];
    let corner_results = corners(stated(&preset), &preset.model, &preset.bench, &both).unwrap();
    assert_eq!(corner_results.len(), 8);
    let nominal =
        both.map(|at| with(&preset, stated(&preset), at).gain().unwrap().margins().unwrap().sensitivity.value);
    assert!(corner_results[0].sensitivity > nominal[0].max(nominal[1]), "{corner_results:?} {nominal:?}");
    // A controller that is far too stiff is reported as unstable there.
    let stiff = PositionController::Pid(Pid { derivative_gain: 5.0, ..Pid::default() });
    let corner_results = corners(stiff, &preset.model, &preset.bench, &both).unwrap();
    assert!(corner_results[0].sensitivity.is_infinite());
}

#[test]
fn noise_of_the_torque_is_at_least_the_direct_noise_of_the_tacho() {
    let preset = bench();
    // Stuck, the integral's pole is at 0.02 Hz: its covariance is thousands of times that of the torque.
    for (position_gain, velocity_gain, integral_gain) in
        [(29.0, 0.0569, 1.65), (41.8, 0.0526, 0.8316), (20.0, 0.05, 1.0)]
    {
        let cascade = Cascade { position_gain, velocity_gain, integral_gain, ..Cascade::default() };
        let at_once = velocity_gain * preset.model.tacho_noise / preset.model.scaling.tacho;
        for at in [SLIDING, Operating::Stuck] {
            let quality = with(&preset, PositionController::Cascade(cascade), at).quality(&preset.model).unwrap();
            assert!(
                (1.0..3.0).contains(&(quality.noise_torque / at_once)),
                "{at:?}: {} {at_once}",
                quality.noise_torque
            );
        }
    }
}

#[test]
fn a_disturbance_observer_is_a_part_of_the_loop_and_a_feedforward_is_not() {
    use stickslip_base::{CompensationChoice, ControllerChoice, DisturbanceObserverChoice};
    let mut preset = bench();
    let cascade = Cascade { velocity_gain: 0.05, integral_gain: 0.8, ..Cascade::default() };
    preset.bench.controller = ControllerChoice::Cascade(cascade);
    let mut peak = |compensation| {
        preset.bench.compensation = compensation;
        let control = crate::axis_control(&preset.model, &preset.bench).unwrap();
        let closes = PositionLoop::new(control, &preset.model, &preset.bench, SLIDING).unwrap();
        closes.quality(&preset.model).unwrap().margins.sensitivity.value
    };
    let alone = peak(CompensationChoice::Nothing);
    assert!((peak(CompensationChoice::Feedforward(Default::default())) / alone - 1.0).abs() < 1e-9);
    assert!((peak(CompensationChoice::Adaptive(Default::default())) / alone - 1.0).abs() < 1e-9);
    let [slow, fast] = [10.0, 60.0]
        .map(|bandwidth| peak(CompensationChoice::DisturbanceObserver(DisturbanceObserverChoice { bandwidth })));
    assert!(fast > 1.1 * slow && fast > 1.1 * alone, "{alone} alone, {slow} with a slow one, {fast} with a fast one");
    let estimating = peak(CompensationChoice::FriedlandPark(Default::default()));
    assert!(estimating > 1.02 * alone, "{estimating}");
}
