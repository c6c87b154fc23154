//! `cargo xtask study NAME`: what takes too long for the tests. The result is committed; a test checks that the
//! program still gives it.

use std::process::Command;

/// The studies. Each is an example of the laboratory.
const STUDIES: [&str; 9] =
    ["benchmark", "calibrated", "calibration", "coverage", "fidelity", "hunting", "margins", "prediction", "soak"];
/// Where their results lie, from the repository's root.
const FOLDER: &str = "docs/studies";

/// Runs a study, optimised as users run it.
pub(crate) fn study(name: &str) -> Result<(), String> {
    if !STUDIES.contains(&name) {
        return Err(format!("there is no study {name}; known: {}", STUDIES.join(", ")));
    }
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["run", "--quiet", "--release", "--package", "stickslip", "--example", name, "--", FOLDER]);
    cargo.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let status = cargo.status().map_err(|error| format!("cannot start cargo ({error})"))?;
    if status.success() { Ok(()) } else { Err(format!("the study {name} did not run to its end")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_study_is_refused_with_the_known_ones() {
        assert_eq!(
            study("coverige"),
            Err("there is no study coverige; known: benchmark, calibrated, calibration, coverage, fidelity, hunting, margins, prediction, soak".into())
        );
    }
}
