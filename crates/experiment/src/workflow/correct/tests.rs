use super::*;
use crate::home;
use stickslip_base::parameters::presets;
use stickslip_bench::VirtualBench;

/// A bench with this gain from correction to torque, with one error of its law that can be corrected and one that
/// cannot.
fn bench(arrives: f64, correctable: f64, stays: f64) -> impl FnMut(Correction<f64>) -> Result<Vec<Missing>, Error> {
    move |correction| {
        let missing = |k: i32| {
            let speed = 0.4 * libm::pow(1.6, f64::from(k / 2));
            let corrected = arrives * correction.correct(0.0, speed, 1e-3);
            let torque = correctable * libm::exp(-speed / 5.0) - corrected + if k % 2 == 0 { stays } else { -stays };
            Missing { speed, torque, standard_error: 1e-5 }
        };
        Ok((0..18).map(missing).collect())
    }
}

fn table() -> CorrectionTable<f64> {
    CorrectionTable { begin: 0.3, slowest: 0.4, fastest: 50.0, ..CorrectionTable::default() }
}

fn run(
    corrections: usize,
    bench: impl FnMut(Correction<f64>) -> Result<Vec<Missing>, Error>,
) -> Corrected<Vec<Missing>> {
    correct(table(), corrections, Vec::clone, bench).unwrap()
}

#[test]
fn each_correction_leaves_a_fifth() {
    let corrected = run(3, bench(1.0, 0.01, 0.0));
    assert_eq!((corrected.best_index, corrected.stopped.clone()), (3, Stopped::Enough));
    for pair in corrected.iterations.windows(2) {
        let ratio = pair[1].error / pair[0].error;
        assert!((ratio - 0.2).abs() < 0.02, "{ratio}");
    }
}

#[test]
fn it_ends_within_the_measurement_error() {
    let corrected = run(20, bench(1.0, 0.01, 0.0));
    assert_eq!(corrected.stopped, Stopped::WithinError);
    assert!(corrected.iterations.len() < 8 && corrected.best().error < 2e-5);
    let nothing = run(20, bench(1.0, 0.0, 0.0));
    assert_eq!((nothing.iterations.len(), nothing.stopped.clone()), (1, Stopped::WithinError));
}

#[test]
fn an_error_that_no_table_corrects_ends_it_and_the_result_is_never_worse() {
    // At each speed one direction has too little and the other too much.
    let corrected = run(20, bench(1.0, 0.01, 0.004));
    assert_eq!(corrected.stopped, Stopped::NoBetter);
    assert!(corrected.iterations.len() < 10, "{}", corrected.iterations.len());
    assert!(corrected.best().error < 0.7 * corrected.iterations[0].error);
}

#[test]
fn a_correction_that_increases_the_error_is_reverted() {
    // The gain is four, or has the opposite sign.
    for arrives in [4.0, -1.0] {
        let corrected = run(20, bench(arrives, 0.01, 0.0));
        assert_eq!(
            (corrected.iterations.len(), corrected.best_index, corrected.stopped.clone()),
            (2, 0, Stopped::NoBetter)
        );
        assert!(corrected.iterations[1].error > corrected.iterations[0].error);
        assert_eq!(corrected.best().correction, Correction::Nothing);
    }
}

#[test]
fn a_non_finite_error_is_not_an_improvement() {
    let mut cycle = 0.0;
    let corrected = run(20, |_| {
        cycle += 1.0;
        let torque = if cycle > 1.0 { f64::NAN } else { 0.01 };
        Ok(vec![Missing { speed: 1.0, torque, standard_error: 1e-5 }; 3])
    });
    assert_eq!((corrected.best_index, corrected.stopped.clone()), (0, Stopped::NoBetter));
}

