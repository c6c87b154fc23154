//! pyxcp on a bench that is served. Without it (`pip install pyxcp`) this says that it was left out. The Python to take
//! is named by `STICKSLIP_PYTHON`, or is `python3`.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");

/// A bench of few ticks, which a busy machine keeps up with, for as long as this lives.
struct Served(Child);

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Where it listens, by transport.
fn doors(project: &Path) -> Vec<Value> {
    loop {
        let status = Command::new(PROGRAM).args(["status", "--json", "--project"]).arg(project).output();
        let status: Option<Value> = serde_json::from_slice(&status.expect("the program starts").stdout).ok();
        match status.as_ref().and_then(|status| status["xcp"].as_array()) {
            Some(doors) if doors.len() == 2 => return doors.clone(),
            _ => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

#[test]
fn pyxcp_reads_writes_switches_pages_and_measures_every_cycle() {
    let python = std::env::var("STICKSLIP_PYTHON").unwrap_or_else(|_| "python3".into());
    let there = Command::new(&python).args(["-c", "import pyxcp"]).output().is_ok_and(|o| o.status.success());
    if !there {
        println!("NOT RUN: pyxcp is missing (pip install pyxcp)");
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lab/tests/interop/xcp.py");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let project = folder.path().join("project");
    let words = "serve --listen 127.0.0.1:0 --xcp-udp 0 --xcp-tcp 0 --set bench.tick_rate=1000 --quiet --project";
    let mut serve = Command::new(PROGRAM);
    let serve = serve.args(words.split(' ')).arg(&project).stdout(Stdio::null()).spawn().expect("the program starts");
    let _served = Served(serve);
    for door in doors(&project) {
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
