//! Scan, doctor, refusals, homing, and the summary at the end.

use serde_json::Value;
use tempfile::TempDir;

use super::{Bench, PROMPT, Plant, SETTINGS, STALLS, in_namespace, program, text};

#[test]
fn the_program_homes_two_servo_drives_in_another_process() {
    in_namespace("homing::the_program_homes_two_servo_drives_in_another_process", || {
        let plant = Plant::start(&[]);
        let scan = text(&program(&["ethercat", "scan", "ec1"]));
        for part in
            ["0  stickslip drive motor", "1  stickslip load motor", "csp, csv, cst", "drive motor at position 0"]
        {
            assert!(scan.contains(part), "{scan}");
        }
        let doctor = text(&program(&["doctor", "--io", "ethercat:ec1", "--seconds", "0.3", "--rate", "1000"]));
        let devices = "EtherCAT devices (stickslip drive motor, stickslip load motor, stickslip emulated input)";
        assert!(doctor.contains(devices) && doctor.contains("raw sockets (permitted)"), "{doctor}");
        let mut folder = tempfile::tempdir().unwrap();
        let project = folder.path().join("refused").display().to_string();
        let serve: &[&str] = &["serve", "--seconds", "1", "--project", &project];
        for command in [serve, &["measure", "breakaway"], &["calibrate"]] {
            let refused = text(&program(&[command, &["--io", "ethercat:ec1"]].concat()));
            assert!(refused.contains("--set bench.torque_amplifier=true"), "{refused}");
        }
        // A stall of this computer may end the search; then it is repeated.
        let homed = (0..5).any(|_| {
            let (homed, returned) = home(std::mem::replace(&mut folder, tempfile::tempdir().unwrap()));
            folder = returned;
            homed
        });
        assert!(homed, "five attempts");
        assert!((0..5).any(|_| is_measured(&folder)), "five attempts");
        let is_operational = |line: String| line.matches("OP").count() >= 3 && !line.contains("SAFE");
        assert!(plant.lines.try_iter().any(is_operational), "the drives have been in OP");
    });
}

/// Homes the bench, switches it off, and ends it as by Ctrl-C. Returns whether both succeeded.
fn home(folder: TempDir) -> (bool, TempDir) {
    let bench = Bench::start(folder, &PROMPT);
    let homed = bench.command(&["bench", "home"]);
    let status = text(&bench.command(&["status"]));
    println!("{}{status}", text(&homed));
    assert!(status.contains("segment    0 stickslip drive motor (motor): OP"), "{status}");
    assert!(status.contains("frames by round trip: "), "{status}");
    let off = bench.command(&["bench", "off"]);
    let (summary, folder) = bench.end();
    check_summary(&summary);
    (homed.status.success() && off.status.success(), folder)
}

/// Measures without a served bench; the folder has the description of the drives. Returns false after a stall.
fn is_measured(folder: &TempDir) -> bool {
    let [drives, out] = ["drives.toml", "measured"].map(|name| folder.path().join(name).display().to_string());
    let io = format!("ethercat:ec1,{drives}");
    let plan = [("plan.slowest", "20"), ("plan.speeds", "2")];
    let settings = SETTINGS.iter().chain(&PROMPT).chain(&plan).map(|(path, value)| format!("{path}={value}"));
    let settings: Vec<String> = settings.flat_map(|setting| ["--set".into(), setting]).collect();
    let settings: Vec<&str> = settings.iter().map(String::as_str).collect();
    let output = program(&[&["measure", "friction", "--io", &io, "--out", &out][..], &settings].concat());
    let message = text(&output);
    if output.status.success() {
        for part in ["50.00 rad/s", "frame from sending to receiving"] {
            assert!(message.contains(part), "{message}");
        }
    } else {
        assert!(STALLS.iter().any(|stall| message.contains(stall)), "{message}");
    }
    output.status.success()
}

/// Checks the segment in the summary.
fn check_summary(summary: &Value) {
    let value =
        |name: &str| summary["results"][name]["value"].as_f64().unwrap_or_else(|| panic!("{name} in {summary}"));
    assert!(value("segment.frames") > 500.0 && value("segment.lost") <= value("segment.frames"));
    assert_eq!(value("segment.expected_counter"), 7.0);
    let (bars, devices): (Vec<&Value>, Vec<&Value>) =
        summary["rows"].as_array().unwrap().iter().partition(|row| row["histogram"].is_string());
    for name in ["frame_distance", "frame_round_trip"] {
        let [median, .., largest] = ["p50", "p99", "p999", "max"].map(|part| value(&format!("timing.{name}.{part}")));
        assert!(0.0 < median && median <= largest, "{name}: {median} {largest}");
        let bars: Vec<_> = bars.iter().filter(|bar| bar["histogram"] == name).collect();
        let below = |time: f64| {
            let below = bars.iter().filter(|bar| bar["to"].as_f64().unwrap() <= time);
            below.map(|bar| bar["count"].as_f64().unwrap()).sum::<f64>()
        };
        let (all, half) = (below(10.0), below(median));
        assert!(half <= 0.5 * all && all <= value("segment.frames"), "{name}: {half} of {all} below {median} s");
        assert_eq!(bars.last().map(|bar| bar["to"].as_f64().unwrap() > largest), Some(true), "{name}");
    }
    let devices: Vec<_> = devices.iter().map(|row| (&row["role"], &row["name"])).collect();
    assert_eq!(devices[1], (&"load".into(), &"stickslip load motor".into()));
    assert_eq!(devices.len(), 3);
}
