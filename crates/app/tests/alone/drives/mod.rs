//! The bench on two servo drives in another process: `plant --ethercat` and `serve --io ethercat:…` over a pair of
//! virtual interfaces, in a network namespace that ends with the test.
#![expect(clippy::unwrap_used, reason = "tests")]

mod experiment;
mod faults;
mod homing;

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Output, Stdio};
use std::sync::{Mutex, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");
/// Set in the namespace.
const INSIDE: &str = "STICKSLIP_IN_NAMESPACE";
/// One bench in real time at a time.
static RUNNING: Mutex<()> = Mutex::new(());
/// A loaded computer may be late: watchdogs of 2 s, missed set-points are not supervised.
const DRIVES: &str = "watchdog = 2.0\n\
    [motor]\nstart = [{ index = 0x10F1, subindex = 2, value = 65535, bytes = 2 }]\n\
    [load]\nstart = [{ index = 0x10F1, subindex = 2, value = 65535, bytes = 2 }]\n\
    [accelerometer]\nposition = 2\nvolts = 10.0\n";
/// The paper's bench at 1 kHz. After late frames the encoder seems to jump, the axis to lag, and the sensors to differ.
const SETTINGS: [(&str, &str); 9] = [
    ("bench.torque_amplifier", "true"),
    ("bench.tick_rate", "1000"),
    ("bench.safety.missed_ticks", "500"),
    ("bench.safety.speed", "10000"),
    ("bench.safety.following_error", "10"),
    ("bench.safety.moving_velocity", "1000"),
    ("bench.safety.acceleration_difference", "1e6"),
    ("model.encoder.counts_per_revolution", "65536"),
    ("model.encoder.counter_range", "4294967296"),
];
/// Drives without a delay of their own.
const PROMPT: [(&str, &str); 3] =
    [("bench.controller.position_gain", "8"), ("bench.controller.velocity_gain", "0.05"), ("model.drive_lag", "0.003")];

/// Messages after a stall of this computer.
const STALLS: [&str; 4] = ["fell behind the clock", "deadlines were missed", "the software missed", "has not answered"];

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

/// Runs a part of the test in a namespace, in which this program is started again for the test of this name.
fn in_namespace(test: &str, inside: fn()) {
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
    // As root, so that the threads of bench and drives have a real-time priority; otherwise with a user namespace.
    let Some(options) = ["-n", "-rn"].into_iter().find(|options| permitted(options)) else {
        println!("NOT RUN: this computer permits no network namespace with virtual interfaces, or iproute2 is missing");
        return;
    };
    let _running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
    let program = std::env::current_exe().unwrap();
    let line = format!("{links} && exec {} --exact drives::{test} --nocapture", program.display());
    // Also the threads without a real-time priority run before those of other programs, if that is permitted.
    let mut command = Command::new("nice");
    command.args(["-n", "-15", "unshare", options, "sh", "-c", &line]).env(INSIDE, "1");
    assert!(command.status().unwrap().success());
}

/// The emulated drives in their process.
struct Plant {
    _process: Running,
    input: ChildStdin,
    lines: mpsc::Receiver<String>,
}

impl Plant {
    fn start(options: &[&str]) -> Self {
        let mut plant = Command::new(PROGRAM);
        plant.args(["plant", "--ethercat", "ec0", "--analog", "1", "--faults"]).args(options);
        let mut plant = Running(plant.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap());
        let (input, output) = (plant.0.stdin.take().unwrap(), plant.0.stdout.take().unwrap());
        let (sender, lines) = mpsc::channel();
        thread::spawn(move || {
            BufReader::new(output).lines().map_while(Result::ok).try_for_each(|line| sender.send(line))
        });
        assert_eq!(lines.recv().unwrap(), "ethercat:ec0");
        Plant { _process: plant, input, lines }
    }

    /// Causes a fault: position, entry of object 0x2020, value.
    fn fault(&mut self, request: &str) {
        writeln!(self.input, "{request}").unwrap();
    }
}

/// The served bench in its process.
struct Bench {
    process: Running,
    project: String,
    folder: TempDir,
}

impl Bench {
    /// Starts it; the folder is that of the test.
    fn start(folder: TempDir, settings: &[(&str, &str)]) -> Self {
        let drives = folder.path().join("drives.toml");
        std::fs::write(&drives, DRIVES).unwrap();
        let project = folder.path().join("project").display().to_string();
        let io = format!("ethercat:ec1,{}", drives.display());
        let mut serve = Command::new(PROGRAM);
        serve.args(["serve", "--listen", "127.0.0.1:0", "--json", "--project", &project, "--io", &io]);
        for (path, value) in SETTINGS.iter().chain(settings) {
            serve.args(["--set", &format!("{path}={value}")]);
        }
        let process = Running(serve.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap());
        let mut bench = Bench { process, project, folder };
        let (start, file) = (Instant::now(), PathBuf::from(&bench.project).join("serve.json"));
        while !file.exists() {
            let is_running = bench.process.0.try_wait().unwrap().is_none();
            assert!(start.elapsed() < Duration::from_secs(60) && is_running, "it has not started");
            thread::sleep(Duration::from_millis(20));
        }
        bench
    }

    /// Runs a command of the program for this bench.
    fn command(&self, words: &[&str]) -> Output {
        program(&[words, &["--project", &self.project]].concat())
    }

    fn status(&self) -> Value {
        let output = self.command(&["status", "--json"]);
        serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output)))
    }

    /// Waits until the status has a property.
    fn wait(&self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let status = self.status();
            if holds(&status) {
                return status;
            }
            assert!(start.elapsed() < Duration::from_secs(20), "no {what}: {status}");
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Switches off, acknowledges a fault, if there is one, and homes. Returns false after a stall of this computer.
    fn is_homed(&self) -> bool {
        self.wait("end of the motion", |status| status["doing"].is_null());
        // One of both is refused.
        self.command(&["bench", "off"]);
        self.command(&["bench", "acknowledge"]);
        let output = self.command(&["bench", "home"]);
        let message = text(&output);
        if !output.status.success() {
            assert!(STALLS.iter().any(|stall| message.contains(stall)), "{message}");
            println!("again: {message}");
        }
        output.status.success()
    }

    /// Ends it as by Ctrl-C. Returns its summary, and the folder of the test.
    fn end(mut self) -> (Value, TempDir) {
        let interrupt = Command::new("kill").args(["-INT", &self.process.0.id().to_string()]).status();
        assert!(interrupt.unwrap().success());
        assert!(self.process.0.wait().unwrap().code().is_some(), "it ends by itself");
        let mut text = String::new();
        self.process.0.stdout.take().unwrap().read_to_string(&mut text).unwrap();
        (serde_json::from_str(text.split_once('\n').unwrap().1).unwrap(), self.folder)
    }
}
