//! An experiment in real time.

use stickslip::bench::{ClockedBench, ThreadSettings, VirtualBench, home};
use stickslip::experiment::{FrictionPlan, measure_friction};
use stickslip::parameters::presets;
use stickslip::{Preset, Watch};

fn preset() -> Preset<f64> {
    let mut preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    // A slow tick, and many that may be missed, for a busy machine.
    preset.bench.tick_rate = 1000.0;
    preset.bench.safety.missed_ticks = 100.0;
    preset
}

#[test]
fn an_experiment_in_real_time_gives_the_result_of_lockstep() {
    let plan = FrictionPlan { slowest: 20.0, fastest: 40.0, speeds: 2.0, ..FrictionPlan::quick() };
    let mut clocked = ClockedBench::virtual_machine(&preset(), 1, ThreadSettings::PLAIN, None).unwrap();
    home(&mut clocked, &Watch::silent()).unwrap();
    let by_clock = measure_friction(&plan, &mut clocked, false, &Watch::silent()).unwrap();
    let report = clocked.stop().unwrap();
    let mut lockstep = VirtualBench::new(&preset(), 1).unwrap();
    home(&mut lockstep, &Watch::silent()).unwrap();
    let in_lockstep = measure_friction(&plan, &mut lockstep, false, &Watch::silent()).unwrap();
    assert_eq!(by_clock.plateaus.len(), in_lockstep.plateaus.len());
    for (now, then) in by_clock.plateaus.iter().zip(&in_lockstep.plateaus) {
        // Other noise, since time passed between homing and measuring.
        let error = now.standard_error.hypot(then.standard_error);
        assert!((now.torque - then.torque).abs() < 5.0 * error, "{now:?} {then:?}");
    }
    assert!(report.summary.cycles > 1000 && report.histograms.total().count > 1000);
    assert_eq!(report.histograms.lost, 0);
}
