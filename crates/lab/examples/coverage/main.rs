//! How often do the 95 % intervals of a friction measurement contain the truth?
//!
//!     cargo xtask study coverage
//!
//! runs whole experiments on the virtual bench, each with its own seed, and writes `docs/studies/coverage.json` and
//! `coverage.md`: the same bytes on every machine.

mod study;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use stickslip::fit::PARAMETERS;
use stickslip::{Error, Summary, output};
use study::{Experiment, Tally, experiment};

/// Experiments that are kept in full, for the test that the result is still what the program gives.
const KEPT: usize = 8;

/// Case: name, preload, experiments, what it is.
const CASES: [(&str, f64, usize, &str); 2] = [
    (
        "released",
        0.0,
        1000,
        "Linings released: the friction is a Stribeck curve, nothing but noise and the motion's own sway is between it and the fit.",
    ),
    (
        "pressed",
        1.0,
        100,
        "Linings pressed on: the friction is the sum of two Stribeck curves, which no one curve of four parameters is. The fit says so by its lack of fit, and widens its intervals.",
    ),
];

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    output::create_folder(&folder)?;
    let mut summary = Summary::new("cargo xtask study coverage");
    let mut text = String::from(HEAD);
    for (name, preload, count, about) in CASES {
        let experiments = run(name, preload, count)?;
        let mut tally = Tally::default();
        experiments.iter().for_each(|experiment| tally.add(&experiment.truth, &experiment.fit));
        report(&mut summary, &mut text, name, about, &tally, &experiments);
    }
    write_files(&folder, &summary, &text)
}

const HEAD: &str = "\
# Do the intervals cover the truth?

Each experiment is the whole quick plan on the virtual bench `clm-bench`: homing, 30 plateaus, evaluation, fit, with a \
seed of its own. The truth is the least-squares Stribeck fit of the virtual machine's static own friction at the plan's \
speeds. Made by `cargo xtask study coverage`; the numbers are in `coverage.json`.
";

/// All experiments of a case on all cores, in the order of their seeds.
fn run(name: &str, preload: f64, count: usize) -> Result<Vec<Experiment>, Error> {
    let done = Mutex::new((0..count).map(|_| None).collect::<Vec<_>>());
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count {
                        return;
                    }
                    let result = experiment(preload, index as u64 + 1);
                    done.lock().expect("no thread panics with the lock")[index] = Some(result);
                    if (index + 1) % 20 == 0 {
                        eprintln!("{name}: {} of {count}", index + 1);
                    }
                }
            });
        }
    });
    let done = done.into_inner().expect("no thread panics with the lock");
    done.into_iter().map(|result| result.expect("every index was taken")).collect()
}

fn report(summary: &mut Summary, text: &mut String, name: &str, about: &str, tally: &Tally, all: &[Experiment]) {
    let _ = writeln!(text, "\n## {} experiments, {name}\n\n{about}\n", tally.count);
    let _ =
        writeln!(text, "| parameter | coverage of the 95 % intervals | mean error | scatter | stated standard error |");
    let _ = writeln!(text, "|-|-|-|-|-|");
    summary.result(&format!("{name}.experiments"), tally.count as f64, "1");
    for (i, (parameter, words, _)) in PARAMETERS.iter().enumerate() {
        let [mean, scatter, stated] = tally.errors(i).map(|error| 100.0 * error);
        let coverage = tally.coverage(i);
        let _ =
            writeln!(text, "| {words} | {:.1} % | {mean:.3} % | {scatter:.3} % | {stated:.3} % |", 100.0 * coverage);
        summary.result(&format!("{name}.{parameter}.coverage"), coverage, "1");
        summary.result(&format!("{name}.{parameter}.hits"), tally.hits[i] as f64, "1");
        for (what, error) in ["mean_error", "scatter", "stated"].iter().zip(tally.errors(i)) {
            summary.result(&format!("{name}.{parameter}.{what}"), error, "1");
        }
    }
    let lack = all.iter().map(|experiment| experiment.fit.lack_of_fit).sum::<f64>() / all.len() as f64;
    let _ = writeln!(text, "\nMean lack of fit: {:.1e} N·m.", lack);
    summary.result(&format!("{name}.lack_of_fit"), lack, "N m");
    for (index, experiment) in all.iter().take(KEPT).enumerate() {
        let cells = PARAMETERS.iter().zip(experiment.fit.parameters).map(|((name, _, _), value)| (*name, value.into()));
        summary.row([("case", name.into()), ("seed", (index + 1).into())].into_iter().chain(cells));
    }
}

fn write_files(folder: &Path, summary: &Summary, text: &str) -> Result<(), Error> {
    output::write(&folder.join("coverage.json"), summary.to_json())?;
    output::write(&folder.join("coverage.md"), text)
}
