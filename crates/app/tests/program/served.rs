//! A running bench: with pyxcp, with a machine in another process, on a full disk.
//!
//! The test with pyxcp is skipped with a message if pyxcp is missing (`pip install pyxcp`). The variable
//! `STICKSLIP_PYTHON` names the Python; default: `python3`.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");
/// Interval between two requests of the status.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// A process that is stopped at the end of the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A running bench with a low rate, which is possible on a busy computer. It is stopped when dropped.
struct Served {
    folder: TempDir,
    _serve: Running,
}

impl Served {
    /// Starts the bench by a command that ends with the program.
    fn start(command: Command, more: &[&str]) -> Self {
        Self::start_in(tempfile::tempdir().expect("a temporary folder"), command, more)
    }

    /// The same in a folder that may have a project.
    fn start_in(folder: TempDir, mut command: Command, more: &[&str]) -> Self {
        let words = ["serve", "--listen", "127.0.0.1:0", "--set", "bench.tick_rate=1000", "--quiet", "--project"];
        command.args(words).arg(project(&folder)).args(more).stdin(Stdio::null()).stdout(Stdio::null());
        Served { _serve: Running(command.spawn().expect("the program starts")), folder }
    }

    fn project(&self) -> PathBuf {
        project(&self.folder)
    }

    fn command(&self, words: &[&str]) -> Output {
        let mut command = Command::new(PROGRAM);
        command.args(words).arg("--project").arg(self.project()).output().expect("the program starts")
    }

    /// The first result of `find` in a status.
    fn status<T>(&self, find: impl Fn(&Value) -> Option<T>) -> T {
        loop {
            let status = serde_json::from_slice(&self.command(&["status", "--json"]).stdout).ok();
            match status.as_ref().and_then(&find) {
                Some(result) => return result,
                None => thread::sleep(POLL_INTERVAL),
            }
        }
    }

    /// The summary of the replay of a recording, which must be identical.
    fn replay(&self, name: &str) -> Value {
        let runs = self.project().join("runs");
        let mut folders =
            std::fs::read_dir(&runs).expect("there are runs").map_while(Result::ok).map(|entry| entry.path());
        let run = folders.find(|folder| folder.to_string_lossy().ends_with(name)).expect("it was recorded");
        let output = Command::new(PROGRAM).arg("replay").arg(run).arg("--json").output().expect("the program starts");
        assert!(output.status.success(), "{}", text(&output));
        serde_json::from_slice(&output.stdout).expect("it is JSON")
    }
}

fn project(folder: &TempDir) -> PathBuf {
    folder.path().join("project")
}

