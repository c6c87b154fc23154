//! Chatter is predicted as accurately as in the committed study, and the program still gives the study.

#[path = "../../examples/margins/study.rs"]
mod study;

use std::path::Path;

use serde_json::Value;
use study::{laws, levels, limits};

fn committed() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies/margins.json");
    let text = std::fs::read_to_string(file).expect("the study is committed");
    serde_json::from_str(&text).expect("a study is written as JSON")
}

#[test]
fn no_committed_limit_is_optimistic_and_most_are_near() {
    let results = &committed()["results"];
    let value = |name: &str| results[name]["value"].as_f64().unwrap();
    for law in ["bristle", "residual"] {
        assert!(value(&format!("{law}.benches")) >= 50.0);
        // 3 % is the accuracy of the observed limit.
        assert!(value(&format!("{law}.greatest")) <= 1.05);
        assert!((0.7..=1.0).contains(&value(&format!("{law}.median"))));
        assert!(value(&format!("{law}.half")) >= 0.85);
    }
}

/// Another order of computation differs by rounding.
fn assert_same(now: Option<f64>, then: &Value, what: &str) {
    let same = match (now, then.as_f64()) {
        (Some(now), Some(then)) => (now - then).abs() <= 1e-9 * then.abs(),
        (now, then) => now == then,
    };
    assert!(same, "{what} is {now:?}, was {then}: run `cargo xtask study margins`");
}

#[test]
fn the_program_still_gives_the_committed_study() {
    let committed = committed();
    let rows = committed["rows"].as_array().unwrap();
    for ((name, law), seed) in laws().into_iter().zip([102, 103]) {
        let limits = limits(law, seed).unwrap();
        let row = rows.iter().find(|row| row["law"] == name && row["seed"] == seed).unwrap();
        for (key, now) in [("predicted", limits.predicted), ("observed", limits.observed)] {
            assert_same(now, &row[key], &format!("{name} {seed} {key}"));
        }
    }
    let [predicted, observed] = levels(104).unwrap();
    let row = rows.iter().find(|row| row["law"] == "admittance" && row["seed"] == 104).unwrap();
    assert_same(Some(predicted), &row["predicted_chatter"], "predicted");
    assert_same(Some(observed), &row["observed_chatter"], "observed");
}
