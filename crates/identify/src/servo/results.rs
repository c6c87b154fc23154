//! The results by name, for scripts.

use std::path::Path;

use stickslip_core::fields::Field;

use super::{ServoIdentification, fields, values};
use crate::machine::Machine;
use stickslip_base::{Error, Summary};
use stickslip_recording::Recording;

/// Name of a parameter among the results: `motor.resistance`.
pub fn result_name(field: &Field) -> String {
    let group = match field.name {
        "torque_constant" | "resistance" | "source_resistance" | "delay" => "motor",
        "armature" => "inertia",
        "offset" => "pendulum",
        _ => "friction",
    };
    format!("{group}.{}", field.name)
}

/// Results, under the names that scripts rely on.
///
/// `inertia.*`, `motor.*`, `pendulum.*` and `friction.*` are the best model's; `prediction.position_rms` is its error
/// on the held-out runs. Each row is a model, with its published error where the machine file has one.
pub fn summary(found: &ServoIdentification) -> Summary {
    let mut summary = Summary::new("identify");
    let best = found.best();
    let named = fields().iter().zip(values(&best.fitted.servo)).zip(best.fitted.ci95);
    for ((field, value), ci95) in named.filter(|((field, _), _)| best.fitted.kind.has(field.name)) {
        let name = result_name(field);
        match ci95 {
            Some(ci95) => summary.with_interval(&name, value, ci95, field.unit),
            None => summary.result(&name, value, field.unit),
        };
    }
    summary.result("prediction.position_rms", best.held_out_rms, "rad");
    summary.result("prediction.fit_position_rms", best.fit_rms, "rad");
    for (name, slope) in ["controller.smallest_slope", "controller.largest_slope"].iter().zip(found.controller_slopes())
    {
        summary.result(name, slope, "1");
    }
    for (index, candidate) in found.candidates.iter().enumerate() {
        let kind = candidate.fitted.kind;
        summary.row([
            ("model", kind.name().into()),
            ("best", (index == found.best).into()),
            ("parameters", fields().iter().filter(|field| kind.has(field.name)).count().into()),
            ("fit_position_rms", candidate.fit_rms.into()),
            ("position_rms", candidate.held_out_rms.into()),
            ("published_position_rms", candidate.published.map(|(_, rms)| rms).into()),
        ]);
    }
    summary
}

/// Writes figures, `report.html` and `summary.json` into a folder. `command` is the command line that makes them again.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    found: &ServoIdentification,
    machine: &Machine,
    recording: &Recording,
    command: &str,
    directory: &Path,
) -> Result<Summary, Error> {
    let figures = found.figures();
    let named = figures.iter().map(|(name, figure, _)| (name.as_str(), figure));
    super::report(found, machine, recording, command).write_all(summary(found), named, directory)
}
