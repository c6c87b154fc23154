//! The demonstration in this program against the same bench and manoeuvre in hand-written C, per tick.
//!
//! The peer gets the commands and parameters of a run and computes machine and software in a closed loop. With the
//! noise of this program its trajectories are compared with ours; its times are taken with a faster generator. Times are
//! those of the processor, all threads together: the demonstration takes seconds, in which a shared machine does other
//! work as well.

mod inputs;

use std::error::Error;
use std::path::Path;
use std::process::Command;

use inputs::Inputs;
use stickslip::bench::tap::{Tap, tap};
use stickslip::demo::Demo;
use stickslip::run::{About, Recorder};
use stickslip::{Preset, Watch, parameters};

/// Names of the comparisons: the demonstration alone, and with its recording.
pub(crate) const NAMES: [&str; 2] = ["demo/c", "demo_recorded/c"];
/// Rounds; the demonstration takes seconds.
const ROUNDS: usize = 5;
const SEED: u64 = 1;
/// Room of the stream of cycles.
const ROOM: usize = 1 << 15;
/// Compiler flags of the peer.
const FLAGS: [&str; 5] = ["-std=gnu11", "-O3", "-march=native", "-Wall", "bench.c"];
/// Ticks of the start in which all signals of the peer are equal up to rounding, and their largest deviation [SI units].
/// Later a difference in the last digit moves an encoder count by a tick, which acts like another noise.
const START: usize = 6000;
const ROUNDING: f64 = 1e-9;
/// Largest RMS deviation of the peer's signals over their RMS: angle, velocity, torque of the drive, of the load motor.
const APART: [f64; 4] = [2e-5, 2e-3, 1e-2, 5e-2];

/// Nanoseconds of a processor per tick in the best round.
pub(crate) struct Times {
    pub(crate) ours: f64,
    pub(crate) recorded: f64,
    pub(crate) peer: f64,
    /// RMS deviation of the peer's signals over their RMS, in the order of `APART`.
    pub(crate) apart: [f64; 4],
}

