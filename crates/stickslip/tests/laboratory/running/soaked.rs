//! Half a minute with all clients has no losses, and the committed hour had none either.

use std::path::Path;

use stickslip::bench::ThreadSettings;

use super::crowd::{SIGNALS, VIEWERS};
use super::soak;

/// Largest growth of memory from a tenth of the time to the end, by histories and histograms [bytes].
const GROWTH: u64 = 16 << 20;

#[test]
fn half_a_minute_loses_no_cycle_and_memory_stays_flat() {
    let folder = tempfile::tempdir().unwrap();
    let soaked = soak::soak(4000.0, 30.0, ThreadSettings::PLAIN, folder.path()).unwrap();
    let results = &soaked.results;
    assert!(soaked.replayed.identical() && soaked.replayed.machine, "{:?}", soaked.replayed);
    assert_eq!((soaked.lost, results.tuned.lost), (0, 0));
    // The record has every cycle that ran; those that were missed on a busy machine did not.
    let ran = results.clocked.summary.cycles + results.clocked.summary.missed;
    assert!(soaked.replayed.of + results.clocked.summary.missed >= ran, "{} of {ran}", soaked.replayed.of);
    assert!(soaked.replayed.of > 60_000, "{}", soaked.replayed.of);
    assert!(soaked.bytes < 120 * soaked.replayed.of, "a row of 30 numbers, compressed: {} bytes", soaked.bytes);
    assert_eq!((results.received.len(), VIEWERS * SIGNALS), (4, 64));
    for viewer in &results.received {
        // Each cycle of a viewer's time is in one point.
        assert_eq!((viewer.missing, viewer.cycles), (0, viewer.to - viewer.from + 1), "{viewer:?}");
        assert!(viewer.cycles > 50_000, "{viewer:?}");
    }
    // XCP: no frame is lost, and no cycle but those that did not run.
    let measured = results.measured;
    assert!(measured.frames == 0 && measured.missing <= results.clocked.summary.missed, "{measured:?}");
    assert!(measured.rows > 50_000, "{measured:?}");
    assert!(results.tuned.changes >= 10 && results.tuned.captures >= 1, "{:?}", results.tuned);
    if let [_, tenth, .., last] = soaked.memory[..] {
        assert!(last < tenth + GROWTH, "{:?}", soaked.memory);
    }
}

#[test]
fn the_committed_hour_had_no_losses() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/studies/soak.json");
    let text = std::fs::read_to_string(file).unwrap();
    let study: serde_json::Value = serde_json::from_str(&text).unwrap();
    let value = |name: &str| study["results"][name]["value"].as_f64().unwrap();
    assert!(value("soak.seconds") >= 3600.0 && value("soak.rate") >= 4000.0);
    for name in ["soak.lost", "soak.missing", "soak.captures.lost"] {
        assert_eq!(value(name), 0.0, "{name}");
    }
    assert_eq!(value("soak.identical"), 1.0);
    let memory: Vec<f64> =
        study["rows"].as_array().unwrap().iter().map(|row| row["memory"].as_f64().unwrap()).collect();
    assert!(memory.len() >= 20 && memory[19] < memory[1] + GROWTH as f64, "{memory:?}");
}
