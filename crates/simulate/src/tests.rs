//! Controllers on the virtual machine, with access to the true state.

use stickslip_base::parameters::presets;
use stickslip_base::preset::{
    ControllerChoice, Disturbances, Observation, PredictiveFeedback, Preset, Quadratic, Regulation, StateFeedback,
};
use stickslip_core::control::PositionController;
use stickslip_core::tick::Order;
use stickslip_design as design;
use stickslip_design::linear::Operating;
use stickslip_design::{PositionLoop, predictive};

use crate::fast_bench::FastBench;

fn preset() -> Preset<f64> {
    presets::find("prototype").unwrap().read().unwrap()
}

/// A fast regulator on the tacho and the encoder, within these limits of torque rate and speed.
fn stated(compensates_load: f64, torque_rate_limit: f64, speed_limit: f64) -> PredictiveFeedback<f64> {
    let regulator = Regulation::Quadratic(Quadratic { angle: 0.05, ..Quadratic::default() });
    let observer = Observation::Full(Disturbances::default());
    let feedback =
        StateFeedback { regulator, observer, compensates_load, torque_limit: 2.0, ..StateFeedback::default() };
    PredictiveFeedback { feedback, torque_rate_limit, speed_limit }
}

#[test]
fn the_predictive_controller_keeps_its_speed_limit_on_the_virtual_bench() {
    let mut preset = preset();
    let speed_limit = 15.0;
    let choice = stated(0.0, 1e4, speed_limit);
    let fastest = |controller: ControllerChoice<f64>| {
        let mut preset = preset;
        preset.bench.controller = controller;
        let settings = &preset.bench;
        let tick = design::software(&preset.model, settings).unwrap();
        let mut bench = FastBench::new(&preset.plant, tick, settings, settings.divider(), 1).unwrap();
        let mut fastest = 0.0f64;
        for cycle in 0..4400 {
            let mut order = Order { control: 1.0, ..Order::default() };
            order.reference.position = if cycle < 400 { 0.0 } else { 3.0 };
            bench.tick(order);
            fastest = fastest.max(bench.true_state().plant.machine.velocity.abs());
        }
        (fastest, bench.true_state().plant.machine.angle)
    };
    let (seeing, there) = fastest(ControllerChoice::Predictive(choice));
    let (blind, _) = fastest(ControllerChoice::StateFeedback(choice.feedback));
    // The observer lags at breakaway, which the modelled drive does not have.
    assert!(seeing < 1.2 * speed_limit && blind > 2.0 * speed_limit, "{seeing} {blind}");
    assert!((there - 3.0).abs() < 0.02, "{there}");
    preset.bench.controller = ControllerChoice::Predictive(choice);
    let of = |controller: PositionController<f64>| {
        let closes = PositionLoop::new(controller, &preset.model, &preset.bench, Operating::Stuck).unwrap();
        closes.quality(&preset.model).unwrap().margins.sensitivity.value
    };
    let controller = predictive(&choice, &preset.model, preset.bench.control_period()).unwrap();
    assert_eq!(of(PositionController::Predictive(controller)), of(PositionController::Linear(controller.linear)));
}