fn text(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

#[test]
fn pyxcp_reads_writes_switches_pages_and_measures_every_cycle() {
    let python = std::env::var("STICKSLIP_PYTHON").unwrap_or_else(|_| "python3".into());
    let installed = Command::new(&python).args(["-c", "import pyxcp"]).output().is_ok_and(|o| o.status.success());
    if !installed {
        println!("NOT RUN: pyxcp is missing (pip install pyxcp)");
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stickslip/tests/interop/xcp.py");
    let served = Served::start(Command::new(PROGRAM), &["--xcp-udp", "0", "--xcp-tcp", "0"]);
    for door in served.status(|status| status["xcp"].as_array().filter(|doors| doors.len() == 2).cloned()) {
        let (transport, address) = (door["transport"].as_str(), door["address"].as_str());
        let words = [transport, address].map(|word| word.expect("a door has a transport and an address"));
        let output = Command::new(&python).arg(&script).args(words).arg("1").output().expect("the Python starts");
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{words:?}: {error}");
        let results: Value = serde_json::from_slice(&output.stdout).expect("the script prints JSON");
        for (path, expected) in [
            ("/name", json!("stickslip")),
            ("/epk", json!(true)),
            ("/written", json!(true)),
            ("/refused", json!("ERR_OUT_OF_RANGE")),
            ("/wild", json!("ERR_ACCESS_DENIED")),
            ("/checksum", json!(true)),
            ("/pages/collected", json!([1, 0])),
            ("/pages/working", json!(true)),
            ("/pages/reference", json!(true)),
            ("/pages/protected", json!("ERR_WRITE_PROTECTED")),
            ("/pages/copied", json!(true)),
            ("/measurement/signals", json!(20)),
        ] {
            assert_eq!(results.pointer(path), Some(&expected), "{path} by {words:?}: {results}");
        }
        let measured = |name: &str| results["measurement"][name].as_f64().unwrap_or(f64::NAN);
        assert!(measured("rows") > 100.0, "{results}");
        // A row is missing only if the network lost its frame, which TCP does not.
        assert!(measured("cycle_gaps") <= measured("frame_gaps"), "{results}");
        assert!(words[0] == "udp" || measured("frame_gaps") == 0.0, "{results}");
        assert_eq!(measured("cycle_gaps"), measured("time_gaps"), "{results}");
    }
}

#[test]
fn a_program_that_is_killed_while_it_saves_leaves_a_whole_state() {
    let mut folder = tempfile::tempdir().expect("a temporary folder");
    for round in 0..4_u64 {
        let served = Served::start_in(folder, Command::new(PROGRAM), &[]);
        served.status(|status| status["cycle"].as_u64().filter(|cycle| *cycle > 0));
        if round > 0 {
            assert!(served.status(|status| status["earlier"].as_u64()) > 0, "it is offered after a start");
        }
        // Changes without a pause, and the end in the middle of one.
        let project = served.project();
        let changes = thread::spawn(move || {
            for gain in (0..).map(|k| 10.0 + f64::from(k % 40) * 0.1) {
                let value = gain.to_string();
                let words = ["params", "set", "live", "bench.controller.position_gain", &value, "--project"];
                let changed = Command::new(PROGRAM).args(words).arg(&project).output().expect("the program starts");
                if !changed.status.success() {
                    return;
                }
            }
        });
        let file = served.project().join("state/target.json");
        while !file.exists() {
            thread::sleep(POLL_INTERVAL);
        }
        thread::sleep(Duration::from_millis(300 + 37 * round));
        let Served { folder: same, _serve: running } = served;
        // The process is killed.
        drop(running);
        changes.join().expect("the changes do not panic");
        folder = same;
        let state: Value = serde_json::from_slice(&std::fs::read(&file).expect("it was saved")).expect("it is whole");
        assert_eq!(state["schema"], "stickslip.target-state/1");
        assert!(state["parameters"].as_str().is_some_and(|text| text.contains("position_gain")));
    }
}

#[test]
fn the_recording_of_a_machine_in_another_process_replays_bit_for_bit() {
    let mut plant = Command::new(PROGRAM);
    plant.args(["plant", "--io", "udp:127.0.0.1:0", "--set", "bench.tick_rate=1000"]).stdout(Stdio::piped());
    let mut plant = plant.spawn().expect("the program starts");
    let mut address = String::new();
    BufReader::new(plant.stdout.take().expect("a pipe")).read_line(&mut address).expect("it prints its address");
    let _plant = Running(plant);
    // On a busy computer the link may be interrupted, which is a fault; the recording contains it.
    let served = Served::start(Command::new(PROGRAM), &["--io", address.trim()]);
    served.status(|status| status["cycle"].as_u64().filter(|cycle| *cycle > 0));
    let started = served.command(&["bench", "record", "outside"]);
    assert!(started.status.success(), "{}", text(&started));
    let _ = served.command(&["bench", "home"]);
    let ended = served.command(&["bench", "record", "--stop"]);
    assert!(ended.status.success(), "{}", text(&ended));
    let summary = served.replay("outside");
    let result = |name: &str| summary["results"][name]["value"].as_f64();
    assert!(result("replay.cycles") > Some(100.0), "{summary}");
    // The machine is not part of the replay: the software runs on the recorded readings.
    assert_eq!(result("replay.machine"), Some(0.0), "{summary}");
}

/// A limit of the file size has the same effect as a full disk.
#[test]
#[cfg(unix)]
fn on_a_full_disk_the_bench_continues_and_the_recording_is_complete_up_to_the_error() {
    let mut shell = Command::new("sh");
    // Refused writes are errors, not signals; the blocks have 512 or 1024 bytes.
    shell.args(["-c", "trap '' XFSZ; ulimit -f 1024; exec \"$0\" \"$@\"", PROGRAM]);
    let served = Served::start(shell, &[]);
    served.status(|status| status["cycle"].as_u64().filter(|cycle| *cycle > 0));
    let started = served.command(&["bench", "record", "full"]);
    assert!(started.status.success(), "{}", text(&started));
    let (rows, cycle) = served.status(|status| {
        let refused = status["recording"].as_str().is_some_and(|text| text.contains("File too large"));
        let rows = status["recorded"]["length"].as_f64().map(|length| length * 1000.0);
        refused.then(|| (rows.unwrap_or(0.0), status["cycle"].as_u64().unwrap_or(u64::MAX)))
    });
    served.status(|status| status["cycle"].as_u64().filter(|now| *now > cycle));
    let homed = served.command(&["bench", "home"]);
    assert!(homed.status.success(), "{}", text(&homed));
    // The command that ends the recording reports its error.
    let ended = served.command(&["bench", "record", "--stop"]);
    assert!(text(&ended).contains("File too large"), "{}", text(&ended));
    let cycles = served.replay("full")["results"]["replay.cycles"]["value"].as_f64().unwrap_or(0.0);
    assert!(cycles > 200.0 && cycles >= rows - 200.0, "{cycles} of {rows}");
    served.status(|status| {
        assert_eq!(status["not_entered"], Value::Null);
        text(&served.command(&["runs"])).contains("full").then_some(())
    });
}
