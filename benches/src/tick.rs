//! Time of a complete tick of the bench at 10 kHz, spinning: software with the bristle rendering law, virtual machine,
//! and a capture of every signal. Also the number of ticks until a parameter change is active.

use std::error::Error;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

use stickslip::bench::remote::LinkFault;
use stickslip::bench::tap::tap;
use stickslip::bench::{Bench, Change, ClockedBench, Command, InProcess, Io, ThreadSettings, VirtualBench, Voltages};
use stickslip::capture::{Capture, Keep, Plan, Stream, Trigger};
use stickslip::experiment::home;
use stickslip::realtime::measure_floor;
use stickslip::run::{Signals, channels};
use stickslip::{LawChoice, Preset, Watch, parameters};
use stickslip_core::control::reference::{Generator, Reference};
use stickslip_core::tick::Measurement;
use stickslip_rt::{Block, Clock, Cycle, Lap, MonotonicClock, Next, OverrunPolicy, Running};

/// Timed ticks; several passes repeat the same ticks from the same seed.
const TICKS: usize = 2_000_000;
const PASSES: usize = 5;
/// Duration of the measurement of disturbances, about that of the ticks.
const WATCHED: Duration = Duration::from_secs(36);
/// Ticks run during TURN [ns] of each period, because the kernel throttles a thread above 95 % of a second.
const PERIOD: Duration = Duration::from_millis(100);
const TURN: u64 = 85_000_000;

/// Times of ticks [µs].
pub(crate) struct Ticks {
    pub(crate) median: f64,
    pub(crate) p9999: f64,
    /// Slowest tick without disturbance: the fastest pass of each tick counts, because a disturbance rarely hits the
    /// same tick twice.
    pub(crate) own_worst: f64,
    /// Slowest tick of all passes.
    pub(crate) worst: f64,
    /// Longest disturbance by the machine in the same duration.
    pub(crate) floor: f64,
}

fn preset(tick_rate: f64) -> Result<Preset<f64>, Box<dyn Error>> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    preset.bench.tick_rate = tick_rate;
    preset.bench.law = LawChoice::Bristle;
    Ok(preset)
}

/// Runs ticks one after the other, with a pause in each period as in the measurement of disturbances.
struct Ticking {
    bench: VirtualBench,
    generator: Generator<'static>,
    /// Time of each tick [ns]; the memory is allocated and touched.
    times: Vec<u32>,
    done: usize,
    result: mpsc::Sender<Result<Vec<u32>, stickslip::Error>>,
}

impl Cycle for Ticking {
    fn blocks(&self) -> &[Block] {
        &[]
    }

    fn run(&mut self, _: u64, _: &mut Lap) -> Next {
        let clock = MonotonicClock::default();
        let (start, mut now) = (clock.now(), clock.now());
        while self.done < self.times.len() && now - start < TURN {
            let setpoint = self.generator.next();
            let command = Command { setpoint, control: true, render: true, ..Command::default() };
            let before = clock.now();
            if let Err(error) = self.bench.step(command) {
                let _ = self.result.send(Err(error));
                return Next::Stop;
            }
            now = clock.now();
            self.times[self.done] = u32::try_from(now - before).unwrap_or(u32::MAX);
            self.done += 1;
        }
        if self.done < self.times.len() { Next::Continue } else { Next::Stop }
    }

    fn hold(&mut self, _: u64) {}

    fn end(&mut self) {
        let _ = self.result.send(Ok(std::mem::take(&mut self.times)));
    }
}

/// Measures the times of ticks.
pub(crate) fn ticks() -> Result<Ticks, Box<dyn Error>> {
    let preset = preset(10_000.0)?;
    // The same duration before and after the ticks.
    let before = measure_floor(WATCHED / 2, ThreadSettings::default(), &Watch::silent())?;
    let mut all = Vec::with_capacity(PASSES * TICKS);
    let mut least = vec![u32::MAX; TICKS];
    for _ in 0..PASSES {
        let times = pass(&preset)?;
        least.iter_mut().zip(&times).for_each(|(least, time)| *least = (*least).min(*time));
        all.extend(times);
    }
    let after = measure_floor(WATCHED / 2, ThreadSettings::default(), &Watch::silent())?;
    all.sort_unstable();
    let quantile = |part: f64| f64::from(all[((all.len() - 1) as f64 * part) as usize]) * 1e-3;
    let own_worst = f64::from(least.into_iter().max().unwrap_or(0)) * 1e-3;
    let floor = 1e6 * before.longest().max(after.longest());
    Ok(Ticks { median: quantile(0.5), p9999: quantile(0.9999), own_worst, worst: quantile(1.0), floor })
}

