//! External machines: the C examples as separate programs and on a processor in QEMU.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Program, Stdio};

use serde_json::Value;
use stickslip::bench::{Bench as _, Change, Command, Frame, RemoteBench, Request};
use stickslip::{Preset, parameters};
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_stickslip");
/// Friction of `mass.h`, and the part of it that the preset's model assigns to the motor's brushes and bearings [N m].
const FRICTION: f64 = 0.1;
const MOTOR: f64 = 0.010;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A process that is stopped at the end of the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a program. Returns it with the first result of `find` in its output.
fn started(command: &mut Program, find: impl Fn(&str) -> Option<String>) -> (Running, String) {
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().expect("the program starts");
    let out = BufReader::new(child.stdout.take().expect("a pipe"));
    let result = out.lines().map_while(Result::ok).find_map(|line| find(&line));
    (Running(child), result.expect("it prints its address"))
}

fn compiled(compiler: &str, arguments: &[&str]) {
    let folder = root().join("examples/io");
    let strict = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"];
    let output = Program::new(compiler).current_dir(folder).args(strict).args(arguments).output();
    let output = output.unwrap_or_else(|error| panic!("{compiler}: {error}"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The mass as a program, and its address.
fn mass(folder: &TempDir, options: &[&str]) -> (Running, String) {
    let program = folder.path().join("mass");
    compiled("gcc", &["-o", &program.display().to_string(), "mass.c", "-lm"]);
    started(Program::new(program).args(options), |line| Some(line.to_owned()))
}

/// The breakaway torque that the bench measures on a machine [N m], or the error.
fn breakaway(folder: &TempDir, io: &str, more: &[&str]) -> Result<f64, String> {
    let out = folder.path().join("measured");
    let mut command = Program::new(PROGRAM);
    command.args(["measure", "breakaway", "--io", io, "--quiet", "--linings", "pressed", "--out"]).arg(&out);
    let output = command.args(["--set", "plan.angles=1", "--set", "plan.repetitions=1"]).args(more).output();
    let output = output.expect("the program starts");
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let text = std::fs::read_to_string(out.join("summary.json")).expect("the command wrote it");
    let summary: Value = serde_json::from_str(&text).expect("it is JSON");
    Ok(summary["results"]["measure.breakaway_torque"]["value"].as_f64().expect("the result is there"))
}

#[track_caller]
fn agrees(measured: Result<f64, String>) {
    let measured = measured.expect("the measurement succeeds");
    // The torque ramp continues until an encoder count shows the motion.
    assert!((measured - (FRICTION - MOTOR)).abs() < 0.01, "{measured}");
}

#[test]
fn the_mass_in_c_is_measured_over_datagrams_and_shared_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_mass, address) = mass(&folder, &["udp", "0"]);
    assert!(address.starts_with("udp:127.0.0.1:"), "{address}");
    agrees(breakaway(&folder, &address, &[]));
    let axis = folder.path().join("axis").display().to_string();
    let (mass, address) = mass(&folder, &["shm", &axis]);
    let slow = ["--set", "bench.tick_rate=1000", "--set", "bench.safety.missed_ticks=1000"];
    agrees(breakaway(&folder, &address, &slow));
    // A second bench, in real time: repeated if a busy computer interrupts the link.
    let in_real_time = [&slow[..], &["--real-time"]].concat();
    let measured = (0..5).map(|_| breakaway(&folder, &address, &in_real_time)).find(Result::is_ok);
    agrees(measured.expect("the link was interrupted five times"));
    drop(mass);
    let gone = Program::new(PROGRAM).args(["measure", "breakaway", "--io", &address]).output().expect("it starts");
    let error = String::from_utf8_lossy(&gone.stderr).into_owned();
    assert!(!gone.status.success() && error.contains("the machine at this address has ended"), "{error}");
}

/// Whether compiler and emulator are installed; otherwise prints the missing ones.
fn available() -> bool {
    let starts = |name: &&str| Program::new(name).arg("--version").stdout(Stdio::null()).status().is_ok();
    let missing: Vec<_> = ["arm-none-eabi-gcc", "qemu-system-arm"].into_iter().filter(|name| !starts(name)).collect();
    if !missing.is_empty() {
        println!("NOT RUN: {} missing", missing.join(", "));
    }
    missing.is_empty()
}

/// The frames of a push from rest at the start of homing.
fn push(address: &str) -> Vec<Frame> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench").and_then(|it| it.read()).expect("a preset");
    preset.bench.tick_rate = 1000.0;
    let mut bench = RemoteBench::connect(&preset, &address.parse().expect("an address")).expect("it answers");
    bench.change(Change::Request(Request::Home)).expect("a bench that is off homes");
    let command = Command { added_torque: 0.3, ..Command::default() };
    (0..120).map(|_| bench.step(command).expect("no fault occurs")).collect()
}

/// The emulator takes milliseconds for the bytes of a tick, so that only a few ticks are compared.
#[test]
fn the_mass_on_a_microcontroller_gives_the_same_bits_over_its_serial_port() {
    if !available() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let image = folder.path().join("board.elf").display().to_string();
    let firmware = root().join("firmware");
    let file = |name: &str| firmware.join(name).display().to_string();
    let (link, startup) = (file("link.ld"), file("startup.c"));
    let processor = ["-mthumb", "-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"];
    let start = ["--specs=rdimon.specs", "-nostartfiles", "-T", &link, &startup, "board.c", "-o", &image];
    compiled("arm-none-eabi-gcc", &[&processor[..], &start, &["-lm", "-lc", "-lrdimon"]].concat());
    let mut board = Program::new("qemu-system-arm");
    board.args(["-M", "mps2-an386", "-nographic", "-monitor", "none", "-semihosting", "-serial", "pty", "-kernel"]);
    let (_board, port) = started(board.arg(&image), |line| {
        line.split_whitespace().find(|word| word.starts_with("/dev/")).map(String::from)
    });
    let on_board = push(&format!("serial:{port}"));
    let (_mass, address) = mass(&folder, &["udp", "0"]);
    assert_eq!(on_board, push(&address));
    // 0.2 N m more than its friction, on 1.01e-3 kg m², for somewhat less than 0.12 s.
    assert!((1.0..1.5).contains(&on_board[119].angle), "{}", on_board[119].angle);
}

#[test]
fn the_examples_are_as_short_as_the_guide_says() {
    for name in ["machine.h", "mass.h", "mass.c", "board.c"] {
        let text = std::fs::read_to_string(root().join("examples/io").join(name)).expect("it is there");
        assert!(text.lines().count() < 200, "{name}");
    }
}
