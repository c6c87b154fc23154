use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use super::*;
use crate::fit::LinearFit;
use crate::machine::Controller;
use crate::recording::Column;

const REFERENCE: &str = include_str!("../../../../tests/reference/emps/numbers.csv");

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

/// Without anybody who watches.
fn silent(recording: &Recording, machine: &Machine) -> Result<Identification, Error> {
    identify(recording, machine, &Watch::silent())
}

/// The recording with other signals, and of it the first so many rows.
fn changed(rows: usize, change: impl Fn(&str, f64) -> f64) -> Recording {
    let column = |c: &Column| Column::new(&c.name, c.values[..rows].iter().map(|v| change(&c.name, *v)).collect());
    Recording::from_columns("changed.csv", emps().1.columns().iter().map(column).collect())
}

/// Least squares alone, for the laws that hold exactly.
fn least_squares(recording: &Recording) -> (Vec<f64>, Vec<f64>) {
    let machine = &emps().0;
    let motion = Motion::of(&machine.signals(recording).unwrap(), machine).unwrap();
    let range = machine.recipe.skip..motion.samples();
    let symmetric = Symmetric::identify(&motion, range.clone(), machine.recipe.decimation).unwrap();
    let asymmetric = Asymmetric::identify(&motion, range, machine.recipe.decimation).unwrap();
    (symmetric.fit.coefficients, asymmetric.fit.coefficients)
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
    for (name, fit) in [("symmetric", &found().symmetric.fit), ("asymmetric", &found().asymmetric.fit)] {
        let LinearFit { coefficients, standard_errors, white_standard_errors, condition, relative_error, .. } = fit;
        assert_close(coefficients, &reference(name), 1e-9);
        // A standard error is a root of a sum of cancelling products.
        assert_close(standard_errors, &reference(&format!("{name} standard errors")), 1e-7);
        assert_close(white_standard_errors, &reference(&format!("{name} white standard errors")), 1e-9);
        assert_close(&[*condition, *relative_error], &reference(&format!("{name} condition, relative error")), 1e-9);
    }
}

#[test]
fn published_values_lie_within_the_intervals() {
    for (table, names, fit) in [
        ("symmetric", &SYMMETRIC[..], &found().symmetric.fit),
        ("asymmetric", &ASYMMETRIC[..], &found().asymmetric.fit),
    ] {
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
fn white_standard_errors_are_those_that_were_published_and_too_small() {
    let fit = &found().symmetric.fit;
    let printed: Vec<f64> = SYMMETRIC.iter().map(|name| emps().0.published["symmetric"][*name][1]).collect();
    assert_close(&fit.white_standard_errors, &printed, 0.02);
    assert!(fit.standard_errors.iter().zip(&printed).all(|(ours, white)| ours > &(1.9 * white)));
}

#[test]
fn plateaus_are_those_of_the_data_sheet() {
    let expected = [(-50.59, 1.48), (-40.31, 1.16), (-31.74, 1.21), (27.91, 0.86), (34.35, 0.98), (40.72, 1.06)];
    assert_eq!(found().curve.plateaus.len(), expected.len());
    for (plateau, (force, deviation)) in found().curve.plateaus.iter().zip(expected) {
        // Where a plateau begins and ends is a choice: 0.05 N is a thirtieth of the deviation.
        assert!(
            (plateau.point.torque - force).abs() < 0.05 && (plateau.deviation - deviation).abs() < 0.05,
            "{plateau:?}"
        );
    }
}

#[test]
fn no_stribeck_drop_is_made_up() {
    assert!(!found().stribeck_identifiable());
    for verdict in found().stribeck_verdicts() {
        assert!(verdict.starts_with("F_S < F_K: no Stribeck drop in this data"), "{verdict}");
    }
}

#[test]
fn the_closed_loop_is_predicted_and_each_richer_model_does_better_on_what_it_has_not_seen() {
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
    assert_eq!(best.kind, Kind::Lugre);
    assert!(prediction.voltage_error < 0.025 && prediction.position_rms < 0.82e-6, "{prediction:?}");
    assert!(best.held_out < 0.0255, "{}", best.held_out);
    // Presliding is barely excited: the interval of the stiffness must admit it.
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
fn published_values_take_no_part() {
    let (machine, _) = emps();
    let short = changed(7000, |_, v| v);
    let mut other = machine.clone();
    other.published.clear();
    other.published.insert("symmetric".into(), [("mass".to_owned(), vec![1e6])].into());
    assert_eq!(silent(&short, machine).unwrap(), silent(&short, &other).unwrap());
}

#[test]
fn without_a_controller_the_force_of_the_second_half_is_the_judge() {
    let mut machine = emps().0.clone();
    machine.controller = Controller::Unknown;
    let found = silent(&emps().1, &machine).unwrap();
    assert_eq!(found.candidates.len(), 2);
    assert!(found.closed_loop.is_none() && found.candidates.iter().all(|c| c.prediction.is_none()));
    assert_eq!(found.best().kind, Kind::Asymmetric);
    assert!((0.02..0.04).contains(&found.best().held_out), "{}", found.best().held_out);
}

#[test]
fn a_recorded_model_is_found_again() {
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
    let again = silent(&Recording::from_columns("simulated", columns), machine).unwrap();
    let refined = again.candidates[2].refined.as_ref().unwrap();
    let theirs = found().candidates[2].refined.as_ref().unwrap();
    // What the encoder's grid leaves: its command noise of some mV against 40 mV of misfit in the real recording.
    assert_close(&refined.parameters, &theirs.parameters, 0.03);
    assert!((refined.parameters[0] / theirs.parameters[0] - 1.0).abs() < 1e-3);
    assert!(again.candidates[2].held_out < 0.005, "{}", again.candidates[2].held_out);
}

#[test]
fn a_reversed_gain_a_short_recording_and_an_axis_at_rest_are_refused() {
    let (machine, recording) = emps();
    let mut reversed = machine.clone();
    reversed.gain = -machine.gain;
    let error = silent(recording, &reversed).unwrap_err().to_string();
    assert!(error.contains("inertia is -9.5") && error.contains("drive.gain"), "{error}");
    let short = silent(&changed(600, |_, v| v), machine);
    assert!(matches!(short, Err(Error::TooFew { found: 600, needed: 700, .. })));
    let at_rest = changed(2000, |name, v| if name == "qm" { 0.1 } else { v });
    assert!(silent(&at_rest, machine).unwrap_err().to_string().contains("`qm` never changes"));
}

#[test]
fn a_cancellation_during_the_fits_is_heard() {
    let cancelled = Arc::new(AtomicBool::new(false));
    let flag = cancelled.clone();
    let watch = Watch::new(cancelled, move |stage, _| flag.store(stage.starts_with("fit"), Ordering::Relaxed));
    assert!(matches!(identify(&emps().1, &emps().0, &watch), Err(Error::Cancelled)));
}

#[test]
fn the_files_are_read_back_as_what_was_found() {
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
