//! Accuracy of the virtual machine over its step, compared with other schemes.
//!
//!     cargo run -p stickslip --example integrator
//!
//! prints the tables of `docs/integrator.md`. Errors and creep are the same on every machine; the costs are ratios.

mod study;

use std::hint::black_box;
use std::time::Instant;

use stickslip::Error;
use stickslip::integrator::{DriveState, Scheme, prepare};
use stickslip_core::block::Block;
use stickslip_core::plant::{MachineInput, MachineState};
use study::{Case, clm_bench, creep, prototype};

const STEPS: [f64; 8] = [1e-6, 2.5e-6, 5e-6, 1e-5, 2.5e-5, 5e-5, 1e-4, 2.5e-4];

fn cell(error: Result<f64, Error>) -> String {
    match error {
        Ok(error) => format!("{error:.0e}"),
        Err(_) => "refused".into(),
    }
}

fn row(name: &str, error: impl Fn(f64) -> Result<f64, Error>) {
    println!("| {name} | {} |", STEPS.map(|dt| cell(error(dt))).join(" | "));
}

fn main() {
    println!("Error of the load angle over its range:\n");
    println!("| h [s] | {} |", STEPS.map(|dt| format!("{dt:e}")).join(" | "));
    println!("|---|{}", "---|".repeat(STEPS.len()));
    for stiffness in [300.0, 3000.0, 10_000.0] {
        let case = prototype(stiffness);
        row(&format!("σ₀ = {stiffness}: RK4"), |dt| case.baseline(Scheme::RungeKutta, dt));
        row("exponential", |dt| case.baseline(Scheme::Exponential, dt));
        row("**WBS**", |dt| case.well_balanced(dt));
    }
    row("`clm-bench`: **WBS**", |dt| clm_bench().well_balanced(dt));

    println!("\nIn ticks of 250 µs:\n");
    println!("| case | short steps | long steps in steady sliding |\n|---|---|---|");
    let cases = [300.0, 3000.0, 10_000.0].map(|stiffness| (format!("σ₀ = {stiffness}"), prototype(stiffness)));
    for (name, case) in cases.into_iter().chain([("`clm-bench`".into(), clm_bench())]) {
        let [short, long] = case.in_ticks().expect("25 µs is within the bound");
        println!("| {name} | {short:.1e} | {long:.1e} |");
    }

    println!("\nCreep of the load in rad:\n");
    println!("| load | time [s] | WBS, 25 µs | WBS, 250 µs | exponential, 25 µs |");
    println!("|---|---|---|---|---|");
    let (case, breakaway) = (prototype(3000.0), 0.45);
    for (name, mean, vibration, frequency, seconds) in [
        ("0.5 M_S", 0.5, 0.0, 0.0, 1000.0),
        ("0.9 M_S", 0.9, 0.0, 0.0, 1000.0),
        ("0.5 M_S + 0.05 M_S at 20 Hz", 0.5, 0.05, 20.0, 100.0),
        ("0.5 M_S + 0.1 M_S at 1 Hz", 0.5, 0.1, 1.0, 100.0),
        ("0.5 M_S + 0.2 M_S at 20 Hz", 0.5, 0.2, 20.0, 100.0),
    ] {
        let creep =
            |scheme, dt| cell(creep(&case, scheme, mean * breakaway, vibration * breakaway, frequency, seconds, dt));
        let cells = [creep(None, 25e-6), creep(None, 250e-6), creep(Some(Scheme::Exponential), 25e-6)];
        println!("| {name} | {seconds} | {} |", cells.join(" | "));
    }

    println!("\nCost of a step, best of ten rounds in turn, over that of RK4:\n");
    let [explicit, exponential, balanced] = costs(&case);
    println!("| RK4 | exponential | WBS (with load motor, three contacts and arm) |\n|---|---|---|");
    println!("| 1 | {:.1} | {:.1} |", exponential / explicit, balanced / explicit);
}

/// Seconds for the same number of steps of RK4, the exponential scheme and WBS, sliding.
fn costs(case: &Case) -> [f64; 3] {
    const COUNT: usize = 100_000;
    let drive = case.drive.expect("the case has one bristle");
    let machine = prepare(&case.plant, 1, 25e-6).expect("25 µs is within the bound");
    let mut best = [f64::INFINITY; 3];
    for _ in 0..10 {
        for (scheme, best) in [Scheme::RungeKutta, Scheme::Exponential].into_iter().zip(&mut best) {
            let mut x = DriveState::default();
            let start = Instant::now();
            for _ in 0..COUNT {
                x = black_box(drive.step(scheme, &x, [0.6; 3], 1e-6).expect("1 µs is within the bound"));
            }
            *best = best.min(start.elapsed().as_secs_f64());
        }
        let mut state = MachineState::default();
        let start = Instant::now();
        for _ in 0..COUNT {
            black_box(machine.step(&mut state, MachineInput { servo_voltage: 0.6, ..MachineInput::default() }, 25e-6));
        }
        best[2] = best[2].min(start.elapsed().as_secs_f64());
    }
    best
}
