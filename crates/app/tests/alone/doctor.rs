//! `stickslip doctor` on the computer that runs the tests.

use std::process::{Command, Output};

use serde_json::Value;

fn doctor(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .args(["doctor", "--rate", "1000", "--seconds", "0.6"])
        .args(arguments)
        .output()
        .expect("the program starts")
}

#[test]
fn the_terminal_the_summary_and_the_report_have_the_same_numbers() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().to_str().expect("its name is text");
    let output = doctor(&["--out", out]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.contains("Measured at 1000 Hz on a thread with: "), "{printed}");
    for name in ["the machine itself", "asleep until its deadline", "spinning for the last 40 µs"] {
        assert!(printed.contains(name), "{printed}");
    }

    let text = std::fs::read_to_string(folder.path().join("summary.json")).expect("the command wrote it");
    let summary: Value = serde_json::from_str(&text).expect("it is JSON");
    let value = |name: &str| summary["results"][name]["value"].as_f64().unwrap_or_else(|| panic!("{name}"));
    for name in ["floor", "asleep", "spinning"] {
        let [p50, p99, p999, max] = ["p50", "p99", "p999", "max"].map(|part| value(&format!("timing.{name}.{part}")));
        assert!(p50 <= p99 && p99 <= p999 && p999 <= max, "{name}: {p50} {p99} {p999} {max}");
        assert!(printed.contains(&format!("{:.2}", p99 * 1e6)), "{p99} is not in\n{printed}");
    }
    assert!(value("timing.asleep.p50") > 0.0);
    let rows = summary["rows"].as_array().expect("the findings");
    let costs = rows.iter().filter(|row| row["verdict"] == "costs").count();
    assert_eq!((costs as f64, rows.len()), (value("doctor.costs"), 14));
    for name in ["lateness.svg", "report.json", "report.html"] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
}

#[test]
fn without_a_folder_no_file_is_written_and_the_summary_is_printed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = Command::new(env!("CARGO_BIN_EXE_stickslip"))
        .args(["doctor", "--rate", "1000", "--seconds", "0.3", "--json"])
        .current_dir(folder.path())
        .output()
        .expect("the program starts");
    let summary: Value = serde_json::from_slice(&output.stdout).expect("it is JSON");
    assert_eq!(summary["command"], "doctor");
    assert_eq!(std::fs::read_dir(folder.path()).expect("it is there").count(), 0);
}

#[test]
fn an_invalid_rate_is_refused_with_its_range() {
    let output = doctor(&["--seconds", "0"]);
    assert_eq!(output.status.code(), Some(2), "the option is given twice");
    let output = Command::new(env!("CARGO_BIN_EXE_stickslip")).args(["doctor", "--rate", "0"]).output();
    let output = output.expect("the program starts");
    let printed = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(printed.contains("rate = 0 Hz is outside 2 … 100000 Hz"), "{printed}");
}
