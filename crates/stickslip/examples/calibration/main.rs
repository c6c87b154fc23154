//! Coverage of the 95 % intervals of a calibration.
//!
//!     cargo xtask study calibration
//!
//! draws machines at random about their data sheet, calibrates each bench, and writes
//! `docs/studies/calibration.json` and `calibration.md`. `-- FOLDER PRESET FIRST LAST` runs some of them.

mod study;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use stickslip::{Error, Summary, output};
use study::{PRESETS, Score, experiment, scores};

const HEAD: &str = "\
# Coverage of calibration intervals

Each experiment draws a machine about its data sheet, whose values remain in the software: torque constants ± 5 %, \
masses, stiffness, friction, resistance and inductance ± 20 %, damping and lags ± 50 %, scales of tacho and \
accelerometer ± 2 %, offsets. Then the bench is calibrated. Steps of the virtual machine are 10 µs. Friction of \
`clm-bench` is a sum of two Stribeck curves, which is not a Stribeck curve: the true value of a fitted curve is the fit \
to the true friction at the same speeds under the same weights. Made by \
`cargo xtask study calibration`; all numbers are in `calibration.json`.
";

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    let one = arguments.next();
    let mut seed = |default| arguments.next().and_then(|text| text.parse().ok()).unwrap_or(default);
    let (first, last) = (seed(1), seed(u64::MAX));
    output::create_folder(&folder)?;
    let mut summary = Summary::new("cargo xtask study calibration");
    let mut text = String::from(HEAD);
    for (preset, machines) in PRESETS {
        if one.as_deref().is_none_or(|one| one == preset) {
            let scores = run(preset, first, if last == u64::MAX { machines } else { last })?;
            tabulate(&mut summary, &mut text, preset, &scores);
        }
    }
    output::write(&folder.join("calibration.json"), summary.to_json())?;
    output::write(&folder.join("calibration.md"), text)
}

/// All experiments on all cores, in the order of their seeds.
fn run(preset: &str, first: u64, last: u64) -> Result<Vec<(u64, Vec<Score>)>, Error> {
    let (next, done) = (AtomicU64::new(first), Mutex::new(BTreeMap::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed > last {
                        return;
                    }
                    let result = experiment(preset, seed).and_then(|(machine, found)| scores(&machine, &found));
                    eprintln!("{preset}: {seed} of {last}");
                    done.lock().expect("no thread panics with the lock").insert(seed, result);
                }
            });
        }
    });
    let done = done.into_inner().expect("no thread panics with the lock");
    done.into_iter().map(|(seed, result)| Ok((seed, result?))).collect()
}

fn tabulate(summary: &mut Summary, text: &mut String, preset: &str, experiments: &[(u64, Vec<Score>)]) {
    let count = experiments.len() as f64;
    let _ = writeln!(text, "\n## {count} machines about `{preset}`\n");
    text.push_str("| number | coverage of the 95 % intervals | rms error | half of the interval, rms |\n|-|-|-|-|\n");
    summary.result(&format!("{preset}.experiments"), count, "1");
    let keys: Vec<&str> = experiments.first().map_or_else(Vec::new, |(_, all)| all.iter().map(|s| s.key).collect());
    let (mut inside, mut total) = (0.0, 0.0);
    for key in keys {
        let scores = || experiments.iter().flat_map(|(_, all)| all.iter().filter(|score| score.key == key));
        let n = scores().count() as f64;
        let mean = |value: &dyn Fn(&Score) -> f64| scores().map(value).sum::<f64>() / n;
        let coverage = mean(&|score| f64::from(u8::from(score.error.abs() <= score.half)));
        // Relative to the true value: machines differ by more than their errors.
        let share = |value: f64, exact: f64| 100.0 * value / exact.abs();
        let rms = mean(&|score| share(score.error, score.truth).powi(2)).sqrt();
        let half = mean(&|score| share(score.half, score.truth).powi(2)).sqrt();
        (inside, total) = (inside + n * coverage, total + n);
        if key.ends_with("offset") {
            let _ = writeln!(text, "| `{key}` | {:.0} % | | |", 100.0 * coverage);
        } else {
            let _ = writeln!(text, "| `{key}` | {:.0} % | {rms:.2} % | {half:.2} % |", 100.0 * coverage);
        }
        summary.result(&format!("{preset}.{key}.coverage"), coverage, "1");
    }
    summary.result(&format!("{preset}.coverage"), inside / total, "1");
    let _ = writeln!(text, "\nOf all intervals {:.1} % contain the true value.", 100.0 * inside / total);
    for (seed, scores) in experiments {
        let values = scores.iter().map(|score| (score.key, score.value.into()));
        summary.row([("preset", preset.into()), ("seed", (*seed).into())].into_iter().chain(values));
    }
}
