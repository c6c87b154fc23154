//! The committed study of calibrated benches: its results for the selected law.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

/// Means over all measures except the counts, of one law on one machine: error and floor.
type Means = BTreeMap<(u64, String), [f64; 2]>;

/// Means, and the selected law of each machine.
fn means(study: &Value) -> (Means, BTreeSet<(u64, String)>) {
    let mut sums: BTreeMap<(u64, String), [f64; 3]> = BTreeMap::new();
    let mut picked = BTreeSet::new();
    for row in study["rows"].as_array().expect("the study has rows") {
        let key = (row["seed"].as_u64().expect("a machine"), row["law"].as_str().expect("a law").to_owned());
        if row["auto"] == true {
            picked.insert(key.clone());
        }
        if row["scenario"].as_str().is_some_and(|name| name.ends_with("count")) {
            continue;
        }
        // An unstable run counts as the full error.
        let share = |name: &str| row[name].as_f64().map_or(1.0, |share| share.min(1.0));
        let sum = sums.entry(key).or_default();
        *sum = [sum[0] + share("difference"), sum[1] + share("floor"), sum[2] + 1.0];
    }
    (sums.into_iter().map(|(key, [error, floor, count])| (key, [error / count, floor / count])).collect(), picked)
}

#[test]
fn the_selected_law_is_near_the_best_one_or_below_the_noise_of_the_machine() {
    let study: Value =
        serde_json::from_str(include_str!("../../../../docs/studies/calibrated.json")).expect("it is JSON");
    let (means, picked) = means(&study);
    assert!(picked.len() >= 20);
    let (mut near, mut near_or_below_floor) = (0, 0);
    for key in &picked {
        let [error, floor] = means[key];
        let of_machine = means.iter().filter(|((seed, _), _)| *seed == key.0).map(|(_, [error, _])| *error);
        let best = of_machine.fold(f64::INFINITY, f64::min);
        near += i32::from(error <= 1.2 * best);
        near_or_below_floor += i32::from(error <= 1.2 * best.max(floor));
    }
    let result = |name: &str| study["results"][name]["value"].as_f64().expect("the study has this share");
    for (name, count) in
        [("picked_within_1.2_of_best", near), ("picked_within_1.2_of_best_or_floor", near_or_below_floor)]
    {
        let share = f64::from(count) / picked.len() as f64;
        assert!((share - result(name)).abs() < 1e-3, "{name}: {share}, committed {}", result(name));
    }
    assert_eq!(result("picked_within_1.2_of_best_or_floor"), 1.0);
    assert!(result("picked_within_1.2_of_best") >= 0.8);
    assert!(result("predicted_within_1.5") >= 0.9);
}
