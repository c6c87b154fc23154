//! The intervals of a friction measurement have their stated coverage, and the program still gives the committed study.

#[path = "../../examples/coverage/study.rs"]
mod study;

use std::path::Path;

use serde_json::Value;
use stickslip::fit::PARAMETERS;
use study::{Experiment, experiment, hits, measure, redraw};

fn committed() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies/coverage.json");
    let text = std::fs::read_to_string(file).expect("the study is committed");
    serde_json::from_str(&text).expect("a study is written as JSON")
}

#[test]
fn the_committed_intervals_contain_the_true_value_as_often_as_stated() {
    let results = &committed()["results"];
    let value = |name: &str| results[name]["value"].as_f64().unwrap();
    assert!(value("redrawn.experiments") >= 1000.0);
    for (name, _, _) in PARAMETERS {
        let coverage = |case: &str| value(&format!("{case}.{name}.coverage"));
        assert!((0.93..=0.97).contains(&coverage("redrawn")), "{name}: {}", coverage("redrawn"));
        // Whole experiments: their stated errors are a tenth too large, which makes 97 of 95 %.
        assert!((0.93..=0.99).contains(&coverage("released")), "{name}: {}", coverage("released"));
        // A sum of two curves differs from one curve: the intervals must be wide enough for that.
        assert!(coverage("pressed") >= 0.9, "{name}: {}", coverage("pressed"));
    }
}

#[test]
fn the_program_still_gives_the_committed_study() {
    let committed = committed();
    let rows = committed["rows"].as_array().unwrap();
    for (case, preload) in [("released", 0.0), ("pressed", 1.0)] {
        for seed in 1001..=1002 {
            let fit = experiment(preload, seed).unwrap().fit;
            let row = rows.iter().find(|row| row["case"] == case && row["seed"] == seed).unwrap();
            for ((name, _, _), (now, ci95)) in PARAMETERS.iter().zip(fit.parameters.into_iter().zip(fit.ci95)) {
                let then = row[name].as_f64().unwrap();
                // Far within its interval: rounding does not change the coverage.
                assert!(
                    (now - then).abs() < 0.1 * 0.5 * (ci95[1] - ci95[0]),
                    "{case} {seed}: {name} is {now}, was {then}: run `cargo xtask study coverage`"
                );
            }
        }
    }
}

#[test]
fn intervals_by_the_stated_errors_of_a_measurement_contain_the_true_value() {
    let (truth, curve) = measure(0.0, 1).unwrap();
    let mut counts = [0; 4];
    for seed in 0..60 {
        let Experiment { truth, fit } = redraw(truth, &curve, seed).unwrap();
        let hits = hits(&truth, &fit);
        (0..4).for_each(|i| counts[i] += usize::from(hits[i]));
    }
    for (i, (name, _, _)) in PARAMETERS.iter().enumerate() {
        // Of 60 intervals that miss in 5 %, ten or more miss with a probability of 0.1 %.
        assert!(counts[i] > 50, "{name}: {} of 60", counts[i]);
    }
}
