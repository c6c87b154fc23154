use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use super::*;
use crate::machine::Controller;
use stickslip_fit::LinearFit;
use stickslip_recording::Column;

const REFERENCE: &str = include_str!("../../../tests/reference/emps/numbers.csv");

pub(super) fn emps() -> &'static (Machine, Recording) {
    static EMPS: OnceLock<(Machine, Recording)> = OnceLock::new();
    EMPS.get_or_init(|| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/emps");
        let machine = Machine::read(&folder.join("emps-machine.toml")).unwrap();
        (machine, Recording::read(&folder.join("emps.csv.gz")).unwrap())
    })
}

/// The whole recording, identified once for all tests.
pub(super) fn found() -> &'static Identification {
    static FOUND: OnceLock<Identification> = OnceLock::new();
    FOUND.get_or_init(|| silent(&emps().1, &emps().0).unwrap())
}

/// Without progress.
fn silent(recording: &Recording, machine: &Machine) -> Result<Identification, Error> {
    identify(recording, machine, &Watch::silent())
}

/// The recording with other signals and the first `rows` rows.
fn changed(rows: usize, change: impl Fn(&str, f64) -> f64) -> Recording {
    let column = |c: &Column| Column::new(&c.name, c.values[..rows].iter().map(|v| change(&c.name, *v)).collect());
    Recording::from_columns("changed.csv", emps().1.columns().iter().map(column).collect())
}

/// Least squares alone, for the laws that hold exactly.
fn least_squares(recording: &Recording) -> (Vec<f64>, Vec<f64>) {
    let (symmetric, asymmetric) = plain(recording);
    (symmetric.coefficients, asymmetric.coefficients)
}

/// The published recipe: all rows, no delay.
fn plain(recording: &Recording) -> (LinearFit, LinearFit) {
    let machine = &emps().0;
    let motion = Motion::of(&machine.signals(recording).unwrap(), machine).unwrap();
    let range = machine.recipe.skip..motion.samples();
    let symmetric = Symmetric::identify(&motion, range.clone(), machine.recipe.decimation).unwrap();
    let asymmetric = Asymmetric::identify(&motion, range, machine.recipe.decimation).unwrap();
    (symmetric.fit, asymmetric.fit)
}

fn assert_close(ours: &[f64], theirs: &[f64], tolerance: f64) {
    assert_eq!(ours.len(), theirs.len());
    for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!((a - b).abs() <= tolerance * b.abs(), "{i}: {a} {b}");
    }
}

fn reference(name: &str) -> Vec<f64> {
    let line = REFERENCE.lines().find(|l| l.split(';').next() == Some(name)).expect(name);
    line.split(';').skip(1).map(|v| v.parse().unwrap()).collect()
}

fn published(table: &str, names: &[&str]) -> Vec<f64> {
    names.iter().map(|name| emps().0.published[table][*name][0]).collect()
}

#[test]
fn least_squares_are_those_of_numpy() {
    let (symmetric, asymmetric) = plain(&emps().1);
    for (name, fit) in [("symmetric", &symmetric), ("asymmetric", &asymmetric)] {
        let LinearFit { coefficients, standard_errors, white_standard_errors, condition, relative_error, .. } = fit;
        assert_close(coefficients, &reference(name), 1e-9);
        // A standard error is a root of a sum of cancelling products.
        assert_close(standard_errors, &reference(&format!("{name} standard errors")), 1e-7);
        assert_close(white_standard_errors, &reference(&format!("{name} white standard errors")), 1e-9);
        assert_close(&[*condition, *relative_error], &reference(&format!("{name} condition, relative error")), 1e-9);
    }
}

#[test]
fn published_values_lie_within_the_intervals_of_the_published_recipe() {
    let (symmetric, asymmetric) = plain(&emps().1);
    for (table, names, fit) in [("symmetric", &SYMMETRIC[..], &symmetric), ("asymmetric", &ASYMMETRIC[..], &asymmetric)]
    {
        for ((value, [low, high]), name) in published(table, names).iter().zip(&fit.ci95).zip(names) {
            assert!(low <= value && value <= high, "{table} {name}: {value} outside {low} … {high}");
        }
    }
    let mass = published("symmetric", &["mass"])[0];
    for candidate in &found().candidates {
        assert!((candidate.model.inertia / mass - 1.0).abs() < 5e-3, "{:?}", candidate.kind);
    }
}

