//! `stickslip calibrate` against a machine that is not that of its data sheet, here and in another process.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::Value;

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");
/// What the data sheet does not know.
const OFF: [&str; 4] =
    ["--set", "plant.servo.torque_per_volt=0.207", "--set", "plant.load_motor.winding.torque_constant=0.097"];

fn calibrate(out: &Path) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args(["calibrate", "--preset", "prototype", "--set", "plan.duration=2", "--out"]).arg(out);
    command
}

/// Its lines on a pipe, as they come.
fn lines(pipe: impl std::io::Read) -> impl Iterator<Item = String> {
    BufReader::new(pipe).lines().map_while(Result::ok)
}

fn results(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("summary.json")).expect("the command wrote it");
    serde_json::from_str::<Value>(&text).expect("it is JSON")["results"].take()
}

fn ended_well(mut child: Child) {
    assert!(child.wait().expect("it ended").success());
}

#[test]
fn a_machine_in_another_process_is_identified_with_the_same_bits_as_in_this_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [here, there] = ["here", "there"].map(|name| folder.path().join(name));
    let serve = ["plant", "--io", "udp:127.0.0.1:0", "--preset", "prototype", "--seed", "3", "--once"];
    let mut plant =
        Command::new(PROGRAM).args(serve).args(OFF).stdout(Stdio::piped()).spawn().expect("the program starts");
    let address = lines(plant.stdout.take().expect("it is piped")).next().expect("it says where it is reached");
    let remote = calibrate(&there).args(["--io", &address]).stdout(Stdio::null()).spawn().expect("the program starts");
    ended_well(
        calibrate(&here).args(["--seed", "3"]).args(OFF).stdout(Stdio::null()).spawn().expect("the program starts"),
    );
    ended_well(remote);
    ended_well(plant);

    let (ours, theirs) = (results(&here), results(&there));
    assert_eq!(ours, theirs);
    let value = |name: &str| theirs[format!("calibrate.{name}")]["value"].as_f64().expect("a number");
    // What an admittance needs to know of its torques.
    assert!((value("torque_per_volt") / 0.207 - 1.0).abs() < 0.0025);
    assert!((value("torque_constant") / 0.097 - 1.0).abs() < 0.0025);
}

#[cfg(unix)]
#[test]
fn a_cancelled_calibration_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let mut command = calibrate(&out);
    command.arg("--progress").stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let mut said = lines(child.stderr.take().expect("it is piped"));
    assert!(said.any(|line| line.starts_with("fit of the drive")), "the program ended before its fit");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill is there");
    assert!(kill.success());
    assert_eq!(said.last().as_deref(), Some("error: cancelled"));
    assert_eq!(child.wait().expect("it ended").code(), Some(130));
    assert!(!out.exists());
}
