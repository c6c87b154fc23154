//! The results by name, for scripts.

use std::path::Path;

use super::files::feedforward_csv;
use super::model_file::model_toml;
use super::report::report;
use super::{ASYMMETRIC, CLOSED_LOOP, Findings, Identification, PeriodicForce, SYMMETRIC, Weight};
use crate::machine::{Axis, Machine};
use stickslip_base::{Error, Summary, output};
use stickslip_recording::Recording;

/// Results of `stickslip identify`, under the names that scripts rely on.
///
/// `inertia.mass` and `friction.*` come from the least squares, `friction.offset` from its symmetric form;
/// `closed_loop.*` from the best model if it was fitted in the closed loop; `prediction.*` are errors of that model,
/// and `prediction.held_out_error` its error on halves that its fit did not use. A rotary axis has its inertia in kg m²
/// under the same name.
pub fn summary(found: &Identification) -> Summary {
    let mut summary = Summary::new("identify");
    let unit = |name: &str| unit(found.axis, name);
    let least_squares =
        [("asymmetric", &ASYMMETRIC[..], &found.asymmetric.fit), ("symmetric", &SYMMETRIC, &found.symmetric.fit)];
    for (table, names, fit) in least_squares {
        for ((name, value), ci95) in names.iter().zip(&fit.coefficients).zip(&fit.ci95) {
            let place = match (table, *name) {
                ("asymmetric", "mass") => "inertia.mass".to_owned(),
                ("asymmetric", name) => format!("friction.{}", name.replacen('_', ".", 1)),
                (_, "offset") => "friction.offset".to_owned(),
                (_, name) => format!("symmetric.{name}"),
            };
            // Motion in one direction gives no number for the other.
            if value.is_finite() {
                summary.with_interval(&place, *value, *ci95, unit(name));
            }
        }
        summary.result(&format!("{table}.force_error"), fit.relative_error, "1");
        summary.result(&format!("{table}.condition"), fit.condition, "1");
    }
    findings(found, &mut summary);
    if let Some([weight, rest]) = found.weight() {
        summary.result("offset.weight", weight, unit("offset"));
        summary.result("offset.rest", rest, unit("offset"));
    }
    summary.result("stribeck.identifiable", f64::from(u8::from(found.stribeck_identifiable())), "1");
    for (side, fit) in ["positive", "negative"].into_iter().zip(&found.stribeck) {
        let Some(fit) = fit.as_ref().filter(|f| f.drop.is_identified()) else { continue };
        for (index, name) in [(0, "breakaway"), (2, "stribeck_velocity")] {
            summary.with_interval(
                &format!("friction.{side}.{name}"),
                fit.parameters[index],
                fit.ci95[index],
                unit(name),
            );
        }
    }
    let best = found.best();
    if let Some(refined) = &best.refined {
        for ((name, value), ci95) in CLOSED_LOOP.iter().zip(&refined.parameters).zip(&refined.ci95) {
            summary.with_interval(&format!("closed_loop.{name}"), *value, *ci95, unit(name));
        }
    }
    match &best.prediction {
        Some(prediction) => {
            summary.result("prediction.voltage_error", prediction.voltage_error, "1");
            summary.result("prediction.position_rms", prediction.position_rms, unit("position"));
            summary.result("prediction.held_out_error", best.held_out, "1");
        }
        None => _ = summary.result("prediction.torque_error", best.held_out, "1"),
    }
    for (index, candidate) in found.candidates.iter().enumerate() {
        let prediction = candidate.prediction;
        let [behind, half_width] = found.choice.share_behind(index).unwrap_or_default();
        summary.row([
            ("model", candidate.kind.name().into()),
            ("best", (candidate.kind == best.kind).into()),
            ("held_out_error", candidate.held_out.into()),
            ("behind", behind.into()),
            ("behind_half_width", half_width.into()),
            ("voltage_error", prediction.map(|p| p.voltage_error).into()),
            ("position_rms", prediction.map(|p| p.position_rms).into()),
        ]);
    }
    for finding in &found.signals.findings {
        summary.note(finding.clone());
    }
    summary
}