#[test]
fn the_balance_away_from_reversals_finds_lag_and_screw_of_the_recorded_axis() {
    let found = found();
    let [low, high] = found.asymmetric.fit.ci95[0];
    // Published: 95.1 kg without the lag of the drive, from all rows.
    assert!((found.asymmetric.fit.coefficients[0] / 95.1 - 1.0).abs() < 1e-2 && high - low < 1.5, "{low} {high}");
    // Lag of the drive in the closed loop of the same recording: 0.3 ms.
    let delay = found.findings.delay;
    assert!(delay.is_significant && (2e-4..4e-4).contains(&delay.value), "{delay:?}");
    // The screw has a lead of 2.5 mm, which the search does not know.
    let periodic = found.findings.periodic.clone().expect("the screw is seen");
    // At the highest speed it is a force of 50 Hz, but no vibration of its own.
    assert_eq!(found.findings.resonance, None);
    assert!((periodic.period.0 - 2.5e-3).abs() < 5e-6 && (0.5..1.5).contains(&periodic.amplitude.0), "{periodic:?}");
}

#[test]
fn white_standard_errors_equal_the_published_ones_and_are_too_small() {
    let fit = &plain(&emps().1).0;
    let printed: Vec<f64> = SYMMETRIC.iter().map(|name| emps().0.published["symmetric"][*name][1]).collect();
    assert_close(&fit.white_standard_errors, &printed, 0.02);
    assert!(fit.standard_errors.iter().zip(&printed).all(|(ours, white)| ours > &(1.9 * white)));
}

#[test]
fn plateaus_are_those_of_the_data_sheet() {
    let expected = [(-50.59, 1.48), (-40.31, 1.16), (-31.74, 1.21), (27.91, 0.86), (34.35, 0.98), (40.72, 1.06)];
    // The data sheet has neither the delay nor the periodic force of the screw.
    let (machine, recording) = emps();
    let motion = Motion::of(&machine.signals(recording).unwrap(), machine).unwrap();
    let mass = plain(recording).1.coefficients[0];
    let curve = FrictionCurve::of(&motion, mass, machine.recipe.low_pass, machine.recipe.skip);
    assert_eq!(curve.plateaus.len(), expected.len());
    for (plateau, (force, deviation)) in curve.plateaus.iter().zip(expected) {
        // Where a plateau begins and ends is a choice: 0.05 N is a thirtieth of the deviation.
        assert!(
            (plateau.point.torque - force).abs() < 0.05 && (plateau.deviation - deviation).abs() < 0.05,
            "{plateau:?}"
        );
    }
}

#[test]
fn no_stribeck_drop_is_reported() {
    assert!(!found().stribeck_identifiable());
    for verdict in found().stribeck_verdicts() {
        assert!(verdict.starts_with("F_S < F_K: no Stribeck drop in this data"), "{verdict}");
    }
}

#[test]
fn the_closed_loop_is_predicted_and_each_richer_model_is_better_on_held_out_data() {
    let found = found();
    let kinds: Vec<Kind> = found.candidates.iter().map(|c| c.kind).collect();
    assert_eq!(kinds, [Kind::Symmetric, Kind::Asymmetric, Kind::Stribeck, Kind::Lugre]);
    // Voltage error, position rms [m]: data sheet of the recording, the last digit given.
    let expected = [(0.0457, 1.62e-6), (0.0372, 1.23e-6)];
    for (candidate, (voltage, position)) in found.candidates.iter().zip(expected) {
        let prediction = candidate.prediction.unwrap();
        assert!((prediction.voltage_error - voltage).abs() < 1e-4, "{prediction:?}");
        assert!((prediction.position_rms - position).abs() < 1e-8, "{prediction:?}");
    }
    assert!(found.candidates.windows(2).all(|pair| pair[1].held_out < pair[0].held_out));
    let best = found.best();
    let prediction = best.prediction.unwrap();
    // The next is behind by more than chance: its 95 % interval does not contain 0.
    let behind = found.behind(2).unwrap();
    assert!(behind.value > behind.half_width.unwrap(), "{behind}");
    assert_eq!((found.choice.folds, found.behind(3)), (8, None));
    assert_eq!(best.kind, Kind::Lugre);
    assert!(prediction.voltage_error < 0.025 && prediction.position_rms < 0.82e-6, "{prediction:?}");
    assert!(best.held_out < 0.0255, "{}", best.held_out);
    // Presliding is barely excited: the interval of the stiffness must be wide.
    let stiffness = best.refined.as_ref().unwrap().ci95[10];
    assert!(stiffness[1] / stiffness[0] > 2.0 && stiffness[0] < 9e5 && 9e5 < stiffness[1], "{stiffness:?}");
}

