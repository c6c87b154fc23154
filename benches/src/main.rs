//! Ratios against named peers: `cargo xtask bench [NAME]`.
//!
//! One line per peer: name, our time, the peer's time, ratio = peer / ours (> 1: we are faster). Both run in turn, and
//! the best round of each counts. Compare ratios, not absolute times, between machines.
#![forbid(unsafe_code)]

mod controllers;
#[path = "../../crates/stickslip/examples/soak/crowd.rs"]
mod crowd;
mod dask;
mod demo;
#[cfg(unix)]
mod exchange;
mod fmu;
mod lanes;
mod tick;
mod w3;
mod w5;

use std::error::Error;
use std::time::Instant;

use stickslip::bench::{Bench, VirtualBench};
use stickslip::experiment::{FrictionPlan, home, measure_friction};
use stickslip::{Preset, Watch, parameters};

/// Rounds of each program, enough for one without disturbance.
const ROUNDS: usize = 15;
/// Rounds of the executive and of cyclictest; each takes some seconds.
const WAKE_UPS: usize = 21;

/// Comparisons with cyclictest at a rate: complete bench, executive alone sleeping, executive alone spinning.
const WAKE_UP: [&str; 6] = [
    "/cyclictest_p50",
    "/cyclictest_p99",
    "_alone/cyclictest_p50",
    "_alone/cyclictest_p99",
    "_spin/cyclictest_p50",
    "_spin/cyclictest_p99",
];

fn wake_up(rate: f64, name: &str) -> String {
    format!("w5_{:.0}k{name}", rate / 1000.0)
}

