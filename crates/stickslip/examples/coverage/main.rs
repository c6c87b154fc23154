//! Coverage of the 95 % intervals of a friction measurement.
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
use study::{Experiment, experiment, hits, measure, redraw};

/// Experiments stored in full, for the test that the program still gives this result.
const KEPT: usize = 8;

/// Whole experiments: name, preload, number, description.
const CASES: [(&str, f64, usize, &str); 2] = [
    (
        "released",
        0.0,
        400,
        "Whole experiments, linings released: the friction is a Stribeck curve, disturbed by noise and by the sway of the \
         motion only. The stated errors of a plateau are a tenth larger than its scatter, so that intervals \
         contain the true value slightly too often.",
    ),
    (
        "pressed",
        1.0,
        40,
        "Whole experiments, linings pressed on: the friction is the sum of two Stribeck curves, which differs from every \
         curve of four parameters. The fit reports this as lack of fit, and widens its intervals.",
    ),
];

/// Seed of the first experiment; seeds from here on were not used in the development.
const FIRST_SEED: u64 = 1001;

/// Number of fits of redrawn points.
const REDRAWN: usize = 1000;

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    output::create_folder(&folder)?;
    let mut summary = Summary::new("cargo xtask study coverage");
    let mut text = String::from(HEAD);
    let (truth, curve) = measure(0.0, FIRST_SEED)?;
    let redrawn =
        (0..REDRAWN as u64).map(|index| redraw(truth, &curve, FIRST_SEED + index)).collect::<Result<Vec<_>, _>>()?;
    let about = "The fit alone: the points of one whole experiment, redrawn about the true curve with the stated errors \
     of the measurement.";
    report(&mut summary, &mut text, "redrawn", about, &redrawn);
    for (name, preload, count, about) in CASES {
        let experiments = run(name, preload, count)?;
        report(&mut summary, &mut text, name, about, &experiments);
    }
    write_files(&folder, &summary, &text)
}

const HEAD: &str = "\
# Coverage of friction intervals

A whole experiment is the quick plan on the virtual bench `clm-bench`: homing, 30 plateaus, evaluation, fit, with a \
separate seed. The true values are the least-squares Stribeck fit of the virtual machine's static own friction at the plan's \
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
                    let result = experiment(preload, FIRST_SEED + index as u64);
                    done.lock().expect("no thread panics with the lock")[index] = Some(result);
                    if (index + 1).is_multiple_of(20) {
                        eprintln!("{name}: {} of {count}", index + 1);
                    }
                }
            });
        }
    });
    let done = done.into_inner().expect("no thread panics with the lock");
    done.into_iter().map(|result| result.expect("every index was taken")).collect()
}

/// Mean error of a parameter, its standard deviation, and the mean standard error stated, relative to the true value.
fn errors(all: &[Experiment], parameter: usize) -> [f64; 3] {
    let mean = |value: &dyn Fn(&Experiment) -> f64| all.iter().map(value).sum::<f64>() / all.len() as f64;
    let error = |experiment: &Experiment| experiment.fit.parameters[parameter] / experiment.truth[parameter] - 1.0;
    let average = mean(&error);
    let variance = mean(&|experiment| (error(experiment) - average).powi(2));
    let stated = mean(&|experiment| experiment.fit.standard_errors[parameter] / experiment.truth[parameter]);
    [average, variance.sqrt(), stated]
}

fn report(summary: &mut Summary, text: &mut String, name: &str, about: &str, all: &[Experiment]) {
    let count = all.len();
    let _ = writeln!(text, "\n## {count} experiments, {name}\n\n{about}\n");
    let _ =
        writeln!(text, "| parameter | coverage of the 95 % intervals | mean error | scatter | stated standard error |");
    let _ = writeln!(text, "|-|-|-|-|-|");
    summary.result(&format!("{name}.experiments"), count as f64, "1");
    for (i, (parameter, words, _)) in PARAMETERS.iter().enumerate() {
        let hits = all.iter().filter(|experiment| hits(&experiment.truth, &experiment.fit)[i]).count() as f64;
        let coverage = hits / count as f64;
        let [mean, scatter, stated] = errors(all, i);
        let percent = [mean, scatter, stated].map(|error| format!("{:.3} %", 100.0 * error)).join(" | ");
        let _ = writeln!(text, "| {words} | {:.1} % | {percent} |", 100.0 * coverage);
        summary.result(&format!("{name}.{parameter}.coverage"), coverage, "1");
        for (key, error) in [("mean_error", mean), ("scatter", scatter), ("stated", stated)] {
            summary.result(&format!("{name}.{parameter}.{key}"), error, "1");
        }
    }
    let lack = all.iter().map(|experiment| experiment.fit.lack_of_fit).sum::<f64>() / all.len() as f64;
    let _ = writeln!(text, "\nMean lack of fit: {lack:.1e} N·m.");
    summary.result(&format!("{name}.lack_of_fit"), lack, "N m");
    for (index, experiment) in all.iter().take(KEPT).enumerate() {
        let cells = PARAMETERS.iter().zip(experiment.fit.parameters).map(|((name, _, _), value)| (*name, value.into()));
        summary.row([("case", name.into()), ("seed", (FIRST_SEED as usize + index).into())].into_iter().chain(cells));
    }
}

fn write_files(folder: &Path, summary: &Summary, text: &str) -> Result<(), Error> {
    output::write(&folder.join("coverage.json"), summary.to_json())?;
    output::write(&folder.join("coverage.md"), text)
}