#[test]
fn more_voltage_is_more_mass_and_friction() {
    let (symmetric, asymmetric) = least_squares(&emps().1);
    let (a, b) = least_squares(&changed(emps().1.rows(), |name, v| if name == "vir" { 1.3 * v } else { v }));
    assert_close(&a, &symmetric.iter().map(|p| 1.3 * p).collect::<Vec<_>>(), 1e-9);
    assert_close(&b, &asymmetric.iter().map(|p| 1.3 * p).collect::<Vec<_>>(), 1e-9);
}

#[test]
fn a_mirrored_axis_swaps_the_directions_and_negates_the_offset() {
    let (s, a) = least_squares(&emps().1);
    let (symmetric, asymmetric) = least_squares(&changed(emps().1.rows(), |name, v| if name == "t" { v } else { -v }));
    assert_close(&symmetric, &[s[0], s[1], s[2], -s[3]], 1e-9);
    assert_close(&asymmetric, &[a[0], a[3], a[4], a[1], a[2]], 1e-9);
}

#[test]
fn published_values_are_not_used() {
    let (machine, _) = emps();
    let short = changed(7000, |_, v| v);
    let mut other = machine.clone();
    other.published.clear();
    other.published.insert("symmetric".into(), [("mass".to_owned(), vec![1e6])].into());
    assert_eq!(silent(&short, machine).unwrap(), silent(&short, &other).unwrap());
}

#[test]
fn without_a_controller_the_force_of_the_other_half_is_the_criterion() {
    let mut machine = emps().0.clone();
    machine.controller = Controller::Unknown;
    let found = silent(&emps().1, &machine).unwrap();
    assert_eq!(found.candidates.len(), 3);
    assert!(found.closed_loop.is_none() && found.candidates.iter().all(|c| c.prediction.is_none()));
    assert_eq!(found.best().kind, Kind::Periodic);
    assert!((0.015..0.03).contains(&found.best().held_out), "{}", found.best().held_out);
}

#[test]
fn a_simulated_model_is_identified() {
    let (machine, recording) = emps();
    let truth = found().candidates[2].model;
    let signals = machine.signals(recording).unwrap();
    let motion = Motion::of(&signals, machine).unwrap();
    let around = Loop::of(&signals, &motion, machine).unwrap();
    let reference = around.reference;
    let run = around.simulate(&truth, 2..8002, &Watch::silent()).unwrap();
    let columns = vec![
        Column::new("t", (0..8000).map(|i| f64::from(i) * 1e-3).collect()),
        // As the encoder reads it, grid 5e-8 m.
        Column::new("qm", run.position.iter().map(|q| (q / 5e-8).round() * 5e-8).collect()),
        Column::new("qg", reference[2..8002].to_vec()),
        Column::new("vir", run.command),
    ];
    let identified = silent(&Recording::from_columns("simulated", columns), machine).unwrap();
    let refined = identified.candidates[2].refined.as_ref().unwrap();
    let theirs = found().candidates[2].refined.as_ref().unwrap();
    // The error of the encoder's grid: its command noise of some mV, compared with a residual of 40 mV of the real
    // recording.
    assert_close(&refined.parameters, &theirs.parameters, 0.03);
    assert!((refined.parameters[0] / theirs.parameters[0] - 1.0).abs() < 1e-3);
    assert!(identified.candidates[2].held_out < 0.005, "{}", identified.candidates[2].held_out);
    // The simulation had no bristles: any gain of a model with bristles is chance.
    assert_eq!(identified.best().kind, Kind::Stribeck, "{:?}", identified.choice);
}

