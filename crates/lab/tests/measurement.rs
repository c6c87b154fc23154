//! The measurement of chapter 4 on the virtual bench.

use stickslip::bench::{Bench, VirtualBench};
use stickslip::experiment::{FrictionPlan, home, measure_friction};
use stickslip::{Preset, Watch, parameters, truth};

fn preset(name: &str) -> Preset<f64> {
    parameters::presets::find(name).unwrap().read().unwrap()
}

#[test]
fn every_preset_reads_and_runs() {
    for (name, _) in parameters::presets::list() {
        let preset = preset(name);
        let mut bench = VirtualBench::new(&preset, 1).unwrap();
        home(&mut bench, &Watch::silent()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(bench.safety().zero().is_some());
    }
}

#[test]
fn own_friction_is_measured_on_the_bench() {
    let preset = preset(&std::env::var("P").unwrap_or("clm-bench".into()));
    let plan = FrictionPlan::quick();
    for preload in [1.0] {
        let mut bench = VirtualBench::new(&preset, 1).unwrap();
        bench.set_preload(preload).unwrap();
        home(&mut bench, &Watch::silent()).unwrap();
        let curve = measure_friction(&plan, &mut bench, false, &Watch::silent()).unwrap();
        for p in &curve.plateaus {
            let t = truth::own_friction(bench.truth(), p.velocity);
            println!(
                "{:8.3} {:8.4} {:8.5} true {:8.5} err {:7.3} mNm se {:7.3} dev {:5.3} {:?}",
                p.set_velocity,
                p.velocity,
                p.torque,
                t,
                1e3 * (p.torque - t),
                1e3 * p.standard_error,
                p.deviation,
                p.dropped
            );
        }
        let fit = curve.fit().unwrap();
        println!("{:?} {:?} {} ripple {}", fit.parameters, fit.standard_errors, curve.duration, curve.ripple);
        println!("{:?}", truth::own_curve(bench.truth(), &plan).unwrap().parameters);
    }
}
