//! Faults of drives and segment.

use std::process::Command;
use std::thread;
use std::time::Duration;

use serde_json::Value;

use super::{Bench, PROMPT, Plant, STALLS, in_namespace, text};

/// Requests to the emulated drives, and the reason that the bench shows. The last fault is that of the interface.
const FAULTS: [(&str, &str); 6] = [
    ("0 1 0x4210", "device 0 failed: error code 0x4210"),
    ("0 2 1500", "the machine has not answered"),
    ("1 3 1500", "working counter 4 instead of 7"),
    ("1 5 1500", "working counter 3 instead of 7"),
    ("1 4 1", "AL status code 0x002C"),
    (LINK, "the machine has not answered"),
];
const LINK: &str = "link down";
const ATTEMPTS: usize = 10;

#[test]
fn each_fault_of_drives_in_another_process_ends_at_rest_with_its_name() {
    in_namespace("faults::each_fault_of_drives_in_another_process_ends_at_rest_with_its_name", || {
        let mut plant = Plant::start(&[]);
        let bench = Bench::start(tempfile::tempdir().unwrap(), &PROMPT);
        for (request, name) in FAULTS {
            if !(0..ATTEMPTS).any(|_| ends_at_rest(&mut plant, &bench, request, name)) {
                println!("NOT RUN: {name}: this computer is too busy for a bench at 1 kHz");
            }
        }
        bench.end();
    });
}

/// Causes a fault during a motion. Returns false if the computer stalled.
fn ends_at_rest(plant: &mut Plant, bench: &Bench, request: &str, name: &str) -> bool {
    if !bench.is_homed() {
        return false;
    }
    let moved = bench.command(&["bench", "move", "sine", "--set", "amplitude=5", "--set", "frequency=0.5"]);
    assert!(moved.status.success(), "{}", text(&moved));
    thread::sleep(Duration::from_millis(300));
    if bench.status()["state"] == "fault" {
        return false;
    }
    if request == LINK {
        assert!(Command::new("ip").args(["link", "set", "ec1", "down"]).status().unwrap().success());
    } else {
        plant.fault(request);
    }
    let status = bench.wait("fault", |status| status["state"] == "fault");
    let reason = status["reason"].as_str().unwrap_or_default();
    println!("{request}: {reason}");
    if !reason.contains(name) {
        assert!(STALLS.iter().any(|stall| reason.contains(stall)), "{request}: {reason}");
    }
    if request == LINK {
        return reason.contains(name);
    }
    if request == "1 4 1" {
        // Its clock starts again with its supply.
        plant.fault("1 5 100");
        thread::sleep(Duration::from_millis(500));
    }
    // All devices exchange data again: the readings are those of the axis.
    bench.wait("rest of the axis", |status| {
        let is_in_operation = |device: &Value| device["al_state"] == "OP";
        let devices = status["segment"]["devices"].as_array().unwrap();
        let velocity = status["velocity"].as_f64().unwrap_or(f64::NAN);
        status["segment"]["counter"] == 7 && devices.iter().all(is_in_operation) && velocity.abs() < 0.5
    });
    reason.contains(name)
}
