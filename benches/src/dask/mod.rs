//! A study of a hundred thousand cases: a Dask cluster of two processes against two threads of one process.
//!
//! Requires Python (`$PYTHON`, default: `python3`) with the package and `distributed`.

use std::error::Error;
use std::process::Command;

/// Number of cases, typical of the largest studies.
const CASES: usize = 100_000;
/// Number of rounds; each takes some minutes.
const ROUNDS: usize = 1;

/// Seconds with the cluster and with the threads.
///
/// # Errors
/// If the script cannot run.
pub(crate) fn run() -> Result<[f64; 2], Box<dyn Error>> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/src/dask/study.py");
    let output = Command::new(python).arg(script).args([CASES.to_string(), ROUNDS.to_string()]).output()?;
    let text = String::from_utf8(output.stdout)?;
    let mut numbers = text.split_whitespace().map(str::parse);
    match (numbers.next(), numbers.next()) {
        (Some(threads), Some(cluster)) => Ok([cluster?, threads?]),
        _ => {
            let errors = String::from_utf8_lossy(&output.stderr);
            Err(errors.lines().last().unwrap_or("no error message").into())
        }
    }
}
