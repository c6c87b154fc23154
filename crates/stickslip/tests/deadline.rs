//! Code within the deadline does not allocate or free, under any law and during changes of it.

#[path = "../../rt/tests/counting/mod.rs"]
#[allow(unreachable_pub, reason = "support of tests")]
mod counting;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use counting::{CALLS, WATCHED};
use stickslip::bench::remote::{Address, Counts, LinkFault, Paced, PlantServer};
use stickslip::bench::{Arrival, Bench, ClockedBench, Command, InProcess, Io, ThreadSettings, Voltages, tap};
use stickslip::experiment::home;
use stickslip::fidelity::LAWS;
use stickslip::{Error, Preset, Watch, design, parameters};
use stickslip_core::control::reference::Setpoint;
use stickslip_core::snapshot::StateVisitor;
use stickslip_core::tick::Measurement;

/// Ticks with counted calls.
const WATCHED_TICKS: std::ops::Range<u64> = 1..1500;

/// A machine whose thread is watched from its first tick until the end.
struct Watched<M> {
    machine: M,
    ticks: u64,
    allocates: bool,
    /// Whether calls are counted now, instead of in the first ticks.
    now: Option<Arc<AtomicBool>>,
}

impl<M: Io> Io for Watched<M> {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.machine.exchange(voltages)
    }

    fn start(&mut self, tick: u64, voltages: Voltages<f64>) -> Result<Option<Measurement<f64>>, LinkFault> {
        self.ticks += 1;
        let now = self.now.as_ref().map(|now| now.load(Ordering::Relaxed));
        WATCHED.set(now.unwrap_or(WATCHED_TICKS.contains(&self.ticks)));
        if self.allocates && self.ticks == 100 {
            drop(std::hint::black_box(Box::new(1.0)));
        }
        self.machine.start(tick, voltages)
    }

    fn finish(&mut self) -> Arrival {
        self.machine.finish()
    }

    fn keep(&mut self, keep: &mut dyn StateVisitor) {
        self.machine.keep(keep);
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.machine.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }
}

/// As [`counted`], repeated if a stall of the machine ended the bench, which gives no count.
fn calls(allocates: bool) -> Result<u64, Error> {
    let mut tried = 0;
    loop {
        match counted(allocates) {
            Err(Error::BenchFault { .. }) if tried < 3 => tried += 1,
            other => return other,
        }
    }
}

/// Calls of the allocator within the ticks of homing and of a sine under one law after another.
fn counted(allocates: bool) -> Result<u64, Error> {
    let _alone = alone();
    let mut preset = preset()?;
    let (machine, readings) = InProcess::new(&preset, 1)?;
    let machine = Watched { machine, ticks: 0, allocates, now: None };
    // A recorder with too little room: both paths of a tap are used.
    let (tap, stream) = tap::tap(200);
    let mut bench = ClockedBench::over(&preset, machine, readings, ThreadSettings::PLAIN, Some(tap))?;
    let mut states = bench.keyframes().expect("it was not taken before");
    home(&mut bench, &Watch::silent())?;
    for &(_, law) in LAWS.iter().filter(|(name, _)| ["paper", "bristle", "admittance"].contains(name)) {
        preset.bench.law = law;
        let law = design::rendering_law(&preset.model, &preset.bench)?;
        bench.set_law(law)?;
        // A recording starts.
        states.take()?;
        for tick in 0..300 {
            let time = f64::from(tick) * 1e-3;
            let setpoint = Setpoint { position: 0.2 * (5.0 * time).sin(), ..Setpoint::default() };
            bench.hand_over(Command { setpoint, control: true, render: true, ..Command::default() })?;
        }
    }
    bench.step(Command::default())?;
    bench.stop();
    drop(stream);
    Ok(CALLS.load(Ordering::Relaxed))
}

fn preset() -> Result<Preset<f64>, Error> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    preset.bench.tick_rate = 1000.0;
    // For a busy computer.
    preset.bench.safety.missed_ticks = 1000.0;
    Ok(preset)
}

/// One test at a time counts, from 0.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    CALLS.store(0, Ordering::Relaxed);
    alone
}

/// The same within ticks over a link, whose machine answers until it disconnects.
fn calls_over(address: &Address) -> Result<u64, Error> {
    let _alone = alone();
    let preset = preset()?;
    let mut server = PlantServer::bind(address, &preset, 1)?;
    let address = server.address().clone();
    let stop = Arc::new(AtomicBool::new(false));
    let watch = Watch::new(stop.clone(), |_, _| {});
    let serving = thread::spawn(move || server.serve(false, &watch).map(drop));
    let fault = |fault: LinkFault| Error::BenchFault { cycle: 0, reason: fault.to_string() };
    let (machine, readings) = Paced::begin(&address, preset.bench.tick_time()).map_err(fault)?;
    let traffic = machine.traffic().expect("a link has some");
    let machine = Watched { machine, ticks: 0, allocates: false, now: None };
    let bench = ClockedBench::over(&preset, machine, readings, ThreadSettings::PLAIN, None)?;
    let until = |enough: &dyn Fn(Counts) -> bool| {
        while !enough(traffic.counts()) {
            thread::sleep(Duration::from_millis(5));
        }
    };
    until(&|counts| counts.answered > 200);
    stop.store(true, Ordering::Relaxed);
    serving.join().expect("the machine does not panic")?;
    // Until the thread is no longer watched: memory freed at its end is outside the cycles.
    until(&|counts| counts.answered + counts.missing > WATCHED_TICKS.end);
    bench.stop();
    Ok(CALLS.load(Ordering::Relaxed))
}