#[test]
fn a_reversed_gain_a_short_recording_and_an_axis_at_rest_are_refused() {
    let (machine, recording) = emps();
    let mut reversed = machine.clone();
    reversed.gain = -machine.gain;
    let error = silent(recording, &reversed).unwrap_err().to_string();
    assert!(error.contains("inertia is -9.4") && error.contains("drive.gain"), "{error}");
    let short = silent(&changed(600, |_, v| v), machine);
    assert!(matches!(short, Err(Error::TooFew { found: 600, needed: 700, .. })));
    let at_rest = changed(2000, |name, v| if name == "qm" { 0.1 } else { v });
    assert!(silent(&at_rest, machine).unwrap_err().to_string().contains("`qm` never changes"));
}

#[test]
fn the_fits_can_be_cancelled() {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    let watch = Watch::new(cancelled, move |stage, _| flag.store(stage.starts_with("fit"), Ordering::Relaxed));
    assert!(matches!(identify(&emps().1, &emps().0, &watch), Err(Error::Cancelled)));
}

#[test]
fn the_files_restore_the_result() {
    let (machine, _) = emps();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    std::fs::write(&path, model_toml(found(), machine)).unwrap();
    let best = &found().best().model;
    let read = read_model(&path).unwrap();
    assert_eq!((read.axis, read.machine.as_str(), &read.model), (Axis::Linear, "EMPS", best));
    let table = Recording::parse(Path::new("feedforward.csv"), feedforward_csv(found(), machine).as_bytes()).unwrap();
    let [velocity, force, command] = ["velocity", "force", "command"].map(|name| &table.column(name).unwrap().values);
    for i in 0..table.rows() {
        assert!((force[i] - best.steady_force(velocity[i])).abs() <= 1e-6 * force[i].abs());
        assert!((command[i] - force[i] / machine.gain).abs() <= 1e-6 * command[i].abs());
    }
    assert!(velocity.windows(2).all(|w| w[0] < w[1]) && velocity[0] < -0.12);
}

/// The machine without its controller: the balance of forces alone, which is quick.
fn open_loop() -> Machine {
    let mut machine = emps().0.clone();
    machine.controller = Controller::Unknown;
    machine
}

#[test]
fn a_known_inertia_is_kept_and_the_other_parameters_explain_the_rest() {
    let free = found().asymmetric.fit.clone();
    let mut machine = open_loop();
    machine.inertia = Some(free.coefficients[0]);
    let same = silent(&emps().1, &machine).unwrap().asymmetric.fit;
    assert_close(&same.coefficients, &free.coefficients, 1e-5);
    assert!((same.relative_error / free.relative_error - 1.0).abs() < 1e-3);
    assert_eq!((same.ci95[0], same.standard_errors[0]), ([free.coefficients[0]; 2], 0.0));
    machine.inertia = Some(80.0);
    let other = silent(&emps().1, &machine).unwrap();
    assert_eq!(other.asymmetric.fit.coefficients[0], 80.0);
    assert!(other.asymmetric.fit.relative_error > 1.5 * free.relative_error);
    assert_eq!(other.best().model.inertia, 80.0);
}

#[test]
fn a_known_inertia_is_not_moved_by_the_fit_in_the_closed_loop() {
    let mut machine = emps().0.clone();
    machine.inertia = Some(96.0);
    let refined = silent(&changed(7000, |_, v| v), &machine).unwrap().candidates[2].refined.clone().unwrap();
    assert_eq!((refined.parameters[0], refined.standard_errors[0]), (96.0, 0.0));
    assert!(refined.standard_errors[1..].iter().all(|s| s.is_finite() && *s > 0.0), "{refined:?}");
}

