//! Breakaway, presliding and cancellation on the virtual bench, compared with the true machine.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use stickslip::bench::{Bench, Command, VirtualBench};
use stickslip::experiment::{
    BreakawayPlan, FrictionPlan, PreslidingPlan, home, measure_breakaway, measure_friction, measure_presliding,
};
use stickslip::{Error, Preset, Watch, parameters, true_friction};

fn homed(name: &str, change: impl Fn(&mut Preset<f64>)) -> VirtualBench {
    let mut preset: Preset<f64> =
        parameters::presets::find(name).and_then(|source| source.read()).expect("a preset that reads");
    change(&mut preset);
    let mut bench = VirtualBench::new(&preset, 1).expect("a preset that can be prepared");
    home(&mut bench, &Watch::silent()).expect("a bench that finds its index");
    bench
}

/// Cancels after a number of reports.
fn cancelling(after: usize) -> Watch {
    let (cancelled, calls) = (Arc::new(AtomicBool::new(false)), AtomicUsize::new(0));
    let flag = cancelled.clone();
    Watch::new(cancelled, move |_, _| {
        if calls.fetch_add(1, Ordering::Relaxed) + 1 == after {
            flag.store(true, Ordering::Relaxed);
        }
    })
}

#[test]
fn breakaway_is_the_static_friction_at_rest() {
    let mut bench = homed("clm-bench", |_| {});
    let plan = BreakawayPlan { angles: 2.0, repetitions: 2.0, ..BreakawayPlan::default() };
    let breakaway = measure_breakaway(&plan, &mut bench, &Watch::silent()).unwrap();
    let exact = true_friction::own_friction(bench.true_plant(), 1e-9);
    assert!(breakaway.complete && breakaway.warnings().is_empty(), "{:?}", breakaway.warnings());
    assert_eq!(breakaway.ramps.len(), 8);
    for direction in [1.0, -1.0] {
        let mean = breakaway.direction(direction).unwrap();
        // The interval holds, and is useful: 2 % of the value.
        assert!(mean.ci95[0] <= exact && exact <= mean.ci95[1], "{mean:?}: {exact}");
        assert!(mean.ci95[1] - mean.ci95[0] < 0.04 * exact, "{mean:?}");
        assert_eq!(breakaway.by_angle(direction).len(), 2);
    }
    assert_eq!(breakaway.lines().count(), 3);
    assert!((breakaway.duration / plan.duration(exact) - 1.0).abs() < 0.15, "{}", breakaway.duration);
}

#[test]
fn a_load_that_does_not_break_away_gives_a_warning() {
    let mut bench = homed("clm-bench", |_| {});
    let plan = BreakawayPlan { angles: 1.0, repetitions: 1.0, largest_torque: 0.2, ..BreakawayPlan::default() };
    let breakaway = measure_breakaway(&plan, &mut bench, &Watch::silent()).unwrap();
    assert!(breakaway.ramps.iter().all(|ramp| ramp.torque.is_none()) && breakaway.mean_torque().is_none());
    assert!(breakaway.warnings()[0].starts_with("No breakaway in 2 of 2 ramps"), "{:?}", breakaway.warnings());
}

#[test]
fn a_cancelled_experiment_returns_its_data_as_incomplete() {
    let mut bench = homed("clm-bench", |_| {});
    let plan = FrictionPlan { slowest: 1.0, speeds: 6.0, ..FrictionPlan::quick() };
    let curve = measure_friction(&plan, &mut bench, false, &cancelling(8)).unwrap();
    assert!(!curve.complete && (1..12).contains(&curve.plateaus.len()), "{}", curve.plateaus.len());
    let whole = measure_friction(&plan, &mut bench, false, &Watch::silent()).unwrap();
    assert!(whole.complete && whole.plateaus.len() == 12 && curve.duration < whole.duration);

    let plan = BreakawayPlan { angles: 2.0, repetitions: 1.0, ..BreakawayPlan::default() };
    let ramps = measure_breakaway(&plan, &mut bench, &cancelling(2)).unwrap();
    assert!(!ramps.complete && ramps.ramps.len() == 1);
    assert!(ramps.warnings().iter().any(|warning| warning.starts_with("Cancelled")));
    let nothing = measure_breakaway(&plan, &mut bench, &cancelling(1));
    assert!(matches!(nothing, Err(Error::Cancelled)));
}

/// The bench with this encoder, and the true own friction in its model.
fn with_encoder(counts: f64) -> VirtualBench {
    homed("clm-bench", |preset| {
        preset.plant.encoder.counts_per_revolution = counts;
        preset.model.encoder.counts_per_revolution = counts;
    })
}

#[test]
fn presliding_is_identified_with_a_fine_encoder() {
    let presliding =
        measure_presliding(&PreslidingPlan::default(), &mut with_encoder(200_000.0), &Watch::silent()).unwrap();
    assert!(presliding.complete && presliding.warnings().is_empty(), "{:?}", presliding.warnings());
    // Screw and wheel together, as in the preset.
    let (stiffness, [low, high]) = presliding.stiffness.unwrap();
    assert!(low <= 300.0 && 300.0 <= high && high < 1.25 * low, "{stiffness}: {low} … {high}");
    let (damping, [low, high]) = presliding.damping.unwrap();
    assert!(low <= 0.85 && 0.85 <= high, "{damping}: {low} … {high}");
    assert_eq!(presliding.lines().count(), 2);
}

#[test]
fn the_edges_of_a_few_counts_determine_the_stiffness_within_its_interval() {
    // The swing of 1.2 mrad is two counts.
    for angle in [0.0, 0.5] {
        let plan = PreslidingPlan { angle, ..PreslidingPlan::default() };
        let presliding = measure_presliding(&plan, &mut with_encoder(10_000.0), &Watch::silent()).unwrap();
        match presliding.stiffness {
            Some((value, [low, high])) => assert!(low <= 300.0 && 300.0 <= high, "{value}: {low} … {high}"),
            None => assert!(!presliding.warnings().is_empty()),
        }
    }
}

#[test]
fn presliding_within_a_count_is_reported_as_not_identifiable() {
    let presliding =
        measure_presliding(&PreslidingPlan::default(), &mut with_encoder(2000.0), &Watch::silent()).unwrap();
    assert!(presliding.stiffness.is_none() && presliding.damping.is_none() && presliding.lines().count() == 0);
    assert!(presliding.least_stiffness <= 300.0 && presliding.least_stiffness > 50.0);
    let warning = &presliding.warnings()[0];
    assert!(
        warning.contains("not identifiable with this encoder of 2000 counts per revolution: at least"),
        "{warning}"
    );
}

#[test]
fn a_torque_added_to_the_load_motor_comes_with_the_law_off_and_goes_with_its_order() {
    let mut bench = homed("clm-bench", |_| {});
    // A third of breakaway: the load rests. 50 ms are thirty time constants of the current control.
    for torque in [0.1, 0.0] {
        let command = Command { added_load_torque: torque, ..Command::default() };
        let frames: Vec<_> = (0..200).map(|_| bench.step(command).unwrap()).collect();
        let mean = frames[100..].iter().map(|frame| frame.signals.measured_load_torque).sum::<f64>() / 100.0;
        assert_eq!(frames[199].signals.difference_torque, torque);
        // The sensor's noise of 10 mA, a tenth in the mean.
        assert!((mean - torque).abs() < 5e-4, "{mean} instead of {torque} N m");
    }
}
