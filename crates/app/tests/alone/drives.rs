//! The bench on two servo drives in another process: `plant --ethercat` and `serve --io ethercat:…` over a pair of
//! virtual interfaces, in a network namespace that ends with the test.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::io::{BufRead as _, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");
/// Set in the namespace.
const INSIDE: &str = "STICKSLIP_IN_NAMESPACE";
const TEST: &str = "drives::the_program_homes_two_servo_drives_in_another_process";
/// A loaded computer may be late: watchdogs of 2 s, missed set-points are not supervised.
const DRIVES: &str = "watchdog = 2.0\n\
    [motor]\nstart = [{ index = 0x10F1, subindex = 2, value = 65535, bytes = 2 }]\n\
    [load]\nstart = [{ index = 0x10F1, subindex = 2, value = 65535, bytes = 2 }]\n\
    [accelerometer]\nposition = 2\nvolts = 10.0\n";
const SETTINGS: [&str; 10] = [
    "bench.torque_amplifier=true",
    "bench.tick_rate=1000",
    "bench.safety.missed_ticks=500",
    "bench.safety.speed=10000",
    "bench.safety.following_error=10",
    "bench.controller.position_gain=8",
    "bench.controller.velocity_gain=0.05",
    "model.drive_lag=0.003",
    "model.encoder.counts_per_revolution=65536",
    "model.encoder.counter_range=4294967296",
];

/// A process that is stopped at the end of the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn program(words: &[&str]) -> Output {
    Command::new(PROGRAM).args(words).stdin(Stdio::null()).output().unwrap()
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn the_program_homes_two_servo_drives_in_another_process() {
    if std::env::var_os(INSIDE).is_some() {
        return inside();
    }
    let without = text(&program(&["ethercat", "scan", "lo"]));
    if without.contains("built without") {
        assert!(without.contains("--features ethercat"), "{without}");
        println!("NOT RUN: the program of this test was built without the EtherCAT main device");
        return;
    }
    let links =
        "ip link add ec0 type veth peer name ec1 && ip link set ec0 up && ip link set ec1 up && ip link set lo up";
    let permitted = |options: &&str| {
        Command::new("unshare").args([options, "sh", "-c", links]).output().is_ok_and(|o| o.status.success())
    };
    let Some(options) = ["-rn", "-n"].into_iter().find(|options| permitted(options)) else {
        println!("NOT RUN: this computer permits no network namespace with virtual interfaces, or iproute2 is missing");
        return;
    };
    let test = std::env::current_exe().unwrap();
    let line = format!("{links} && exec {} --exact {TEST} --nocapture", test.display());
    assert!(Command::new("unshare").args([options, "sh", "-c", &line]).env(INSIDE, "1").status().unwrap().success());
}

fn inside() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("project").display().to_string();
    let drives = folder.path().join("drives.toml");
    std::fs::write(&drives, DRIVES).unwrap();
    let mut plant = Command::new(PROGRAM);
    let plant = plant.args(["plant", "--ethercat", "ec0", "--analog", "1"]).stdout(Stdio::piped());
    let mut plant = Running(plant.spawn().unwrap());
    let mut states = BufReader::new(plant.0.stdout.take().unwrap()).lines();
    assert_eq!(states.next().unwrap().unwrap(), "ethercat:ec0");

    let scan = text(&program(&["ethercat", "scan", "ec1"]));
    for part in ["0  stickslip drive motor", "1  stickslip load motor", "csp, csv, cst", "drive motor at position 0"] {
        assert!(scan.contains(part), "{scan}");
    }
    let doctor = text(&program(&["doctor", "--io", "ethercat:ec1", "--seconds", "0.3", "--rate", "1000"]));
    let devices = "EtherCAT devices (stickslip drive motor, stickslip load motor, stickslip emulated input)";
    assert!(doctor.contains(devices) && doctor.contains("raw sockets (permitted)"), "{doctor}");
    let refused = text(&program(&["serve", "--io", "ethercat:ec1", "--seconds", "1", "--project", &project]));
    assert!(refused.contains("--set bench.torque_amplifier=true"), "{refused}");
    let refused = text(&program(&["measure", "breakaway", "--io", "ethercat:ec1"]));
    assert!(refused.contains("stickslip serve --io ethercat:ec1"), "{refused}");

    // A stall of this computer may end the search; then it is repeated.
    let homed = (0..5).any(|_| is_homed(&project, &drives));
    assert!(homed, "five attempts");
    let ends = states.map_while(Result::ok).find(|line| line.matches("OP").count() >= 3 && !line.contains("SAFE"));
    assert!(ends.is_some(), "the drives have been in OP");
}

/// Homes the bench, switches it off, and ends it as by Ctrl-C.
fn is_homed(project: &str, drives: &Path) -> bool {
    let io = format!("ethercat:ec1,{}", drives.display());
    let mut serve = Command::new(PROGRAM);
    serve.args(["serve", "--listen", "127.0.0.1:0", "--json", "--project", project, "--io", &io]);
    serve.args(SETTINGS.iter().flat_map(|setting| ["--set", setting])).stdin(Stdio::null()).stdout(Stdio::piped());
    let mut serve = Running(serve.spawn().unwrap());
    let (start, file) = (Instant::now(), Path::new(project).join("serve.json"));
    while !file.exists() {
        assert!(
            start.elapsed() < Duration::from_secs(60) && serve.0.try_wait().unwrap().is_none(),
            "it has not started"
        );
        thread::sleep(Duration::from_millis(20));
    }
    let homed = program(&["bench", "home", "--project", project]);
    let status = text(&program(&["status", "--project", project]));
    println!("{}{status}", text(&homed));
    assert!(status.contains("segment    0 stickslip drive motor (motor): OP"), "{status}");
    let off = program(&["bench", "off", "--project", project]);
    assert!(Command::new("kill").args(["-INT", &serve.0.id().to_string()]).status().unwrap().success());
    assert!(serve.0.wait().unwrap().code().is_some(), "it ends by itself");
    check_summary(serve.0.stdout.take().unwrap());
    homed.status.success() && off.status.success()
}

/// Checks the segment in the summary.
fn check_summary(mut output: impl Read) {
    let mut text = String::new();
    output.read_to_string(&mut text).unwrap();
    let summary: Value = serde_json::from_str(text.split_once('\n').unwrap().1).unwrap();
    let value = |name: &str| summary["results"][name]["value"].as_f64().unwrap_or_else(|| panic!("{name} in {text}"));
    assert!(value("segment.frames") > 500.0 && value("segment.lost") <= value("segment.frames"));
    assert_eq!(value("segment.expected_counter"), 7.0);
    for name in ["frame_distance", "frame_round_trip"] {
        let [median, .., largest] = ["p50", "p99", "p999", "max"].map(|part| value(&format!("timing.{name}.{part}")));
        assert!(0.0 < median && median <= largest, "{name}: {median} {largest}");
    }
    let rows: Vec<_> = summary["rows"].as_array().unwrap().iter().map(|row| (&row["role"], &row["name"])).collect();
    assert_eq!(rows[1], (&"load".into(), &"stickslip load motor".into()));
    assert_eq!((rows.len(), &summary["rows"][0]["al_state"]), (3, &"OP".into()));
}