#[test]
fn a_cancellation_or_a_fault_returns_the_best_and_too_few_plateaus_end_it() {
    let mut whole = bench(1.0, 0.01, 0.0);
    let mut cycle = 0;
    let corrected = run(20, |correction| {
        cycle += 1;
        if cycle > 2 { Err(Error::Cancelled) } else { whole(correction) }
    });
    assert_eq!(
        (corrected.iterations.len(), corrected.best_index, corrected.stopped.clone()),
        (2, 1, Stopped::Cancelled)
    );
    let mut whole = bench(1.0, 0.01, 0.0);
    let fault = || Error::BenchFault { cycle: 9, reason: "too fast".into() };
    let corrected =
        run(20, |correction| if correction == Correction::Nothing { whole(correction) } else { Err(fault()) });
    assert_eq!((corrected.best_index, corrected.stopped.clone()), (0, Stopped::Fault("too fast".into())));
    let few = run(20, |_| Ok(vec![Missing { speed: 1.0, torque: 0.01, standard_error: 1e-5 }]));
    assert_eq!((few.best_index, few.stopped.clone()), (0, Stopped::TooFew));
    assert!(correct(table(), 1, Vec::clone, |_| Err::<Vec<Missing>, _>(Error::Cancelled)).is_err());
}

#[test]
fn unmeasured_points_have_the_next_value_and_precise_points_weigh_more() {
    let point = |speed: f64, torque: f64, standard_error: f64| Missing { speed, torque, standard_error };
    let mut table = table();
    table.torque = smooth(&table, &[point(2.0, 0.01, 1e-6), point(5.0, 0.02, 1e-6)]);
    assert!((table.torque_at(2.0) - 0.01).abs() < 1e-6 && (table.torque_at(5.0) - 0.02).abs() < 1e-6);
    // The points next to the two measured speeds are on the line through them.
    let [first, last] = [0, 23].map(|k| table.torque[k]);
    assert!(table.torque[..8].iter().all(|torque| (torque - first).abs() < 1e-9), "{:?}", table.torque);
    assert!(table.torque[14..].iter().all(|torque| (torque - last).abs() < 1e-9), "{:?}", table.torque);
    assert!((first - 0.01).abs() < 1e-3 && (last - 0.02).abs() < 1e-3, "{:?}", table.torque);
    table.torque = smooth(&table, &[point(3.0, 0.01, 1e-5), point(3.0, 0.03, 1e-3), point(9.0, 0.01, 1e-5)]);
    assert!((table.torque_at(3.0) - 0.01).abs() < 1e-4, "{:?}", table.torque);
}

/// The paper's law on the default bench at a few speeds, corrected at most twice, with the torque constant of the load
/// motor `strength` times that of the model.
fn on_the_bench(strength: f64) -> Corrected<Rendering> {
    let mut preset: stickslip_base::Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    preset.plant.load_motor.winding.torque_constant *= strength;
    let plan = FrictionPlan { slowest: 0.5, fastest: 8.0, speeds: 4.0, ..FrictionPlan::quick() };
    let mut bench = VirtualBench::new(&preset, 1).unwrap();
    let watch = Watch::silent();
    home(&mut bench, &watch).unwrap();
    render_corrected(&plan, &preset.bench.desired, 2, &mut bench, &watch).unwrap()
}

#[test]
fn a_weak_load_motor_is_corrected_and_a_far_too_strong_one_is_not() {
    let weak = on_the_bench(0.5);
    assert_eq!((weak.best_index, weak.stopped.clone()), (2, Stopped::Enough), "{:?}", errors(&weak));
    for pair in errors(&weak).windows(2) {
        // 1 − 0.8·0.5 remains.
        assert!((pair[1] / pair[0] - 0.6).abs() < 0.05, "{:?}", errors(&weak));
    }
    // An excess that is corrected far too much is worse than before.
    let strong = on_the_bench(3.0);
    assert_eq!((strong.best_index, strong.stopped.clone()), (0, Stopped::NoBetter), "{:?}", errors(&strong));
    // Or the correction blocks the axis: supervision ends the measurement.
    let blocks = on_the_bench(8.0);
    assert!(
        blocks.best_index == 0 && matches!(blocks.stopped, Stopped::Fault(_)),
        "{:?}: {}",
        errors(&blocks),
        blocks.stopped
    );
}

fn errors(corrected: &Corrected<Rendering>) -> Vec<f64> {
    corrected.iterations.iter().map(|iteration| iteration.error).collect()
}
