//! Tests of the benchmark.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use stickslip_base::parameters::presets;
use stickslip_base::preset::{CompensationChoice, ControllerChoice, ControllerMatrices, StateFeedback};
use stickslip_base::{Error, Preset, Watch, parameters};
use stickslip_design::state_feedback;

fn preset() -> Preset<f64> {
    presets::find("prototype").unwrap().read().unwrap()
}

/// Controllers of files, so that nothing is tuned: the preset's, and the same with a compensation.
fn from_files(folder: &std::path::Path) -> Vec<Entrant> {
    let text = presets::find("prototype").unwrap().text;
    let compensations = ["nothing", "feedforward"];
    let of = |kind: &str| {
        let path = folder.join(format!("{kind}.toml"));
        let text = parameters::set::<Preset<f64>>(&text, "t", "bench.compensation.kind", kind).unwrap();
        std::fs::write(&path, text).unwrap();
        Entrant::find(path.to_str().unwrap()).unwrap()
    };
    compensations.map(of).to_vec()
}

fn plan(folder: &std::path::Path) -> Plan {
    Plan {
        frictions: vec![FRICTIONS[1]],
        variations: vec![VARIATIONS[1]],
        manoeuvres: vec![Manoeuvre::Reversal, Manoeuvre::FastSine],
        seeds: 2,
        ..Plan::new("prototype", preset(), from_files(folder))
    }
}

#[test]
fn measures_other_than_tracking_do_not_rank() {
    let folder = tempfile::tempdir().unwrap();
    let manoeuvres = vec![Manoeuvre::Strokes];
    let plan = Plan { variations: Vec::new(), manoeuvres, places: 2, ..plan(folder.path()) };
    let outcome = run_plan(&plan, folder.path(), &Watch::silent()).unwrap();
    let tables = outcome.tables();
    let [(caption, table)] = &tables[..] else { panic!("one table: {tables:?}") };
    let text = table.lines().join("\n");
    assert!(caption.contains("M_S 0.4500") && caption.contains("settling"), "{caption}");
    assert!(!text.contains("failed") && text.contains("strokes, settling"), "{text}");
    // A short stroke and a long one, in both directions.
    assert!(outcome.cells.iter().all(|cell| cell.values(Manoeuvre::Strokes, 2).iter().all(|largest| *largest > 1e-3)));
}

#[test]
fn compensation_with_an_exact_model_ranks_first_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(folder.path());
    let run = |threads, name: &str| {
        let plan = Plan { threads, ..plan.clone() };
        run_plan(&plan, &folder.path().join(name), &Watch::silent()).unwrap()
    };
    let outcome = run(1, "one");
    assert_eq!(outcome.cells, run(2, "two").cells);
    let ranks = rank(&outcome, "nominal");
    assert!(ranks[0].entrant.ends_with("feedforward.toml") && ranks[0].place == Some([1, 1]), "{ranks:?}");
    assert!(ranks[0].factor > 1.5 && ranks[0].ci95[0] > 1.0, "{ranks:?}");
    assert_eq!((ranks[1].factor, ranks[1].place), (1.0, Some([2, 2])));
    // A modelled friction that is too low compensates less.
    let peak = |k: usize| outcome.cells[k].values(Manoeuvre::Reversal, 0)[0];
    let [nominal, too_low] = [2, 3].map(peak);
    assert!(too_low > 1.2 * nominal, "{too_low} and {nominal}");
    // The report can be written.
    let summary = outcome.write(&folder.path().join("out"), "stickslip benchmark").unwrap();
    assert_eq!(summary.value("benchmark.failed_runs"), Some(0.0));
}

#[test]
fn external_matrices_are_judged_like_the_equal_controller() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(folder.path());
    let feedback = StateFeedback { torque_limit: preset().bench.controller.torque_limit(), ..StateFeedback::default() };
    let designed = state_feedback(&feedback, &preset().model, preset().bench.control_period()).unwrap();
    let matrices = ControllerMatrices {
        system: std::array::from_fn(|i| std::array::from_fn(|j| designed.system[j][i])),
        input: std::array::from_fn(|i| std::array::from_fn(|j| designed.input[j][i])),
        output: designed.output,
        direct: designed.direct,
        integral_gain: designed.integral_gain,
        sampling_time: designed.sampling_time,
        torque_limit: designed.torque_limit,
    };
    let of = |name: &str, controller: ControllerChoice<f64>| {
        let mut stated = preset();
        stated.bench.controller = controller;
        stated.bench.compensation = CompensationChoice::Feedforward(Default::default());
        let path = folder.path().join(name);
        std::fs::write(&path, parameters::write_commented(&stated)).unwrap();
        Entrant::find(path.to_str().unwrap()).unwrap()
    };
    // The true friction equals the model: the design does not depend on it and stays the same.
    let entrants =
        vec![of("a.toml", ControllerChoice::StateFeedback(feedback)), of("b.toml", ControllerChoice::Linear(matrices))];
    let plan = Plan { entrants, variations: Vec::new(), ..plan };
    let outcome = run_plan(&plan, &folder.path().join("cells"), &Watch::silent()).unwrap();
    assert_eq!(outcome.cells[0].failures(), 0);
    assert_eq!(outcome.cells[0].runs, outcome.cells[1].runs);
    // At another control rate the matrices are another controller.
    let mut other = plan;
    other.preset.bench.control_divider = 1.0;
    let refused = run_plan(&other, &folder.path().join("other"), &Watch::silent()).unwrap_err().to_string();
    assert!(refused.contains("sampling_time") && refused.contains("b.toml on prototype"), "{refused}");
}