/// Runs the demonstration and its peer in turn.
///
/// # Errors
/// Without gcc; if the trajectories differ.
pub(crate) fn run() -> Result<Times, Box<dyn Error>> {
    let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    let folder = std::env::temp_dir().join(format!("stickslip-demo-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let outcome = contest(&preset, &folder);
    std::fs::remove_dir_all(&folder)?;
    outcome
}

fn contest(preset: &Preset<f64>, folder: &Path) -> Result<Times, Box<dyn Error>> {
    let inputs = watched(preset)?;
    std::fs::write(folder.join("inputs"), inputs.bytes())?;
    for (name, text) in [
        ("bench.h", include_str!("bench.h")),
        ("machine.h", include_str!("machine.h")),
        ("noise.h", include_str!("noise.h")),
        ("software.h", include_str!("software.h")),
        ("bench.c", include_str!("bench.c")),
    ] {
        std::fs::write(folder.join(name), text)?;
    }
    compile(folder, "bench", &[])?;
    compile(folder, "same", &["-DSAME_NOISE"])?;
    peer(folder, "same", Some("signals"))?;
    let apart = deviations(&inputs.signals, &std::fs::read(folder.join("signals"))?)?;
    let mut times = Times { ours: f64::INFINITY, recorded: f64::INFINITY, peer: f64::INFINITY, apart };
    let per_tick = 1e9 / inputs.ticks() as f64;
    for _ in 0..ROUNDS {
        let start = processor_time()?;
        demonstration(preset, None)?;
        let alone = processor_time()?;
        let about = About { command: "bench".into(), preset: *preset, seed: Some(SEED) };
        let (recorder, tap) = Recorder::start(&folder.join("run.mf4"), &about)?;
        demonstration(preset, Some(tap))?;
        recorder.finish()?;
        times.ours = times.ours.min(per_tick * (alone - start));
        times.recorded = times.recorded.min(per_tick * (processor_time()? - alone));
        times.peer = times.peer.min(peer(folder, "bench", None)?);
    }
    Ok(times)
}

fn demonstration(preset: &Preset<f64>, tap: Option<Tap>) -> Result<(), Box<dyn Error>> {
    Demo::run(preset, SEED, tap, &Watch::silent())?;
    Ok(())
}

/// Time of the processor that all threads of this process have taken [s].
fn processor_time() -> Result<f64, Box<dyn Error>> {
    /// Ticks of Linux a second.
    const TICKS: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").map_err(|error| format!("no processor times: {error}"))?;
    // The name of the program, in brackets, may contain spaces; then state, …, user and system time.
    let (_, fields) = text.rsplit_once(')').ok_or("unknown form of /proc/self/stat")?;
    let times = fields.split_whitespace().skip(11).take(2).map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    Ok(times.iter().sum::<f64>() / TICKS)
}

/// The commands, changes and signals of the demonstration.
fn watched(preset: &Preset<f64>) -> Result<Inputs, Box<dyn Error>> {
    let (tap, mut stream) = tap(ROOM);
    std::thread::scope(|scope| {
        let reading = scope.spawn(|| Inputs::read(preset, &mut stream).map_err(|error| error.to_string()));
        demonstration(preset, Some(tap))?;
        Ok(reading.join().map_err(|_| "the reading thread has panicked")??)
    })
}

fn compile(folder: &Path, program: &str, more: &[&str]) -> Result<(), Box<dyn Error>> {
    let out = Command::new("gcc")
        .args(FLAGS)
        .args(more)
        .args(["-o", program, "-lm"])
        .current_dir(folder)
        .output()
        .map_err(|error| format!("cannot start gcc ({error}). Install it: apt-get install gcc libc6-dev"))?;
    if out.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&out.stderr).into()) }
}

/// Nanoseconds per tick of the peer, which writes its signals into a file.
fn peer(folder: &Path, program: &str, signals: Option<&str>) -> Result<f64, Box<dyn Error>> {
    let seed = SEED.to_string();
    let arguments = ["inputs", &seed].into_iter().chain(signals);
    let out = Command::new(folder.join(program)).args(arguments).current_dir(folder).output()?;
    let text = String::from_utf8(out.stdout)?;
    let time = text.split_whitespace().next().filter(|_| out.status.success());
    Ok(time.ok_or_else(|| format!("the peer in C failed: {:?}", out.status))?.parse()?)
}

/// RMS deviation of each signal of the peer, over the RMS of ours.
fn deviations(ours: &[[f64; 4]], peer: &[u8]) -> Result<[f64; 4], Box<dyn Error>> {
    let peer: Vec<f64> = peer.chunks_exact(8).filter_map(|b| Some(f64::from_ne_bytes(b.try_into().ok()?))).collect();
    if peer.len() != 4 * ours.len() {
        return Err("the peer in C computed another number of ticks".into());
    }
    let (mut errors, mut sums, mut first) = ([0.0; 4], [0.0; 4], 0.0f64);
    for (tick, (ours, peer)) in ours.iter().zip(peer.chunks_exact(4)).enumerate() {
        for signal in 0..4 {
            let error = ours[signal] - peer[signal];
            errors[signal] += error * error;
            sums[signal] += ours[signal].powi(2);
            first = if tick < START { first.max(error.abs()) } else { first };
        }
    }
    let apart: [f64; 4] = std::array::from_fn(|signal| (errors[signal] / sums[signal]).sqrt());
    // Written so that a NaN is refused.
    if !(first <= ROUNDING && apart.iter().zip(APART).all(|(apart, limit)| *apart <= limit)) {
        let fault = format!("the peer in C computes other trajectories: {apart:?} apart, {first:e} at the start");
        return Err(fault.into());
    }
    Ok(apart)
}
