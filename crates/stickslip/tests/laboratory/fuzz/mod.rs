//! Mutated files of every format: each is read or refused, with a short message, in bounded time and memory.
//!
//! The short form runs with the tests, from fixed seeds. The long form is a study:
//!
//!     cargo xtask study fuzz --minutes 120
//!
//! A mutant that fails is written to the folder for temporary files, and its name is in the message.

mod formats;
mod mutate;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use formats::{FORMATS, Format};
use mutate::{Random, mutant};

/// Longest message [bytes].
const MESSAGE: usize = 2000;
/// Longest time for one mutant on a busy computer; the seeds take milliseconds.
const TIME: Duration = Duration::from_secs(20);
/// Largest memory of the test program [kB]; it holds other tests too.
#[cfg(target_os = "linux")]
const MEMORY: u64 = 3_000_000;
/// Mutants of each format in the tests.
const SHORT: u64 = 1000;
/// Number of minutes of the long form, set by `cargo xtask study fuzz`.
const MINUTES: &str = "STICKSLIP_FUZZ_MINUTES";

/// Reads one mutant of a format.
fn try_one(format: &Format, seeds: &[Vec<u8>], number: u64, folder: &Path) -> Result<(), String> {
    let mut random = Random::new(number);
    let bytes = mutant(&mut random, seeds);
    let path = folder.join(format!("a.{}", format.extension));
    std::fs::write(&path, &bytes).unwrap();
    let begin = Instant::now();
    let result = catch_unwind(AssertUnwindSafe(|| (format.read)(&path, &bytes)));
    let fault = match result {
        Err(_) => "panics".to_owned(),
        Ok(Err(message)) if message.len() > MESSAGE => format!("has a message of {} bytes", message.len()),
        Ok(Err(message)) if message.is_empty() => "has an empty message".to_owned(),
        Ok(_) if begin.elapsed() > TIME => format!("takes {:?}", begin.elapsed()),
        Ok(_) => return Ok(()),
    };
    let kept = std::env::temp_dir().join(format!("stickslip-fuzz-{number}.{}", format.extension));
    std::fs::write(&kept, &bytes).unwrap();
    Err(format!("{}, mutant {number}: {fault}; it is {}", format.name, kept.display()))
}

/// Reads mutants of the named formats; all faults together.
fn try_all(names: &[&str], numbers: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let mut faults = Vec::new();
    for format in FORMATS.iter().filter(|format| names.contains(&format.name)) {
        let seeds = (format.seeds)(folder.path());
        for seed in &seeds {
            let path = folder.path().join(format!("seed.{}", format.extension));
            std::fs::write(&path, seed).unwrap();
            if let Err(message) = (format.read)(&path, seed) {
                faults.push(format!("{}: a seed is refused: {message}", format.name));
            }
        }
        faults.extend(numbers.clone().filter_map(|number| try_one(format, &seeds, number, folder.path()).err()));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    #[cfg(target_os = "linux")]
    {
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let peak =
            status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
        assert!(peak.is_some_and(|peak: u64| peak < MEMORY), "{peak:?} kB");
    }
}

#[test]
fn mutated_recordings_are_read_or_refused() {
    try_all(&["csv", "logger", "mat", "parquet", "mdf", "groups"], 0..SHORT);
}

#[test]
fn mutated_curves_and_machines_are_read_or_refused() {
    try_all(&["curve", "machine", "model", "uncertainty"], 0..SHORT);
}

#[test]
fn mutated_parameters_and_studies_are_read_or_refused() {
    try_all(&["preset", "study", "library"], 0..SHORT);
}

#[test]
fn mutated_messages_are_read_or_refused() {
    try_all(&["trigger", "call", "report"], 0..SHORT);
}

#[test]
fn every_format_is_tried() {
    let tried = [
        "csv",
        "logger",
        "mat",
        "parquet",
        "mdf",
        "groups",
        "curve",
        "machine",
        "model",
        "uncertainty",
        "preset",
        "study",
        "library",
        "trigger",
        "call",
        "report",
    ];
    assert_eq!(FORMATS.iter().map(|format| format.name).collect::<Vec<_>>(), tried);
}

/// The long form: new numbers until the time is over.
#[test]
#[ignore = "a study of minutes to hours"]
fn mutants_for_a_long_time() {
    let minutes: f64 = std::env::var(MINUTES).ok().and_then(|text| text.parse().ok()).unwrap_or(1.0);
    let end = Instant::now() + Duration::from_secs_f64(60.0 * minutes);
    let names: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
    let mut first = SHORT;
    while Instant::now() < end {
        try_all(&names, first..first + 100);
        first += 100;
        println!("{} mutants of each format", first - SHORT);
    }
}
