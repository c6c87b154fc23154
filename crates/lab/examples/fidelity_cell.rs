//! One cell of the trajectory-equivalence benchmark, as a table.
//!
//! `cargo run --release -p stickslip --example fidelity_cell -- [PRESET] [wheel|free] [RATE_HZ] [MISMATCH] [SEEDS] [FADE]`

use std::time::Instant;

use stickslip::fidelity::{Bed, Mismatch, Role, Runs, SCENARIOS, scores};
use stickslip::{Watch, design};
use stickslip_core::render::Law;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |k: usize, default: &str| arguments.get(k).cloned().unwrap_or_else(|| default.into());
    let mismatch = argument(3, "perfect");
    let mismatch = Mismatch::find(&mismatch).ok_or_else(|| format!("{mismatch} is no mismatch"))?;
    let seeds: Vec<u64> = (1..=argument(4, "3").parse()?).collect();
    let mut cell = Bed::find(&argument(0, "prototype"))?.cell(
        argument(1, "wheel") == "wheel",
        argument(2, "4000").parse()?,
        mismatch,
    );
    cell.preset.bench.fade_velocity = argument(5, "0.1").parse()?;
    let bench = &cell.preset;
    cell.law = Law::Paper(design::difference_torque(&bench.bench.desired, &bench.model, &bench.bench));

    let start = Instant::now();
    let run = |role| Runs::simulate(&cell, role, SCENARIOS, &seeds, 2, &Watch::silent());
    let (b, a, a0) = (run(Role::Rendered)?, run(Role::Desired)?, run(Role::Own)?);
    println!(
        "{:22} {:>10} {:>10} {:>10} {:>19} {:>10} {:>8}",
        "%", "difference", "excess", "floor", "ci95", "A", "mN m"
    );
    for score in scores(&b, &a, &a0) {
        let percent =
            |value: f64| format!("{:.2}", if score.measure.ends_with("count") { value } else { 100.0 * value });
        let [low, high] = score.ci95.map(percent);
        println!(
            "{:22} {:>10} {:>10} {:>10} {:>9} {:>9} {:>10.4} {:>8.2}{}",
            score.measure,
            percent(score.difference),
            percent(score.excess),
            percent(score.floor),
            low,
            high,
            score.reference,
            1e3 * score.chatter,
            if score.stable { "" } else { "  not stable" },
        );
    }
    eprintln!("{:.1} s", start.elapsed().as_secs_f64());
    Ok(())
}
