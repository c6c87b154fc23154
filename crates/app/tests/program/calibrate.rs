//! `stickslip calibrate` on a machine that differs from its data sheet, in this process and in another one.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");
/// Deviations from the data sheet.
const OFF: [&str; 4] =
    ["--set", "plant.servo.torque_per_volt=0.207", "--set", "plant.load_motor.winding.torque_constant=0.097"];

fn calibrate(out: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args(["calibrate", "--preset", "prototype", "--set", "plan.duration=2", "--out"]).arg(out);
    command
}

/// The lines of a pipe.
fn lines(pipe: impl std::io::Read) -> impl Iterator<Item = String> {
    BufReader::new(pipe).lines().map_while(Result::ok)
}

fn results(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("summary.json")).expect("the command wrote it");
    serde_json::from_str::<Value>(&text).expect("it is JSON")["results"].take()
}

fn wait_for_success(mut child: Child) {
    assert!(child.wait().expect("it ended").success());
}

#[test]
fn a_machine_in_another_process_is_identified_with_the_same_bits_as_in_this_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [here, there] = ["here", "there"].map(|name| folder.path().join(name));
    let serve = ["plant", "--io", "udp:127.0.0.1:0", "--preset", "prototype", "--seed", "3", "--once"];
    let mut plant =
        Command::new(PROGRAM).args(serve).args(OFF).stdout(Stdio::piped()).spawn().expect("the program starts");
    let address = lines(plant.stdout.take().expect("it is piped")).next().expect("it prints its address");
    let remote = calibrate(&there).args(["--io", &address]).stdout(Stdio::null()).spawn().expect("the program starts");
    wait_for_success(
        calibrate(&here).args(["--seed", "3"]).args(OFF).stdout(Stdio::null()).spawn().expect("the program starts"),
    );
    wait_for_success(remote);
    wait_for_success(plant);

    let (local, remote) = (results(&here), results(&there));
    assert_eq!(local, remote);
    let value = |name: &str| remote[format!("calibrate.{name}")]["value"].as_f64().expect("a number");
    // The accuracy that an admittance law requires.
    assert!((value("torque_per_volt") / 0.207 - 1.0).abs() < 0.0025);
    assert!((value("torque_constant") / 0.097 - 1.0).abs() < 0.0025);
}

#[cfg(unix)]
#[test]
fn a_cancelled_calibration_writes_no_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let mut command = calibrate(&out);
    command.arg("--progress").stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let mut progress = lines(child.stderr.take().expect("it is piped"));
    assert!(progress.any(|line| line.starts_with("fit of the drive")), "the program ended before its fit");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill is there");
    assert!(kill.success());
    assert_eq!(progress.last().as_deref(), Some("error: cancelled"));
    assert_eq!(child.wait().expect("it ended").code(), Some(130));
    assert!(!out.exists());
}