/// The findings beside mass and friction.
fn findings(found: &Identification, summary: &mut Summary) {
    let Findings { delay, load, periodic, resonance, injected_in_command, .. } = &found.findings;
    if delay.is_determined {
        summary.with_interval("delay", delay.value, delay.ci95, "s");
        summary.result("delay.significant", f64::from(u8::from(delay.is_significant)), "1");
        if let Some((lag, ci95)) = delay.lag {
            summary.with_interval("delay.lag", lag, ci95, "s");
        }
    }
    if let Some(load) = load {
        summary.with_interval("friction.load_share", load.share, load.ci95, "1");
    }
    if let Some(Weight { amplitude, ci95 }) = found.findings.weight {
        summary.with_interval("weight.amplitude", amplitude, ci95, unit(found.axis, "offset"));
    }
    if let Some(PeriodicForce { period, amplitude }) = periodic {
        summary.with_interval("periodic.period", period.0, period.1, unit(found.axis, "position"));
        summary.with_interval("periodic.amplitude", amplitude.0, amplitude.1, unit(found.axis, "offset"));
    }
    for drift in &found.findings.drift {
        let name = ASYMMETRIC[drift.index];
        for (half, (value, ci95)) in drift.values.iter().zip(drift.halves).enumerate() {
            let place = format!("drift.{}.half_{}", name.replacen('_', ".", 1), half + 1);
            summary.with_interval(&place, *value, ci95, unit(found.axis, name));
        }
    }
    if let Some(resonance) = resonance {
        let ci95 = [-1.0, 1.0].map(|sign| resonance.frequency + sign * resonance.half_width);
        summary.with_interval("resonance.frequency", resonance.frequency, ci95, "Hz");
    }
    if *injected_in_command {
        summary.result("injected.in_command", 1.0, "1");
    }
}

/// Writes `model.toml`, `feedforward.csv`, figures, `report.json`, `report.html` and `summary.json` into a folder. `command` is the
/// command line that makes them again.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    found: &Identification,
    machine: &Machine,
    recording: &Recording,
    command: &str,
    directory: &Path,
) -> Result<Summary, Error> {
    output::create_folder(directory)?;
    let mut summary = summary(found);
    for (name, text) in
        [("model.toml", model_toml(found, machine)), ("feedforward.csv", feedforward_csv(found, machine))]
    {
        output::write(&directory.join(name), text)?;
        summary.file(name);
    }
    let figures = found.figures();
    let named = figures.iter().map(|(name, figure, _)| (*name, figure));
    report(found, machine, recording, &summary, command).write_all(summary, named, directory)
}

/// Unit of a parameter by the last part of its name.
pub(super) fn unit(axis: Axis, name: &str) -> &'static str {
    let name = name.rsplit(['.', '_']).next().unwrap_or(name);
    match (name, axis) {
        ("lag", _) => "s",
        ("mass", Axis::Linear) => "kg",
        ("mass", Axis::Rotary) => "kg m²",
        ("viscous" | "damping", Axis::Linear) => "N s/m",
        ("viscous" | "damping", Axis::Rotary) => "N m s/rad",
        ("velocity", Axis::Linear) => "m/s",
        ("velocity", Axis::Rotary) => "rad/s",
        ("position", Axis::Linear) => "m",
        ("position", Axis::Rotary) => "rad",
        ("stiffness", Axis::Linear) => "N/m",
        ("stiffness", Axis::Rotary) => "N m/rad",
        (_, Axis::Linear) => "N",
        (_, Axis::Rotary) => "N m",
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{emps, found};
    use super::*;

    #[test]
    fn the_documented_names_exist_with_their_units_and_the_files_are_reproducible() {
        let folder = tempfile::tempdir().unwrap();
        let summary = write(found(), &emps().0, &emps().1, "stickslip identify", folder.path()).unwrap();
        for name in [
            "inertia.mass",
            "friction.positive.coulomb",
            "friction.positive.viscous",
            "friction.negative.coulomb",
            "friction.negative.viscous",
            "friction.offset",
            "stribeck.identifiable",
            "prediction.voltage_error",
            "prediction.position_rms",
        ] {
            assert!(summary.value(name).is_some(), "{name}");
        }
        assert_eq!(summary.value("stribeck.identifiable"), Some(0.0));
        assert_eq!(summary.value("friction.negative.viscous"), Some(found().asymmetric.fit.coefficients[3]));
        assert_eq!(summary.value("friction.positive.breakaway"), None);
        let names = [
            "model.toml",
            "feedforward.csv",
            "figure-recording.svg",
            "figure-recorded-command.svg",
            "figure-friction.svg",
            "figure-prediction.svg",
            "figure-error.svg",
        ];
        let written: serde_json::Value = serde_json::from_str(&summary.to_json()).unwrap();
        assert_eq!(written["files"], serde_json::json!([&names[..], &["report.json", "report.html"]].concat()));
        let again = tempfile::tempdir().unwrap();
        write(found(), &emps().0, &emps().1, "stickslip identify", again.path()).unwrap();
        for name in names.into_iter().chain(["report.json", "report.html", "summary.json"]) {
            let [one, other] = [&folder, &again].map(|folder| std::fs::read(folder.path().join(name)).unwrap());
            assert!(!one.is_empty() && one == other, "{name}");
        }
        for (name, expected) in
            [("positive.stribeck_velocity", "rad/s"), ("bristle_damping", "N m s/rad"), ("positive.breakaway", "N m")]
        {
            assert_eq!(unit(Axis::Rotary, name), expected);
        }
    }
}
