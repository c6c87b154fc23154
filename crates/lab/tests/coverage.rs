//! The intervals of a friction measurement hold what they promise, and the committed study is what the program gives.

#[path = "../examples/coverage/study.rs"]
mod study;

use std::path::Path;

use serde_json::Value;
use stickslip::fit::{CurvePoint, HUBER, PARAMETERS, StribeckPlan, Uncertainty, fit_stribeck};
use stickslip::noise::Normals;
use stickslip_core::friction::Stribeck;
use study::{Tally, experiment};

fn committed() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies/coverage.json");
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

#[test]
fn the_committed_intervals_cover_the_truth_in_93_to_97_percent() {
    let results = &committed()["results"];
    let value = |name: &str| results[name]["value"].as_f64().unwrap();
    assert!(value("released.experiments") >= 1000.0);
    for (name, _, _) in PARAMETERS {
        let coverage = value(&format!("released.{name}.coverage"));
        assert!((0.93..=0.97).contains(&coverage), "{name}: {coverage}");
        // A sum of two curves is none: the intervals must not be too short for that.
        assert!(value(&format!("pressed.{name}.coverage")) >= 0.93, "{name}");
    }
}

#[test]
fn the_program_still_gives_the_committed_study() {
    let committed = committed();
    let rows = committed["rows"].as_array().unwrap();
    for (case, preload) in [("released", 0.0), ("pressed", 1.0)] {
        for seed in 1..=2 {
            let fit = experiment(preload, seed).unwrap().fit;
            let row = rows.iter().find(|row| row["case"] == case && row["seed"] == seed).unwrap();
            for ((name, _, _), now) in PARAMETERS.iter().zip(fit.parameters) {
                let then = row[name].as_f64().unwrap();
                assert!(now == then, "{case} {seed}: {name} is {now}, was {then}: run `cargo xtask study coverage`");
            }
        }
    }
}

#[test]
fn intervals_under_the_errors_that_a_measurement_states_cover_the_truth() {
    let measured = experiment(0.0, 1).unwrap();
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = measured.truth;
    let curve =
        Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, ..Stribeck::default() };
    let plan = StribeckPlan { uncertainty: Uncertainty::Extra, huber: Some(HUBER), ..StribeckPlan::default() };
    let mut tally = Tally::default();
    for seed in 0..60 {
        let normals = Normals::new(seed);
        let drawn = measured.points.iter().enumerate().map(|(k, point)| CurvePoint {
            torque: curve.torque(point.velocity) + point.standard_error * normals.pair(0, k as u64)[0],
            ..*point
        });
        tally.add(&measured.truth, &fit_stribeck(&drawn.collect::<Vec<_>>(), &plan).unwrap());
    }
    for (i, (name, _, _)) in PARAMETERS.iter().enumerate() {
        // Of 60 intervals that miss in 5 %, ten or more miss with a probability of 0.1 %.
        assert!(tally.hits[i] > 50, "{name}: {} of 60", tally.hits[i]);
    }
}