/// The time of each tick [ns], from the same start.
fn pass(preset: &Preset<f64>) -> Result<Vec<u32>, Box<dyn Error>> {
    let mut bench = VirtualBench::new(preset, 1)?;
    let law = stickslip::design::rendering_law(&preset.model, &preset.bench)?;
    bench.set_law(law)?;
    home(&mut bench, &Watch::silent())?;
    let (tap, mut stream) = tap(1 << 16);
    bench.tap(tap);
    let captures = thread::spawn(move || {
        let names: Vec<String> = channels().into_iter().map(|entry| entry.path).collect();
        let signals = (0..names.len()).collect();
        let plan = Plan { signals, decimation: 1, before: 2000, after: 2000, keep: Keep::Latest(1) };
        let trigger: Trigger = "setpoint.velocity rises through 0".parse().expect("a valid trigger");
        let mut rows = Stream::new(names.len());
        let capture = Capture::new(plan, &trigger, &names, 64 << 20).expect("enough memory");
        let handle = rows.add(capture).expect("the first capture");
        while !stream.is_closed() {
            while let Some(sample) = stream.sample() {
                let _ = rows.push(sample.frame.cycle, &Signals::of(&sample.frame).row());
            }
            thread::sleep(Duration::from_millis(1));
        }
        rows.remove(handle).map_or(0, |capture| capture.segments().len())
    });
    let reference = Reference::Sine(Default::default());
    let generator = Generator::new(reference, preset.bench.tick_rate).with_origin(0.0);
    let (result, receiver) = mpsc::channel();
    let ticking = Ticking { bench, generator, times: vec![u32::MAX; TICKS], done: 0, result };
    let overrun = OverrunPolicy { stop_after: None, ..OverrunPolicy::default() };
    let plan = stickslip_rt::Plan { warm_up: 0, overrun, ..stickslip_rt::Plan::new(PERIOD) };
    let (running, mut timings) = Running::start(plan, ThreadSettings::default(), MonotonicClock::default(), ticking)?;
    while !running.has_ended() {
        timings.by_ref().for_each(drop);
        thread::sleep(Duration::from_millis(20));
    }
    running.join();
    let times = receiver.recv()??;
    if captures.join().map_err(|_| "the capture thread has panicked")? == 0 {
        return Err("nothing was captured".into());
    }
    Ok(times)
}

/// A machine that counts its cycles.
struct Counted {
    machine: InProcess,
    cycle: Arc<AtomicU64>,
}

impl Io for Counted {
    fn exchange(&mut self, voltages: Voltages<f64>) -> Result<Measurement<f64>, LinkFault> {
        self.cycle.fetch_add(1, Ordering::Relaxed);
        self.machine.exchange(voltages)
    }

    fn waits(&self) -> bool {
        true
    }

    fn set_preload(&mut self, preload: f64) -> Result<(), stickslip::Error> {
        self.machine.set_preload(preload)
    }

    fn preload(&self) -> f64 {
        self.machine.preload()
    }
}

/// Cycles from a requested parameter change to the first cycle with it: median and 99th percentile of 1000 changes.
pub(crate) fn change() -> Result<[f64; 2], Box<dyn Error>> {
    let preset = preset(4000.0)?;
    let (machine, readings) = InProcess::new(&preset, 1)?;
    let cycle = Arc::new(AtomicU64::new(0));
    let machine = Counted { machine, cycle: cycle.clone() };
    let mut bench = ClockedBench::over(&preset, machine, readings, ThreadSettings::default(), None)?;
    let mut urgent = bench.urgent().ok_or("the urgent channel is in use")?;
    let parameters = *bench.parameters();
    let mut delays = Vec::new();
    for _ in 0..1000 {
        // Number of cycles that have run, which is the number of the current or next cycle.
        let now = cycle.load(Ordering::Relaxed);
        delays.push(urgent.change(Change::Parameters(parameters))?.saturating_sub(now));
        thread::sleep(Duration::from_micros(700));
    }
    bench.stop();
    delays.sort_unstable();
    Ok([delays[500] as f64, delays[990] as f64])
}

/// Load on the other cores, until it is dropped.
pub(crate) struct Load {
    stop: Arc<AtomicBool>,
    threads: Vec<thread::JoinHandle<()>>,
}

impl Load {
    pub(crate) fn new(threads: usize) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let work = |_| {
            let stop = stop.clone();
            thread::spawn(move || {
                let mut bytes = vec![0_u8; 8 << 20];
                while !stop.load(Ordering::Relaxed) {
                    // Loads the shared caches.
                    bytes.iter_mut().step_by(64).for_each(|byte| *byte = byte.wrapping_add(1));
                    std::hint::black_box(&bytes);
                }
            })
        };
        Load { threads: (0..threads).map(work).collect(), stop: stop.clone() }
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}