#[test]
fn finished_cells_are_reused_unless_an_input_differs() {
    let folder = tempfile::tempdir().unwrap();
    let manoeuvres = vec![Manoeuvre::FastSine];
    let mut plan = Plan { variations: Vec::new(), manoeuvres, threads: 1, ..plan(folder.path()) };
    let cells = folder.path().join("cells");
    // Cancelled after the runs of the first entrant.
    let cancelled = Arc::new(AtomicBool::new(false));
    let stop = cancelled.clone();
    let watch = Watch::new(cancelled, move |stage, _| stop.store(stage.contains("nothing"), Ordering::Relaxed));
    let partial = run_plan(&plan, &cells, &watch).unwrap();
    assert!(!partial.complete && partial.cells.len() == 1);
    // A mark in the stored file shows that it is reused.
    let stored = std::fs::read_dir(&cells).unwrap().next().unwrap().unwrap().path();
    let mut marked = partial.cells[0].clone();
    marked.runs[0].1 = Some(vec![Some(42.0)]);
    std::fs::write(&stored, serde_json::to_string(&marked).unwrap()).unwrap();
    let whole = run_plan(&plan, &cells, &Watch::silent()).unwrap();
    assert!(whole.complete && whole.cells[0] == marked && whole.cells.len() == 2);
    // Another machine, or an invalid file: run again.
    plan.preset.plant.drive.load_inertia *= 1.01;
    assert_ne!(run_plan(&plan, &cells, &Watch::silent()).unwrap().cells[0].runs, marked.runs);
    std::fs::write(&stored, "{\"entrant\": ").unwrap();
    assert!(run_plan(&plan, &cells, &Watch::silent()).unwrap().complete);
}

#[test]
fn a_controller_that_does_not_follow_has_failed_and_no_number() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = Plan { variations: Vec::new(), manoeuvres: vec![Manoeuvre::FastSine], ..plan(folder.path()) };
    // This controller does not move the load at all.
    plan.preset.bench.safety.following_error = 1.0;
    let path = folder.path().join("lazy.toml");
    let text = presets::find("prototype").unwrap().text;
    let gains = ["position_gain", "velocity_gain", "integral_gain", "inertia"];
    let paths = gains.map(|gain| format!("bench.controller.{gain}"));
    let values: Vec<(&str, &str)> =
        paths.iter().zip(["0", "0", "0", "1e-9"]).map(|(path, value)| (path.as_str(), value)).collect();
    let text = parameters::set_all::<Preset<f64>>(&text, "t", &values).unwrap();
    std::fs::write(&path, text).unwrap();
    plan.entrants.push(Entrant::find(path.to_str().unwrap()).unwrap());
    let outcome = run_plan(&plan, &folder.path().join("cells"), &Watch::silent()).unwrap();
    let ranks = rank(&outcome, "nominal");
    assert!(ranks[2].entrant.ends_with("lazy.toml") && ranks[2].place.is_none() && ranks[2].failures == 2, "{ranks:?}");
    assert!(outcome.tables()[0].1.lines().iter().any(|line| line.contains("failed") && line.contains("lazy.toml")));
    assert!(outcome.remarks().iter().any(|remark| remark.contains("stopped by the supervision")));
}

#[test]
fn a_controller_has_known_parts_and_at_most_one_compensation() {
    for name in HOUSE {
        assert_eq!(Entrant::find(name).unwrap().name, name);
    }
    for name in ["fuzzy", "pid+magic", "pid+curve+feedforward", "+hold", "", "pid+"] {
        let error = Entrant::find(name).unwrap_err();
        assert!(matches!(&error, Error::NothingToCompare { what: "controller", .. }), "{name}: {error}");
    }
}

#[test]
fn frictions_scale_with_the_drive_and_the_model_follows() {
    let on = FRICTIONS[2].on(&preset());
    let torque = on.bench.controller.torque_limit();
    assert_eq!(on.model.own.breakaway_torque, 0.225 * torque);
    assert!(
        (stickslip_experiment::true_friction::own_friction(&on.plant, 10.0) - on.model.own.magnitude(10.0)).abs()
            < 1e-9
    );
    let off = VARIATIONS[1].of(&on);
    assert_eq!(off.model.own.kinetic_torque, 0.7 * on.model.own.kinetic_torque);
    assert_eq!(off.plant, on.plant);
}