#[test]
fn the_weight_of_a_vertical_axis_is_not_friction() {
    // 40 N more in each sample: the weight of 4.08 kg.
    let gain = emps().0.gain;
    let rows = emps().1.rows();
    let lifted = changed(rows, |name, v| if name == "vir" { v + 40.0 / gain } else { v });
    let mut machine = open_loop();
    machine.vertical = true;
    machine.lifted_mass = Some(4.0);
    let found = silent(&lifted, &machine).unwrap();
    let level = silent(&emps().1, &open_loop()).unwrap();
    let offset = level.symmetric.fit.coefficients[3];
    assert!((found.symmetric.fit.coefficients[3] - (offset + 40.0)).abs() < 1e-3);
    let [weight, rest] = found.weight().unwrap();
    assert!((weight - 4.0 * 9.80665).abs() < 1e-12 && (weight + rest - (offset + 40.0)).abs() < 1e-3);
    // Both Coulomb levels equal those of the level axis without the offset.
    let (a, b) = (&found.asymmetric.fit.coefficients, &level.asymmetric.fit.coefficients);
    assert_close(a, &[b[0], b[1], b[2] - offset, b[3], b[4] + offset], 1e-4);
    assert!(found.limits().iter().any(|limit| limit.contains("weight of 39.2")), "{:?}", found.limits());
    // The model has weight and friction together.
    let model = found.best().model;
    assert!((model.offset - (offset + 40.0)).abs() < 1e-3);
    assert!((found.best().held_out - level.best().held_out).abs() < 0.02);
    machine.lifted_mass = None;
    assert!(silent(&lifted, &machine).unwrap().limits().iter().any(|limit| limit.contains("lifted_mass")));
}

#[test]
fn a_measured_velocity_takes_the_place_of_differences() {
    let position = &emps().1.column("qm").unwrap().values;
    let velocity = stickslip_base::filter::central_difference(position, 1e-3);
    let doubled: Vec<f64> = velocity.iter().map(|v| 2.0 * v).collect();
    let columns = |velocity| {
        let mut columns = emps().1.columns().to_vec();
        columns.push(Column::new("w", velocity).with_unit(Some("m/s".into())));
        Recording::from_columns("measured", columns)
    };
    let mut machine = open_loop();
    machine.columns.velocity = toml::from_str("name = \"w\"").ok();
    let motion = |velocity: Vec<f64>| {
        let signals = machine.signals(&columns(velocity)).unwrap();
        Motion::of(&signals, &machine).unwrap()
    };
    // Low-pass and difference change places, but not at the ends of the recording, where each is continued by itself.
    let (ours, fastest) = (motion(velocity.clone()), 0.13);
    for i in 200..ours.samples() - 200 {
        assert!((ours.velocity[i] - found().motion.velocity[i]).abs() < 1e-9 * fastest, "{i}");
    }
    let same = silent(&columns(velocity), &machine).unwrap().asymmetric.fit.coefficients;
    let half = silent(&columns(doubled), &machine).unwrap().asymmetric.fit.coefficients;
    // The rows differ: the noise of the position sets the speed that counts as rest.
    assert_close(&half[..2], &[0.5 * same[0], 0.5 * same[1]], 1e-2);
}

#[test]
fn the_model_file_is_a_preset_with_the_same_axis_on_its_screw() {
    let (machine, _) = emps();
    let text = model_toml(found(), machine);
    let preset: stickslip_base::Preset<f64> =
        stickslip_base::parameters::read(&text, "model.toml").unwrap_or_else(|problems| panic!("{problems}\n{text}"));
    let metres = 2.5e-3 / std::f64::consts::TAU;
    let best = &found().best().model;
    let drive = preset.plant.drive;
    assert!(((drive.motor_inertia + drive.load_inertia) / (best.inertia * metres * metres) - 1.0).abs() < 1e-12);
    for velocity in [-0.12, -0.09, 0.09, 0.12] {
        let screw: f64 = preset.model.own.torque(velocity / metres);
        let direction = preset.plant.screw_friction.direction;
        let viscous = preset.model.own.viscous_friction * velocity / metres;
        let sign = velocity.signum();
        let torque = (screw - viscous) * (1.0 + sign * direction.asymmetry)
            + viscous * (1.0 + sign * direction.viscous_asymmetry)
            + direction.offset;
        // Directions share one Stribeck velocity there; at eight times it, e⁻⁸ is left of the difference.
        assert!((torque / metres / best.steady_force(velocity) - 1.0).abs() < 2e-3, "{velocity}");
    }
    // A misspelt name next to the table is still reported.
    let wrong = text.replace("[identified]", "[identifed]");
    assert!(stickslip_base::parameters::read::<stickslip_base::Preset<f64>>(&wrong, "model.toml").is_err());
}

