//! Ratios against named peers: `cargo xtask bench [NAME]`.
//!
//! One line a peer: name, our time, the peer's time, ratio = peer / ours (> 1: we are faster). Ours and the peer run in
//! turn and the best round of each counts; absolute times mean nothing on another machine, ratios do.
#![forbid(unsafe_code)]

mod w3;
mod w5;

use std::error::Error;
use std::time::Instant;

use stickslip::bench::{Bench, VirtualBench};
use stickslip::experiment::{FrictionPlan, home, measure_friction};
use stickslip::{Preset, Watch, parameters};

/// Rounds of each contestant: enough that one of them meets a quiet machine.
const ROUNDS: usize = 15;
/// Turns of an executive and of cyclictest, seconds each.
const WAKE_UPS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let wanted = std::env::args().nth(1);
    let wanted = |name: &str| wanted.as_ref().is_none_or(|part| name.contains(part.as_str()));
    let demos = [("demo_1khz/real_time", 1000.0), ("demo_4khz/real_time", 4000.0), ("demo_10khz/real_time", 10_000.0)];
    let ticks = ["w3/c_libm", "w3/c_generated", "w3_generated/c_libm", "w3_generated/c_libm_checked"];
    let wake_ups =
        ["w5_4k/cyclictest_p50", "w5_4k/cyclictest_p99", "w5_4k_spin/cyclictest_p50", "w5_4k_spin/cyclictest_p99"];
    let names: Vec<_> = demos.iter().map(|demo| demo.0).chain(ticks).chain(wake_ups).collect();
    if !names.iter().any(|name| wanted(name)) {
        return Err(format!("no benchmark is called so. There are: {}", names.join(", ")).into());
    }
    println!("name ours peer ratio");
    for (name, tick_rate) in demos.into_iter().filter(|demo| wanted(demo.0)) {
        let (ours, peer) = real_time(tick_rate)?;
        println!("{name} {ours:.4} {peer:.4} {:.1}", peer / ours);
    }
    if ticks.into_iter().any(wanted) {
        // Nanoseconds a tick. Generated C is safe to call: its peer here is guarded as well.
        let w3::Times { ours, ours_guarded, generated, hand, hand_checked } = w3::run(ROUNDS)?;
        let pairs = [(ours, hand), (ours_guarded, generated), (generated, hand), (generated, hand_checked)];
        for (name, (ours, peer)) in ticks.into_iter().zip(pairs) {
            println!("{name} {ours:.2} {peer:.2} {:.2}", peer / ours);
        }
    }
    if wake_ups.into_iter().any(wanted) {
        // Microseconds of lateness. Only where there is such a peer, and a priority for both.
        match w5::run(WAKE_UPS) {
            Err(reason) => println!("w5_4k/cyclictest skipped: {reason}"),
            Ok(w5::Lateness { asleep, spinning, peer }) => {
                let pairs = asleep.into_iter().chain(spinning).zip([peer, peer].into_iter().flatten());
                for (name, (ours, peer)) in wake_ups.into_iter().zip(pairs) {
                    println!("{name} {ours:.3} {peer:.3} {:.2}", peer / ours);
                }
            }
        }
    }
    Ok(())
}

/// The demonstration's longest part, a friction measurement under the rendering law's tick, on one core, against the
/// time that the bench itself would take. Seconds each.
fn real_time(tick_rate: f64) -> Result<(f64, f64), Box<dyn Error>> {
    let mut preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    preset.bench.tick_rate = tick_rate;
    let plan = FrictionPlan { slowest: 2.0, speeds: 5.0, ..FrictionPlan::quick() };
    let (mut best, mut bench_time) = (f64::INFINITY, 0.0);
    for seed in 0..ROUNDS as u64 {
        let mut bench = VirtualBench::new(&preset, seed)?;
        home(&mut bench, &Watch::silent())?;
        let begin = Instant::now();
        bench_time = measure_friction(&plan, &mut bench, true, &Watch::silent())?.duration;
        best = best.min(begin.elapsed().as_secs_f64());
        // What the bench learnt is used, so that nothing of the run can be left out.
        assert!(bench.zero().is_some());
    }
    Ok((best, bench_time))
}
