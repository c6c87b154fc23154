//! The committed study of calibrated benches: what it says of the picked law.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

/// Means over all measures of one law on one machine but the counts: error and floor.
type Means = BTreeMap<(u64, String), [f64; 2]>;

/// Also which law was picked on each machine.
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
        // Not stable is as bad as nothing.
        let share = |name: &str| row[name].as_f64().map_or(1.0, |share| share.min(1.0));
        let sum = sums.entry(key).or_default();
        *sum = [sum[0] + share("difference"), sum[1] + share("floor"), sum[2] + 1.0];
    }
    (sums.into_iter().map(|(key, [error, floor, count])| (key, [error / count, floor / count])).collect(), picked)
}

#[test]
fn the_picked_law_is_as_good_as_the_best_one_or_below_the_noise_of_the_machine() {
    let study: Value =
        serde_json::from_str(include_str!("../../../../docs/studies/calibrated.json")).expect("it is JSON");
    let (means, picked) = means(&study);
    assert!(picked.len() >= 20);
    let mut near = 0;
    for key in &picked {
        let [error, floor] = means[key];
        let of_machine = means.iter().filter(|((seed, _), _)| *seed == key.0).map(|(_, [error, _])| *error);
        let best = of_machine.fold(f64::INFINITY, f64::min);
        assert!(error <= 1.2 * best.max(floor), "{key:?}: {error}, best {best}, floor {floor}");
        near += usize::from(error <= 1.2 * best);
    }
    let share = near as f64 / picked.len() as f64;
    let told = study["results"]["picked_within_1.2_of_best"]["value"].as_f64().expect("a share");
    assert!((share - told).abs() < 1e-3 && share >= 0.8, "{share}, told {told}");
    assert!(study["results"]["predicted_within_1.5"]["value"].as_f64() >= Some(0.9));
}
