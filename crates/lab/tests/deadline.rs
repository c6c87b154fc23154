//! What runs within the deadline allocates and frees nothing, whatever law renders and whoever changes it meanwhile.

#[path = "../../rt/tests/counting/mod.rs"]
#[allow(unreachable_pub, reason = "support of tests")]
mod counting;

use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

use counting::{CALLS, WATCHED};
use stickslip::bench::remote::LinkFault;
use stickslip::bench::{Bench, ClockedBench, Command, InProcess, Io, Voltages, Wishes, tap};
use stickslip::experiment::home;
use stickslip::fidelity::LAWS;
use stickslip::{Error, Preset, Watch, design, parameters};
use stickslip_core::control::reference::Setpoint;
use stickslip_core::tick::Measurement;

/// A machine that has its thread watched from its first tick until it is told to end.
struct Watched {
    machine: InProcess,
    ticks: u64,
    allocates: bool,
}

impl Io for Watched {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.ticks += 1;
        WATCHED.set((1..1500).contains(&self.ticks));
        if self.allocates && self.ticks == 100 {
            drop(std::hint::black_box(Box::new(1.0)));
        }
        self.machine.exchange(voltages)
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), Error> {
        self.machine.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }
}

/// Calls of the allocator within the ticks of homing and of a sine under one law after another.
fn calls(allocates: bool) -> Result<u64, Error> {
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    CALLS.store(0, Ordering::Relaxed);
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    preset.bench.tick_rate = 1000.0;
    let (machine, readings) = InProcess::new(&preset, 1)?;
    let machine = Watched { machine, ticks: 0, allocates };
    // Somebody records, with too little room: both paths of a tap are gone.
    let (tap, stream) = tap::tap(200);
    let mut bench = ClockedBench::over(&preset, machine, readings, Wishes::PLAIN, Some(tap))?;
    home(&mut bench, &Watch::silent())?;
    for &(_, law) in LAWS.iter().filter(|(name, _)| ["paper", "bristle", "admittance"].contains(name)) {
        preset.bench.law = law;
        let law = design::rendering_law(&preset.model, &preset.bench)?;
        bench.set_law(law)?;
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

#[test]
fn a_bench_that_runs_by_the_clock_allocates_and_frees_nothing() {
    assert_eq!(calls(false).unwrap(), 0);
}

#[test]
fn an_allocation_within_the_deadline_is_found() {
    assert_eq!(calls(true).unwrap(), 2, "one there, one back");
}