/// Environment variable that makes a test process the host of a controller.
#[cfg(unix)]
const HOSTED: &str = "STICKSLIP_TEST_HOST";
/// And its role.
#[cfg(unix)]
const AS: &str = "STICKSLIP_TEST_ROLE";

/// The only test that runs in a host process.
#[test]
#[cfg(unix)]
fn hosts() {
    if let Some(file) = std::env::var_os(HOSTED) {
        let role = std::env::var(AS).ok().and_then(|name| stickslip::external::Role::find(&name));
        let role = role.expect("it has a role");
        stickslip::external::process::host(std::path::Path::new(&file), role, &[]).expect("the parent sends requests");
        std::process::exit(0);
    }
}

/// The same with an external library in C in the loop along a sine, in this process or in a separate one.
#[cfg(unix)]
fn calls_of_a_guest(role: stickslip::external::Role, trusted: bool) -> Result<u64, Error> {
    use stickslip::ControllerChoice;
    use stickslip::external::{External, Role, process::HostProcess};
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let library = folder.path().join("p_pi.so");
    let mut compiler = std::process::Command::new("cc");
    compiler.args(["-O1", "-shared", "-fPIC", "-I"]).arg(here.join("../bench/src/external")).arg("-o").arg(&library);
    assert!(compiler.arg(here.join("../../examples/controller/p_pi.c")).status().is_ok_and(|status| status.success()));
    let _alone = alone();
    let mut preset = preset()?;
    preset.bench.control_divider = if trusted { 1.0 } else { 2.0 };
    // As soft as samples of 2 ms permit.
    let ControllerChoice::Cascade(cascade) = &mut preset.bench.controller else { panic!("it is a cascade") };
    (cascade.position_gain, cascade.velocity_gain, cascade.integral_gain) = (8.0, 0.04, 0.4);
    preset.bench.safety.following_error = 10.0;
    let mut external = if trusted {
        External::trusted(&library, role)?
    } else {
        let program = std::env::current_exe().expect("a program has a path");
        let call = format!("{AS}=\"$2\" {HOSTED}=\"$3\" exec '{}' --exact hosts --nocapture", program.display());
        External::in_own_process(
            &library,
            role,
            &HostProcess { program: "sh".into(), arguments: ["-c".into(), call.into(), "host".into()].into() },
        )?
    };
    for (name, value) in [("position_gain", 6.0), ("velocity_gain", 0.03), ("integral_time", 0.2)] {
        external.set(name, value)?;
    }
    let (machine, readings) = InProcess::new(&preset, 1)?;
    let now = Arc::new(AtomicBool::new(false));
    let machine = Watched { machine, ticks: 0, allocates: false, now: Some(now.clone()) };
    let (tap, mut stream) = tap::tap(1 << 14);
    let mut bench = ClockedBench::over(&preset, machine, readings, ThreadSettings::PLAIN, Some(tap))?;
    home(&mut bench, &Watch::silent())?;
    bench.bring(external)?;
    let render = role != Role::Controller;
    while stream.sample().is_some() {}
    now.store(true, Ordering::Relaxed);
    let follow = |bench: &mut ClockedBench| -> Result<(), Error> {
        // Off and on again as well: it is started again.
        for tick in 0..600 {
            let setpoint = Setpoint { position: 0.2 * (5e-3 * f64::from(tick)).sin(), ..Setpoint::default() };
            bench.hand_over(Command { setpoint, control: tick % 200 != 0, render, ..Command::default() })?;
        }
        bench.drain(&mut |_| {})
    };
    // On a busy machine it may be late: the handling of a fault does not allocate either.
    let followed = follow(&mut bench);
    assert!(matches!(followed, Ok(()) | Err(Error::BenchFault { .. })), "{followed:?}");
    let torque = |Command { added_torque, added_load_torque, .. }: Command| added_torque + added_load_torque;
    let torques = std::iter::from_fn(|| stream.sample()).filter(|sample| torque(sample.frame.command) != 0.0);
    assert!(torques.count() > 0, "{role}: it is in the loop");
    let removed = bench.take_back(&preset.bench)?;
    now.store(false, Ordering::Relaxed);
    // At least one tick without watching.
    thread::sleep(Duration::from_millis(200));
    bench.stop();
    drop(removed);
    Ok(CALLS.load(Ordering::Relaxed))
}

#[test]
#[cfg(unix)]
fn external_code_in_the_loop_does_not_allocate_or_free() {
    for role in stickslip::external::Role::ALL {
        assert_eq!(calls_of_a_guest(role, true).unwrap(), 0, "{role}");
        assert_eq!(calls_of_a_guest(role, false).unwrap(), 0, "{role}");
    }
}

#[test]
fn a_link_does_not_allocate_or_free_with_or_without_an_answer() {
    let folder = tempfile::tempdir().unwrap();
    let memory = Address::Shm(folder.path().join("axis").display().to_string());
    assert_eq!(calls_over(&memory).unwrap(), 0);
    assert_eq!(calls_over(&"udp:127.0.0.1:0".parse().unwrap()).unwrap(), 0);
}

#[test]
fn a_bench_in_real_time_does_not_allocate_or_free() {
    assert_eq!(calls(false).unwrap(), 0);
}

#[test]
fn an_allocation_within_the_deadline_is_found() {
    assert_eq!(calls(true).unwrap(), 2, "one there, one back");
}
