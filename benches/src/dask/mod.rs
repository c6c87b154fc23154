//! A study of a hundred thousand cases by a Dask cluster of two processes, against two threads of one.
//!
//! Takes a Python (`$PYTHON`, else `python3`) with the package and `distributed`.

use std::error::Error;
use std::process::Command;

/// What the studies of the users have at most.
const CASES: usize = 100_000;
/// Some minutes each.
const ROUNDS: usize = 1;

/// Seconds by the cluster and by the threads.
///
/// # Errors
/// Why it could not run.
pub(crate) fn run() -> Result<[f64; 2], Box<dyn Error>> {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/src/dask/study.py");
    let output = Command::new(python).arg(script).args([CASES.to_string(), ROUNDS.to_string()]).output()?;
    let text = String::from_utf8(output.stdout)?;
    let mut numbers = text.split_whitespace().map(str::parse);
    match (numbers.next(), numbers.next()) {
        (Some(threads), Some(cluster)) => Ok([cluster?, threads?]),
        _ => {
            let said = String::from_utf8_lossy(&output.stderr);
            Err(said.lines().last().unwrap_or("it says nothing").into())
        }
    }
}
