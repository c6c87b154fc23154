//! Repeated deviations are learnt; others are reported.

use stickslip::bench::VirtualBench;
use stickslip::design::tune;
use stickslip::experiment::{Learned, LearningPlan, home, learn_torque};
use stickslip::parameters::presets;
use stickslip::workflow::position_loop::as_cascade;
use stickslip::{Preset, Watch};

fn learnt(preset: &Preset<f64>, plan: &LearningPlan<f64>) -> Learned {
    let mut bench = VirtualBench::new(preset, 1).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    learn_torque(plan, &mut bench, &Watch::silent()).unwrap()
}

#[test]
fn a_sine_is_learnt_in_ten_repetitions() {
    let mut preset: Preset<f64> = presets::find("prototype").unwrap().read().unwrap();
    let Preset { model, bench, .. } = &mut preset;
    bench.controller = tune(&as_cascade(&bench.controller), model, bench, 10.0, &Watch::silent()).unwrap().controller;
    let learned = learnt(&preset, &LearningPlan::default());
    let deviations: Vec<f64> = learned.repetitions.iter().map(|it| 1e3 * it.deviation).collect();
    println!("{deviations:.3?} mrad");
    assert!(learned.factor() > 20.0, "{deviations:.2?} mrad");
    assert!(learned.deviations[0].len() == learned.torque.len() && learned.complete);
}

#[test]
fn learning_without_improvement_ends_with_the_best() {
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    // With a deviation below the noise: one count, of a smaller sine.
    let plan =
        LearningPlan { amplitude: 1e-3, share: 1.0, regularisation: 1e-3, cutoff: 1000.0, ..LearningPlan::default() };
    let learned = learnt(&preset, &plan);
    let deviations: Vec<f64> = learned.repetitions.iter().map(|it| 1e3 * it.deviation).collect();
    println!("{deviations:.3?} mrad, best {}", learned.best);
    assert!(learned.stopped && learned.repetitions.len() < 11, "{deviations:.3?}");
    let best = learned.repetitions[learned.best].deviation;
    assert!(learned.repetitions.iter().all(|it| it.deviation >= 0.97 * best), "{deviations:.3?}");
}