#[test]
fn an_invalid_model_file_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.toml");
    let good = model_toml(found(), &emps().0);
    for (from, to, expected) in [
        ("[identified", "[other", "missing table [identified]"),
        ("\ninertia = ", "\ninertia = -", "identified.inertia = -"),
        ("\nlag = ", "\nlag = -", "identified.lag = -"),
        ("\nstiffness = ", "\nstifness = ", "unknown field `stifness`"),
        ("\nviscous = ", "\nviscous = nan #", "NaN"),
    ] {
        assert!(good.contains(from), "{from}");
        std::fs::write(&path, good.replace(from, to)).unwrap();
        let error = read_model(&path).unwrap_err().to_string();
        assert!(error.contains("model.toml: ") && error.contains(expected), "{error}");
    }
}

fn identified() -> IdentifiedModel {
    IdentifiedModel { machine: "EMPS".into(), axis: Axis::Linear, model: found().best().model }
}

#[test]
fn on_its_own_recording_a_model_has_the_error_of_its_identification() {
    let (machine, recording) = emps();
    let again = validate(recording, &identified(), machine, &Watch::silent()).unwrap();
    assert_eq!(again.closed_loop.unwrap().1, found().best().prediction.unwrap());
    let open = validate(recording, &identified(), &open_loop(), &Watch::silent()).unwrap();
    assert!(open.closed_loop.is_none() && (0.01..0.04).contains(&open.torque_error), "{}", open.torque_error);
    assert!(open.summary().value("prediction.torque_error").is_some());
    let rotary = IdentifiedModel { axis: Axis::Rotary, ..identified() };
    let error = validate(recording, &rotary, machine, &Watch::silent()).unwrap_err().to_string();
    assert!(error.contains("the axis of the model is rotary"), "{error}");
    let short = validate(&recording.rows_of(0..300), &identified(), machine, &Watch::silent());
    assert!(matches!(short, Err(Error::TooFew { found: 300, needed: 350, .. })));
}

#[test]
fn a_known_injected_signal_is_part_of_the_prediction() {
    let (machine, recording) = emps();
    let mut signals = machine.signals(&recording.rows_of(0..6000)).unwrap();
    // Three sines of 0.5 V; the loop answers with forces of 50 N.
    let injected = |i: usize| -> f64 {
        [7.0, 19.0, 41.0].iter().map(|f| 0.5 * libm::sin(std::f64::consts::TAU * f * i as f64 * 1e-3)).sum()
    };
    signals.injected = Some((0..6000).map(injected).collect());
    let motion = Motion::of(&signals, machine).unwrap();
    let run = Loop::of(&signals, &motion, machine).unwrap();
    let run = run.simulate(&found().best().model, 2..6000, &Watch::silent()).unwrap();
    let cut = |values: &[f64]| values[2..6000].to_vec();
    let columns = vec![
        Column::new("t", (0..5998).map(|i| f64::from(i) * 1e-3).collect()),
        Column::new("qm", run.position),
        Column::new("qg", cut(signals.reference.as_ref().unwrap())),
        Column::new("vir", run.command),
        Column::new("w", cut(signals.injected.as_ref().unwrap())).with_unit(Some("V".into())),
    ];
    let simulated = Recording::from_columns("simulated", columns);
    let error = |machine: &Machine| {
        let found = validate(&simulated, &identified(), machine, &Watch::silent()).unwrap();
        found.closed_loop.unwrap().1
    };
    let mut with_signal = machine.clone();
    with_signal.columns.injected = toml::from_str("name = \"w\"").ok();
    let (with, without) = (error(&with_signal), error(machine));
    // Only the start differs: the state there is measured through a low-pass.
    assert!(with.voltage_error < 0.01, "{with:?}");
    assert!(without.voltage_error > 0.3 && without.position_rms > 20.0 * with.position_rms, "{without:?} {with:?}");
}
