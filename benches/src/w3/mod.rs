//! W3: one tick of the paper's load-motor control in this program, in generated C and in hand-written C.

mod block;

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use block::{PaperTick, PaperTickInput, PaperTickOutput, PaperTickState};
use stickslip_codegen::c;
use stickslip_core::block::{Block, guarded};
use stickslip_core::control::ControllerInput;
use stickslip_core::fields::Fields;

const DT: f64 = 250e-6;
const ROWS: usize = 4096;
/// Passes over the table per round, which takes some tens of milliseconds.
const PASSES: usize = 400;
/// Compiler flags of the peers, optimised for this machine.
const FLAGS: [&str; 4] = ["-std=c99", "-O3", "-march=native", "-Wall"];

/// Nanoseconds per tick in the best round of each program.
pub(crate) struct Times {
    /// This program.
    pub(crate) ours: f64,
    /// The same with the guard around the step, as in the generated C.
    pub(crate) ours_guarded: f64,
    /// Generated C, including the guard.
    pub(crate) generated: f64,
    /// Hand-written C, with the exponential of the C library.
    pub(crate) hand: f64,
    /// Hand-written C with the checks of the generated C.
    pub(crate) hand_checked: f64,
}

/// Runs all programs in turn, `rounds` times.
///
/// # Errors
/// Without gcc; if the results differ.
pub(crate) fn run(rounds: usize) -> Result<Times, Box<dyn Error>> {
    let mut tick = PaperTick::<f64>::default();
    tick.law.desired.kinetic_torque = 0.12;
    tick.law.desired.stribeck_velocity = 1.5;
    let table = inputs();
    let folder = std::env::temp_dir().join(format!("stickslip-w3-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let outcome = contest(&tick, &table, &folder, rounds);
    std::fs::remove_dir_all(&folder)?;
    outcome
}

fn contest(
    tick: &PaperTick<f64>,
    table: &[PaperTickInput<f64>],
    folder: &Path,
    rounds: usize,
) -> Result<Times, Box<dyn Error>> {
    let code = c::generate::<_, f64>(tick, "generated")?;
    for (name, text) in [
        ("generated.h", code.header.as_str()),
        ("generated.c", code.source.as_str()),
        ("hand.h", include_str!("hand.h")),
        ("hand.c", include_str!("hand.c")),
        ("drive.c", include_str!("drive.c")),
    ] {
        std::fs::write(folder.join(name), text)?;
    }
    let mut bytes = Vec::new();
    let mut put = |value: f64| {
        bytes.extend(value.to_ne_bytes());
        value
    };
    tick.map(&mut put);
    put(DT);
    table.iter().for_each(|row| {
        row.map(&mut put);
    });
    std::fs::write(folder.join("table"), &bytes)?;
    for (program, name, more) in
        [("generated", "generated", None), ("hand", "hand", None), ("hand_checked", "hand", Some("-DCHECKED"))]
    {
        let out = Command::new("gcc")
            .args(FLAGS)
            .args(more)
            .args([&format!("-DDRIVE(x)={name}_##x"), &format!("-DDRIVE_HEADER=\"{name}.h\""), "-o", program])
            .args(["drive.c", &format!("{name}.c"), "-lm"])
            .current_dir(folder)
            .output()
            .map_err(|error| format!("cannot start gcc ({error}). Install it: apt-get install gcc libc6-dev"))?;
        if !out.status.success() {
            return Err(String::from_utf8_lossy(&out.stderr).into());
        }
    }

    let never = f64::INFINITY;
    let mut times = Times { ours: never, ours_guarded: never, generated: never, hand: never, hand_checked: never };
    for _ in 0..rounds {
        let (ours, last) = here(tick, table, |tick, state, input| tick.step(state, *input, DT));
        let (ours_guarded, last_guarded) = here(tick, table, |tick, state, input| guarded(tick, state, *input, DT).0);
        let (generated, last_generated) = there(folder, "generated")?;
        let (hand, last_hand) = there(folder, "hand")?;
        let (hand_checked, last_checked) = there(folder, "hand_checked")?;
        if last_guarded != last || last_generated != [last.amplifier_voltage, last.torque] {
            return Err(format!("the bits differ: {last:?} in this program, {last_generated:?} in generated C").into());
        }
        let apart = |a: f64, b: f64| (a - b).abs() > 1e-9 * (1.0 + a.abs());
        if last_checked != last_hand || apart(last_hand[0], last.amplifier_voltage) || apart(last_hand[1], last.torque)
        {
            return Err(format!("hand-written C computes {last_hand:?} instead of {last:?}").into());
        }
        times.ours = times.ours.min(ours);
        times.ours_guarded = times.ours_guarded.min(ours_guarded);
        times.generated = times.generated.min(generated);
        times.hand = times.hand.min(hand);
        times.hand_checked = times.hand_checked.min(hand_checked);
    }
    Ok(times)
}

type State = PaperTickState<f64>;
type Output = PaperTickOutput<f64>;

/// Nanoseconds per tick and the last output, in this process.
fn here(
    tick: &PaperTick<f64>,
    table: &[PaperTickInput<f64>],
    step: impl Fn(&PaperTick<f64>, &mut State, &PaperTickInput<f64>) -> Output,
) -> (f64, Output) {
    let (mut state, mut last, mut sum) = (State::default(), Output::default(), 0.0);
    let start = Instant::now();
    for _ in 0..PASSES {
        for input in table {
            // As with the pointer in C, parameters may change at each tick.
            last = step(black_box(tick), &mut state, input);
            sum += last.amplifier_voltage;
        }
    }
    let nanoseconds = start.elapsed().as_secs_f64() * 1e9 / (PASSES * table.len()) as f64;
    black_box(sum);
    (nanoseconds, last)
}

/// Nanoseconds per tick and the last output of a compiled peer.
fn there(folder: &Path, name: &str) -> Result<(f64, [f64; 2]), Box<dyn Error>> {
    let out = Command::new(folder.join(name)).args(["table", &PASSES.to_string()]).current_dir(folder).output()?;
    let text = String::from_utf8(out.stdout)?;
    let numbers = text.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    let [time, voltage, torque, _, status] = numbers[..] else {
        return Err(format!("{name} failed: {:?}", out.status).into());
    };
    if status != 0.0 {
        return Err(format!("{name} rejects its inputs").into());
    }
    Ok((time, [voltage, torque]))
}

/// A periodic motion with ±12 rad/s, with the angle in encoder counts.
fn inputs() -> Vec<PaperTickInput<f64>> {
    let rate = std::f64::consts::TAU / (ROWS as f64 * DT);
    (0..ROWS)
        .map(|k| {
            let (sine, cosine) = (rate * k as f64 * DT).sin_cos();
            let angle = 12.0 / rate * sine;
            let count = std::f64::consts::TAU / 10_000.0;
            PaperTickInput {
                position: ControllerInput {
                    reference_position: angle + 0.002,
                    reference_velocity: 12.0 * cosine,
                    reference_acceleration: -12.0 * rate * sine,
                    measured_angle: (angle / count).floor() * count,
                    measured_velocity: 12.0 * cosine + 0.01 * (7.0 * k as f64).sin(),
                    ..ControllerInput::default()
                },
                acceleration: -12.0 * rate * sine / 1256.637 + 0.02,
                current: 0.5 * cosine,
            }
        })
        .collect()
}
