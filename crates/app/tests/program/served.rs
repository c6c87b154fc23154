//! A bench that is served, used from outside: by pyxcp, on a machine in another process, on a disk that is full.
//!
//! Without pyxcp (`pip install pyxcp`) its part says that it was left out. The Python to take is named by
//! `STICKSLIP_PYTHON`, or is `python3`.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;

use serde_json::{Value, json};
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");
/// From look to look.
const LOOK: Duration = Duration::from_millis(20);

/// A process that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A bench of few ticks, which a busy machine keeps up with, for as long as this lives.
struct Served {
    folder: TempDir,
    _serve: Running,
}

impl Served {
    /// Starts it by a command of that many words, the program's included.
    fn start(mut command: Command, more: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let words = ["serve", "--listen", "127.0.0.1:0", "--set", "bench.tick_rate=1000", "--quiet", "--project"];
        command.args(words).arg(project(&folder)).args(more).stdin(Stdio::null()).stdout(Stdio::null());
        Served { _serve: Running(command.spawn().expect("the program starts")), folder }
    }

    fn project(&self) -> PathBuf {
        project(&self.folder)
    }

    fn ask(&self, words: &[&str]) -> Output {
        let mut command = Command::new(PROGRAM);
        command.args(words).arg("--project").arg(self.project()).output().expect("the program starts")
    }

    /// The first status in which something is found.
    fn status<T>(&self, find: impl Fn(&Value) -> Option<T>) -> T {
        loop {
            let status = serde_json::from_slice(&self.ask(&["status", "--json"]).stdout).ok();
            match status.as_ref().and_then(&find) {
                Some(found) => return found,
                None => thread::sleep(LOOK),
            }
        }
    }

    /// What `replay` says of its first recording, which must be identical.
    fn replayed(&self, name: &str) -> Value {
        let runs = self.project().join("runs");
        let mut folders =
            std::fs::read_dir(&runs).expect("there are runs").map_while(Result::ok).map(|entry| entry.path());
        let run = folders.find(|folder| folder.to_string_lossy().ends_with(name)).expect("it was recorded");
        let replay = Command::new(PROGRAM).arg("replay").arg(run).arg("--json").output().expect("the program starts");
        assert!(replay.status.success(), "{}", text(&replay));
        serde_json::from_slice(&replay.stdout).expect("it is JSON")
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
    let there = Command::new(&python).args(["-c", "import pyxcp"]).output().is_ok_and(|o| o.status.success());
    if !there {
        println!("NOT RUN: pyxcp is missing (pip install pyxcp)");
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stickslip/tests/interop/xcp.py");
    let served = Served::start(Command::new(PROGRAM), &["--xcp-udp", "0", "--xcp-tcp", "0"]);
    for door in served.status(|status| status["xcp"].as_array().filter(|doors| doors.len() == 2).cloned()) {
        let (transport, address) = (door["transport"].as_str(), door["address"].as_str());
        let words = [transport, address].map(|word| word.expect("a door has a transport and an address"));
        let output = Command::new(&python).arg(&script).args(words).arg("1").output().expect("it has just run");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{words:?}: {said}");
        let seen: Value = serde_json::from_slice(&output.stdout).expect("the script prints JSON");
        for (what, wanted) in [
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
            assert_eq!(seen.pointer(what), Some(&wanted), "{what} by {words:?}: {seen}");
        }
        let measured = |what: &str| seen["measurement"][what].as_f64().unwrap_or(f64::NAN);
        assert!(measured("rows") > 100.0, "{seen}");
        // A row is missing only where the network lost its frame, which a connection does not.
        assert!(measured("cycle_gaps") <= measured("frame_gaps"), "{seen}");
        assert!(words[0] == "udp" || measured("frame_gaps") == 0.0, "{seen}");
        assert_eq!(measured("cycle_gaps"), measured("time_gaps"), "{seen}");
    }
}

#[test]
fn a_machine_in_another_process_is_recorded_and_its_record_replays_to_the_bit() {
    let mut plant = Command::new(PROGRAM);
    plant.args(["plant", "--io", "udp:127.0.0.1:0", "--set", "bench.tick_rate=1000"]).stdout(Stdio::piped());
    let mut plant = plant.spawn().expect("the program starts");
    let mut address = String::new();
    BufReader::new(plant.stdout.take().expect("a pipe")).read_line(&mut address).expect("it says where it is reached");
    let _plant = Running(plant);
    // A busy computer may leave a machine without a frame for long, which is a fault; recorded it is all the same.
    let served = Served::start(Command::new(PROGRAM), &["--io", address.trim()]);
    served.status(|status| status["cycle"].as_u64().filter(|cycle| *cycle > 0));
    let begun = served.ask(&["bench", "record", "outside"]);
    assert!(begun.status.success(), "{}", text(&begun));
    let _ = served.ask(&["bench", "home"]);
    let ended = served.ask(&["bench", "record", "--stop"]);
    assert!(ended.status.success(), "{}", text(&ended));
    let replayed = served.replayed("outside");
    let result = |name: &str| replayed["results"][name]["value"].as_f64();
    assert!(result("replay.cycles") > Some(100.0), "{replayed}");
    // The machine was another's: the software alone is run again, on the readings that are in the record.
    assert_eq!(result("replay.machine"), Some(0.0), "{replayed}");
}

/// A largest size of a file is to a program what a full disk is.
#[test]
#[cfg(unix)]
fn where_the_disk_takes_no_more_the_bench_goes_on_and_the_record_is_whole_up_to_there() {
    let mut shell = Command::new("sh");
    // Refused writes shall be errors, not signals; blocks of 512 or of 1024 bytes.
    shell.args(["-c", "trap '' XFSZ; ulimit -f 1024; exec \"$0\" \"$@\"", PROGRAM]);
    let served = Served::start(shell, &[]);
    served.status(|status| status["cycle"].as_u64().filter(|cycle| *cycle > 0));
    let begun = served.ask(&["bench", "record", "full"]);
    assert!(begun.status.success(), "{}", text(&begun));
    let (rows, cycle) = served.status(|status| {
        let refused = status["recording"].as_str().is_some_and(|why| why.contains("File too large"));
        let rows = status["recorded"]["length"].as_f64().map(|length| length * 1000.0);
        refused.then(|| (rows.unwrap_or(0.0), status["cycle"].as_u64().unwrap_or(u64::MAX)))
    });
    served.status(|status| status["cycle"].as_u64().filter(|now| *now > cycle));
    let homed = served.ask(&["bench", "home"]);
    assert!(homed.status.success(), "{}", text(&homed));
    // Who ends it hears that it has ended by itself.
    let ended = served.ask(&["bench", "record", "--stop"]);
    assert!(text(&ended).contains("File too large"), "{}", text(&ended));
    let cycles = served.replayed("full")["results"]["replay.cycles"]["value"].as_f64().unwrap_or(0.0);
    assert!(cycles > 200.0 && cycles >= rows - 200.0, "{cycles} of {rows}");
    served.status(|status| {
        assert_eq!(status["not_entered"], Value::Null);
        text(&served.ask(&["runs"])).contains("full").then_some(())
    });
}