fn main() -> Result<(), Box<dyn Error>> {
    #[cfg(unix)]
    if exchange::run_as_peer()? {
        return Ok(());
    }
    let wanted = std::env::args().nth(1);
    let wanted = |name: &str| wanted.as_ref().is_none_or(|part| name.contains(part.as_str()));
    let demos = [("demo_1khz/real_time", 1000.0), ("demo_4khz/real_time", 4000.0), ("demo_10khz/real_time", 10_000.0)];
    let ticks = ["w3/c_libm", "w3/c_generated", "w3_generated/c_libm", "w3_generated/c_libm_checked"];
    let cycles = ["tick_10khz/5us", "tick_10khz/worst", "change_4khz/one_cycle"];
    let study_lanes = "study_lanes/scalar";
    let fmu_plant = "fmu_plant/native";
    let study_dask = "study_dask/threads";
    #[cfg(unix)]
    let exchanges = exchange::NAMES;
    #[cfg(not(unix))]
    let exchanges: [&str; 0] = [];
    let wake_ups: Vec<String> = w5::RATES.iter().flat_map(|rate| WAKE_UP.map(|name| wake_up(*rate, name))).collect();
    let wake_ups = wake_ups.iter().map(String::as_str);
    let names: Vec<_> = demos
        .iter()
        .map(|demo| demo.0)
        .chain(demo::NAMES)
        .chain(ticks)
        .chain(cycles)
        .chain([study_lanes, fmu_plant, study_dask])
        .chain(exchanges)
        .chain(controllers::NAMES)
        .chain(wake_ups)
        .collect();
    if !names.iter().any(|name| wanted(name)) {
        return Err(format!("unknown benchmark; choose one of: {}", names.join(", ")).into());
    }
    println!("name ours peer ratio");
    for (name, tick_rate) in demos.into_iter().filter(|demo| wanted(demo.0)) {
        let (ours, peer) = real_time(tick_rate)?;
        println!("{name} {ours:.4} {peer:.4} {:.1}", peer / ours);
    }
    if demo::NAMES.into_iter().any(&wanted) {
        // Nanoseconds of a processor per tick.
        let demo::Times { ours, recorded, peer, apart: [angle, velocity, drive, load] } = demo::run()?;
        let apart = format!("(apart: angle {angle:.0e}, velocity {velocity:.0e}, torques {drive:.0e}, {load:.0e})");
        for (name, ours) in demo::NAMES.into_iter().zip([ours, recorded]) {
            println!("{name} {ours:.0} {peer:.0} {:.2} {apart}", peer / ours);
        }
    }
    if ticks.into_iter().any(wanted) {
        // Nanoseconds per tick. Generated C checks its inputs; its peer here has the same guard.
        let w3::Times { ours, ours_guarded, generated, hand, hand_checked } = w3::run(ROUNDS)?;
        let pairs = [(ours, hand), (ours_guarded, generated), (generated, hand), (generated, hand_checked)];
        for (name, (ours, peer)) in ticks.into_iter().zip(pairs) {
            println!("{name} {ours:.2} {peer:.2} {:.2}", peer / ours);
        }
    }
    if cycles[..2].iter().any(|name| wanted(name)) {
        // Microseconds. The worst tick without disturbance against ten medians.
        let tick::Ticks { median, p9999, own_worst, worst, floor } = tick::ticks()?;
        println!("{} {median:.2} 5.00 {:.2}", cycles[0], 5.0 / median);
        let peer = 10.0 * median;
        println!(
            "{} {own_worst:.2} {peer:.2} {:.2} (with disturbances: p99.99 {p9999:.1}, worst {worst:.1}; longest disturbance {floor:.1})",
            cycles[1],
            peer / own_worst
        );
    }
    if wanted(cycles[2]) {
        // Cycles: 99th percentile and median of the changes.
        let [median, p99] = tick::change()?;
        println!("{} {p99} 1 {:.2} (median {median})", cycles[2], 1.0 / p99.max(1.0));
    }
    if wanted(study_lanes) {
        // Simulated seconds per second on one core; more is better.
        let (lanes, scalar) = lanes::run_both(ROUNDS)?;
        println!("{study_lanes} {lanes:.1} {scalar:.1} {:.2}", lanes / scalar);
    }
    if wanted(fmu_plant) {
        // Nanoseconds per tick.
        let [ours, peer] = fmu::run(ROUNDS)?;
        println!("{fmu_plant} {ours:.1} {peer:.1} {:.2}", peer / ours);
    }
    if wanted(study_dask) {
        // Seconds.
        match dask::run() {
            Ok([ours, peer]) => println!("{study_dask} {ours:.1} {peer:.1} {:.3}", peer / ours),
            Err(reason) => println!("{study_dask} skipped: {reason}"),
        }
    }
    #[cfg(unix)]
    if exchanges.into_iter().any(&wanted) {
        // Nanoseconds.
        for (name, [ours, peer]) in exchanges.into_iter().zip(exchange::run(ROUNDS)?) {
            println!("{name} {ours:.0} {peer:.0} {:.2}", peer / ours);
        }
    }
    if controllers::NAMES.into_iter().any(&wanted) {
        for (name, ours, limit) in controllers::run(ROUNDS)? {
            println!("{name} {ours:.1} {limit:.0} {:.2}", limit / ours);
        }
    }
    for rate in w5::RATES {
        if !WAKE_UP.iter().any(|name| wanted(&wake_up(rate, name))) {
            continue;
        }
        // Microseconds of lateness. Requires cyclictest and permission for a real-time priority.
        match w5::run(rate, WAKE_UPS) {
            Err(reason) => println!("{} skipped: {reason}", wake_up(rate, WAKE_UP[0])),
            Ok(pairs) => {
                for (name, w5::Pair { ours, peer, ratio: [ratio, low, high] }) in WAKE_UP.into_iter().zip(pairs) {
                    println!("{} {ours:.3} {peer:.3} {ratio:.2} ({low:.2} to {high:.2})", wake_up(rate, name));
                }
            }
        }
    }
    Ok(())
}

/// Seconds of a friction measurement, the longest part of the demonstration, on one core, and the duration of the same
/// measurement in real time [s].
fn real_time(tick_rate: f64) -> Result<(f64, f64), Box<dyn Error>> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    preset.bench.tick_rate = tick_rate;
    let plan = FrictionPlan { slowest: 2.0, speeds: 5.0, ..FrictionPlan::quick() };
    let (mut best, mut bench_time) = (f64::INFINITY, 0.0);
    for seed in 0..ROUNDS as u64 {
        let mut bench = VirtualBench::new(&preset, seed)?;
        home(&mut bench, &Watch::silent())?;
        let start = Instant::now();
        bench_time = measure_friction(&plan, &mut bench, true, &Watch::silent())?.duration;
        best = best.min(start.elapsed().as_secs_f64());
        // Use a result, so that the compiler removes nothing of the run.
        assert!(bench.zero().is_some());
    }
    Ok((best, bench_time))
}
