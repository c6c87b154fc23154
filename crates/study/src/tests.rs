//! Tests of studies: refused files, failed cases, interruptions without effect.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::cases::isolate_panics;
use super::*;
use stickslip_base::{Error, Watch};

/// A modelled friction with errors, quickly: a sine, one seed.
const MODEL: &str = r#"
manoeuvres = ["sine_2hz"]

[set]
bench.compensation.kind = "feedforward"

[[axis]]
name = "belief"
path = ["model.own.breakaway_torque", "model.own.kinetic_torque"]
factor = true
range = [0.4, 1.6]
points = 3

[[axis]]
path = "plant.drive.load_inertia"
values = [1.0e-3, 1.2e-3, 1.4e-3, 1.6e-3, 1.8e-3, 2.0e-3, 2.2e-3]
"#;

fn write(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("study.toml");
    std::fs::write(&path, text).unwrap();
    path
}

fn plan(text: &str) -> Plan {
    let folder = tempfile::tempdir().unwrap();
    Plan { threads: 2, ..read(&write(folder.path(), text)).unwrap() }
}

fn rows(outcome: &Outcome) -> Vec<Row> {
    let mut rows = Vec::new();
    outcome.each(|row| rows.push(row.clone())).unwrap();
    rows
}

/// The message of a refused file.
fn refused(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    read(&write(folder.path(), text)).unwrap_err().to_string()
}

#[test]
fn compensation_is_best_with_the_right_model() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run_study(&plan(MODEL), folder.path(), &Watch::silent()).unwrap();
    let rows = rows(&outcome);
    assert_eq!((rows.len(), rows[0].case, rows[20].case), (21, 1, 21));
    assert_eq!(rows[8].values, [1.0, 1.2e-3], "the last axis changes first");
    let deviation = |factor: f64| {
        let row = rows.iter().find(|row| row.values == [factor, 1.2e-3]).unwrap();
        row.measures[0].unwrap()
    };
    assert!(deviation(1.0) < 0.7 * deviation(0.4) && deviation(1.0) < 0.7 * deviation(1.6), "{rows:?}");
}

#[test]
fn the_file_does_not_depend_on_threads_and_interruptions() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| std::fs::read(folder.path().join(name).join("study.parquet")).unwrap();
    let run = |threads, name: &str, watch: &Watch| {
        run_study(&Plan { threads, ..plan(MODEL) }, &folder.path().join(name), watch)
    };
    assert_eq!(run(1, "one", &Watch::silent()).unwrap().reused, 0);
    run(3, "three", &Watch::silent()).unwrap();
    assert_eq!(bytes("one"), bytes("three"));
    // Ended behind the first part of eight, and again behind the second.
    for (finished, kept) in [(8, 0), (16, 8)] {
        let cancelled = Arc::new(AtomicBool::new(false));
        let stop = cancelled.clone();
        let total = f64::from(21 - kept);
        let enough = (f64::from(finished - kept) - 0.5) / total;
        let watch = Watch::new(cancelled, move |_, fraction| stop.store(fraction > enough, Ordering::Relaxed));
        assert!(matches!(run(1, "often", &watch), Err(Error::Cancelled)));
        assert!(!folder.path().join("often/study.parquet").exists());
    }
    let outcome = run(2, "often", &Watch::silent()).unwrap();
    assert_eq!((outcome.reused, outcome.cases), (16, 21));
    assert_eq!(bytes("often"), bytes("one"));
    assert!(!folder.path().join("often/parts").exists());
    // All rows exist: nothing is run again.
    assert_eq!(run(2, "often", &Watch::silent()).unwrap().reused, 21);
}

#[test]
fn parts_of_other_inputs_and_broken_parts_are_not_reused() {
    let folder = tempfile::tempdir().unwrap();
    let cancelled = Arc::new(AtomicBool::new(false));
    let stop = cancelled.clone();
    let watch = Watch::new(cancelled, move |_, fraction| stop.store(fraction > 0.5, Ordering::Relaxed));
    let two = Plan { threads: 1, ..plan(MODEL) };
    assert!(run_study(&two, folder.path(), &watch).is_err());
    let part = folder.path().join("parts/0000000.parquet");
    let whole = std::fs::read(&part).unwrap();
    // Another machine, other values, another seed.
    let mut others = vec![two.clone(); 3];
    others[0].preset.plant.drive.motor_inertia *= 1.01;
    others[1].axes[0].spread = Spread::Values(vec![0.4, 1.0, 1.7]);
    others[2].seeds = 2;
    for other in others {
        std::fs::write(&part, &whole).unwrap();
        assert_eq!(run_study(&other, folder.path(), &Watch::silent()).unwrap().reused, 0);
        std::fs::create_dir_all(folder.path().join("parts")).unwrap();
    }
    // Half of a part is invalid.
    std::fs::write(&part, &whole[..whole.len() / 2]).unwrap();
    assert_eq!(run_study(&two, folder.path(), &Watch::silent()).unwrap().reused, 0);
}

#[test]
fn a_failed_case_has_a_reason_and_the_others_go_on() {
    let text = MODEL.replace("values = [1.0e-3, 1.2e-3, 1.4e-3, 1.6e-3, 1.8e-3, 2.0e-3, 2.2e-3]", "values = [1.2e-3]");
    // A bench that admits no deviation, and a jitter that its ticks do not admit: the first stops, the second is
    // refused.
    let more = "[[axis]]\npath = \"bench.safety.following_error\"\nvalues = [1e-3, 2.0]\n\
                [[axis]]\npath = \"plant.tick_jitter\"\nvalues = [0.0, 40e-6]\n";
    let plan = Plan { threads: 2, ..plan(&format!("{}{more}", text.replace("points = 3", "points = 2"))) };
    let folder = tempfile::tempdir().unwrap();
    let outcome = run_study(&plan, folder.path(), &Watch::silent()).unwrap();
    let rows = rows(&outcome);
    assert_eq!(rows.len(), 8);
    for row in rows {
        let [_, _, following_error, jitter] = row.values[..] else { panic!("four axes") };
        let failure = row.failure.clone().unwrap_or_default();
        if jitter > 0.0 {
            assert!(
                failure.contains("plant.tick_jitter") && failure.contains(&format!("case {}", row.case)),
                "{failure}"
            );
        } else if following_error < 1.0 {
            assert_eq!(failure, "sine_2hz: the supervision stopped it, since it did not follow the set-point");
        } else {
            assert_eq!((failure.as_str(), row.measures[0].is_some()), ("", true));
            continue;
        }
        assert_eq!(row.measures, [None]);
    }
    let findings = outcome.findings().unwrap();
    assert_eq!(findings.summary().value("study.failed_cases"), Some(6.0));
    let failures = outcome.failures().unwrap();
    assert_eq!(failures.len(), 6);
    let columns = outcome.columns().unwrap();
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "case",
            "belief",
            "plant.drive.load_inertia",
            "bench.safety.following_error",
            "plant.tick_jitter",
            "sine_2hz_rms",
            "plant_step",
            "step_error"
        ]
    );
    assert_eq!((columns[2].unit.as_str(), columns[5].unit.as_str()), ("kg m^2", "rad"));
    for (case, value) in columns[0].values.iter().zip(&columns[5].values) {
        assert_eq!(value.is_nan(), failures.iter().any(|(failed, _)| *failed as f64 == *case), "case {case}");
    }
}

#[test]
fn wrong_names_and_values_are_refused_with_their_line_before_anything_runs() {
    let message = refused("manoevres = [\"creep\"]\n[[axis]]\nvalue = [1]\n[design]\nsample = 3\n");
    assert!(
        message.contains("unknown parameter manoevres") && message.contains("study.toml:1). Did you mean manoeuvres?")
    );
    assert!(message.contains("study.toml:3). Did you mean axis.values?"), "{message}");
    assert!(message.contains("study.toml:5). Did you mean design.samples?"), "{message}");
    let axis = |axis: &str| refused(&format!("manoeuvres = [\"creep\"]\n\n[[axis]]\n{axis}\n"));
    for (text, expected) in [
        (
            "path = \"plant.drive.load_inertai\"\nvalues = [1e-3]",
            "study.toml:3). Did you mean plant.drive.load_inertia?",
        ),
        ("path = \"plant.drive.load_inertia\"\nvalues = [1e-3, 5.0]", "plant.drive.load_inertia = 5 kg m^2 is outside"),
        ("path = \"plant.drive.load_inertia\"\nfactor = true\nvalues = [-1.0]", "It is a magnitude"),
        ("path = \"bench.control_divider\"\nvalues = [1.5]", "is not a whole number"),
        ("path = \"bench.controller\"\nvalues = [1.0]", "the path of a single number"),
        ("path = \"bench.compensation.kind\"\nvalues = [1.0]", "the path of a single number"),
        (
            "path = [\"plant.drive.load_inertia\", \"plant.drive.coupling_stiffness\"]\nvalues = [0.5]",
            "different units",
        ),
        ("path = \"plant.tick_jitter\"\nfactor = true\nvalues = [2]", "a factor has no effect"),
        ("path = []\nvalues = [1.0]", "missing path"),
        ("path = \"plant.drive.load_inertia\"", "incompletely or twice"),
        ("path = \"plant.drive.load_inertia\"\nvalues = []", "no value"),
        ("path = \"plant.drive.load_inertia\"\nrange = [2e-3, 1e-3]\npoints = 3", "invalid range"),
        (
            "path = \"plant.drive.load_inertia\"\nrange = [1e-3, 2e-3]\npoints = 1_000_000_000_000",
            "more than a million points",
        ),
        (
            "path = \"plant.drive.load_inertia\"\nrange = [1e-3, 2e-3]\npoints = 100_000\n[[axis]]\nname = \"b\"\npath = \"plant.drive.motor_inertia\"\nrange = [1e-3, 2e-3]\npoints = 100_000",
            "the number of cases",
        ),
        ("path = \"plant.drive.load_inertia\"\nrange = [1e-3, 2e-3]", "a grid requires a list of values"),
        ("name = \"case\"\npath = \"plant.drive.load_inertia\"\nvalues = [1e-3]", "duplicate column case"),
        ("path = \"plant.drive.load_inertia\"\nvalues = [\"1\"]", "study.toml:"),
        (
            "path = \"plant.drive.load_inertia\"\nvalues = [1e-3]\n[[axis]]\nname = \"b\"\npath = \"plant.drive.load_inertia\"\nvalues = [1e-3]",
            "it sets the same parameter as axis plant.drive.load_inertia",
        ),
    ] {
        let message = axis(text);
        assert!(message.contains(expected), "{text}\n{message}");
    }
    let sampled = |keys: &str, design: &str| {
        let axis = "[[axis]]\npath = \"plant.drive.load_inertia\"\nrange = [1e-3, 2e-3]\n";
        refused(&format!("manoeuvres = [\"creep\"]\n{keys}\n[design]\n{design}\n{axis}"))
    };
    let long = sampled("", "kind = \"latin-hypercube\"\nsamples = 1_000_000_000");
    assert!(long.contains("1000000000 cases of 10.3 s") && long.contains("the limit is 1e9 s"), "{long}");
    let long = sampled("seeds = 1000", "kind = \"sobol\"\nsamples = 1_000_000");
    assert!(long.contains("the limit is 1e9 s. Use fewer samples"), "{long}");
    let many = format!("manoeuvres = [\"creep\"]\n{}", "[[axis]]\npath = \"a\"\n".repeat(20_000));
    assert!(refused(&many).contains("20000 tables [[axis]]; the limit is 200"), "{}", refused(&many));
    assert!(refused("manoeuvres = []\n").contains("each manoeuvre once"));
    assert!(refused("manoeuvres = [\"creep\"]\n").contains("there is no axis"));
    assert!(refused("manoeuvres = [\"crawl\"]\n").contains("unknown manoeuvre crawl"));
    assert!(refused("manoeuvres = [\"creep\"]\nseeds = 0\n").contains("seeds = 0"));
    assert!(refused("manoeuvres = [\"creep\"\n").contains("study.toml:"));
    let controller = "manoeuvres = [\"creep\"]\ncontroller = \"pid\"\n[set]\nbench.controller.position_gain = 3\n";
    assert!(refused(controller).contains("which the controller sets too"));
}

/// Three axes, quickly.
fn sampled(design: &str) -> Plan {
    let axes = "\n[[axis]]\nname = \"belief\"\npath = [\"model.own.breakaway_torque\", \"model.own.kinetic_torque\"]\n\
                factor = true\nrange = [0.4, 1.6]\n\
                [[axis]]\nname = \"inertia\"\npath = [\"plant.drive.load_inertia\", \"model.drive.load_inertia\"]\n\
                range = [0.8e-3, 1.6e-3]\nlogarithmic = true\n";
    plan(&format!(
        "manoeuvres = [\"sine_2hz\"]\n[set]\nbench.compensation.kind = \"feedforward\"\n[design]\n{design}{axes}"
    ))
}

#[test]
fn screening_and_indices_rank_the_modelled_friction_above_the_known_inertia() {
    for (design, kind, cases) in [
        ("kind = \"morris\"\ntrajectories = 6", "effects", 18.0),
        ("kind = \"saltelli\"\nsamples = 8", "indices", 32.0),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let outcome = run_study(&sampled(design), folder.path(), &Watch::silent()).unwrap();
        let summary = outcome.findings().unwrap().write(folder.path(), "stickslip study").unwrap();
        assert_eq!(summary.value("study.cases"), Some(cases));
        let json: serde_json::Value = serde_json::from_str(&summary.to_json()).unwrap();
        let of = |axis: &str| {
            let row = json["rows"].as_array().unwrap().iter().find(|row| row["kind"] == kind && row["axis"] == axis);
            let row = row.unwrap_or_else(|| panic!("{json}"));
            row["magnitude"].as_f64().or_else(|| row["total"].as_f64()).unwrap()
        };
        assert!(of("belief") > 2.0 * of("inertia"), "{design}: {} {}", of("belief"), of("inertia"));
        let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        assert!(page.contains("Sensitivities") && page.contains("2 Hz, RMS over belief"), "{design}");
    }
}

#[test]
fn samples_are_within_their_ranges_and_have_their_kind_of_picture() {
    for design in ["kind = \"latin-hypercube\"\nsamples = 12", "kind = \"sobol\"\nsamples = 12"] {
        let plan = sampled(design);
        for case in 0..12 {
            let values = plan.values(case);
            assert!((0.4..=1.6).contains(&values[0]) && (0.8e-3..=1.6e-3).contains(&values[1]), "{values:?}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let outcome = run_study(&plan(MODEL), folder.path(), &Watch::silent()).unwrap();
    let findings = outcome.findings().unwrap();
    let elsewhere = folder.path().join("else/where");
    findings.write(&elsewhere, "stickslip study").unwrap();
    let page = std::fs::read_to_string(elsewhere.join("report.html")).unwrap();
    assert!(page.contains("2 Hz, RMS over plant.drive.load_inertia and belief"), "a map of two axes");
    assert_eq!(page.matches("fill-opacity").count(), 21, "a cell a case");
    assert!(findings.sentences().contains("21 cases on prototype."), "{}", findings.sentences());
    // A folder with a report has the rows of that report.
    assert_eq!(std::fs::read(elsewhere.join("study.parquet")).unwrap(), std::fs::read(&outcome.file).unwrap());
}

#[test]
fn normal_axes_are_about_their_means_and_correlated() {
    let text = "manoeuvres = [\"creep\"]\n[design]\nkind = \"normal\"\nsamples = 2000\ncorrelation = [[1, 0.8], [0.8, 1]]\n\
                [[axis]]\npath = \"model.own.breakaway_torque\"\nmean = 0.4\nsd = 0.02\n\
                [[axis]]\npath = \"model.own.kinetic_torque\"\nmean = 0.3\nsd = 0.01\n";
    let plan = plan(text);
    let all: Vec<Vec<f64>> = (0..2000).map(|case| plan.values(case)).collect();
    let mean = |of: &dyn Fn(&Vec<f64>) -> f64| all.iter().map(of).sum::<f64>() / 2000.0;
    let product = mean(&|values| (values[0] - 0.4) / 0.02 * (values[1] - 0.3) / 0.01);
    // Standard errors of 1/√2000 = 0.022 standard deviations; four of them.
    assert!((mean(&|values| values[0]) - 0.4).abs() < 0.09 * 0.02 && (product - 0.8).abs() < 0.12, "{product}");
    for (change, expected) in [
        (("0.8, 1", "0.7, 1"), "invalid correlation"),
        (("[[1, 0.8], [0.8, 1]]", "[[1, 2], [2, 1]]"), "invalid correlation"),
        (("[[1, 0.8], [0.8, 1]]", "[[1]]"), "correlation is not 2 × 2"),
        (("samples = 2000\n", ""), "missing samples"),
        (("samples = 2000", "samples = 2000\nlevels = 4"), "the design has no levels"),
        (("mean = 0.4\nsd = 0.02", "range = [0.1, 0.4]"), "a normal sample requires means"),
        (("sd = 0.02", "sd = -0.02"), "invalid sd"),
        (("kind = \"normal\"", "kind = \"normals\""), "study.toml:"),
    ] {
        let message = refused(&text.replace(change.0, change.1));
        assert!(message.contains(expected), "{change:?}\n{message}");
    }
    let morris = |design: &str| {
        refused(&format!(
            "manoeuvres = [\"creep\"]\n[design]\nkind = \"morris\"\n{design}\n[[axis]]\npath = \"plant.tick_jitter\"\nrange = [0, 1e-5]\n"
        ))
    };
    assert!(morris("trajectories = 4\nlevels = 3").contains("levels = 3 is odd"));
    assert!(morris("trajectories = 1").contains("at least 2 required"));
}

#[test]
fn the_hold_of_an_entrant_uses_the_model_of_its_case_and_its_parameters_can_be_changed() {
    let text = "manoeuvres = [\"sine_2hz\"]\ncontroller = \"pid+hold\"\n\
                [[axis]]\npath = \"model.own.breakaway_torque\"\nvalues = [0.4, 0.44]\n\
                [[axis]]\npath = \"bench.hold.dead_zone\"\nfactor = true\nvalues = [1.0, 2.0]\n";
    let plan = plan(text);
    let folder = tempfile::tempdir().unwrap();
    let outcome = run_study(&plan, folder.path(), &Watch::silent()).unwrap();
    assert_eq!(rows(&outcome).iter().filter(|row| row.measures[0].is_some()).count(), 4);
    let ready = plan.ready(folder.path(), &Watch::silent()).unwrap();
    let hold = |case| match ready.preset(case, &plan.values(case)).unwrap().bench.hold {
        stickslip_core::control::compensation::Hold::Stiction(hold) => hold,
        other => panic!("a hold: {other:?}"),
    };
    // 1.2·(M_S − M_K).
    assert!((hold(2).knock_torque - hold(0).knock_torque - 1.2 * 0.04).abs() < 1e-12);
    assert_eq!(hold(1).dead_zone, 2.0 * hold(0).dead_zone);
    assert!(
        refused(&text.replace("bench.hold.dead_zone", "bench.controller.position_gain"))
            .contains("a parameter of another choice")
    );
}

/// The file that `stickslip fit` writes for a curve whose points scatter by `noise` [N m].
fn fitted(folder: &Path, noise: f64) -> (PathBuf, stickslip_fit::StribeckFit) {
    let curve = stickslip_fit::with_values(&Default::default(), [0.45, 0.36, 4.0, 2e-3]);
    let mut rows = "velocity [rad/s],torque [N m]\n".to_owned();
    for k in 0..40_u64 {
        let velocity = 0.1 * libm::pow(500.0, k as f64 / 39.0);
        let [normal, _] = stickslip_base::noise::Normals::new(7).pair(0, k);
        rows += &format!("{velocity},{}\n", curve.torque(velocity) + noise * normal);
    }
    std::fs::write(folder.join("curve.csv"), rows).unwrap();
    let fits = stickslip_experiment::workflow::fit::fit_file(folder, &Default::default(), false).unwrap();
    fits.write(folder, "stickslip fit").unwrap();
    (folder.join("fit.toml"), fits.fits[0].fit.clone())
}

/// A study that draws from a fit, without the further parts of the file.
fn drawing(file: &Path, samples: usize) -> String {
    format!(
        "manoeuvres = [\"sine_2hz\"]\n[set]\nbench.compensation.kind = \"feedforward\"\n\
         [design]\nkind = \"normal\"\nsamples = {samples}\nseed = 3\n[[fit]]\nfile = {file:?}\n"
    )
}

#[test]
fn draws_have_the_covariance_of_the_fit_about_its_values() {
    const DRAWS: usize = 20_000;
    let folder = tempfile::tempdir().unwrap();
    let (file, fit) = fitted(folder.path(), 4e-3);
    let plan = plan(&drawing(&file, DRAWS));
    assert_eq!(plan.axes[2].paths, ["model.own.stribeck_velocity"]);
    let draws: Vec<Vec<f64>> = (0..DRAWS as u64).map(|case| plan.values(case)).collect();
    // From each case alone, independent of earlier draws.
    assert_eq!(plan.values(17), draws[17]);
    // The fit's intervals are even in the logarithm, and so are the draws: in the logarithms the covariance is C_ij/(p_i·p_j).
    let off = |draw: &[f64], i: usize| libm::log(draw[i] / fit.parameters[i]) * fit.parameters[i];
    let mean = |of: &dyn Fn(&[f64]) -> f64| draws.iter().map(|draw| of(draw)).sum::<f64>() / DRAWS as f64;
    for i in 0..4 {
        // Five standard errors of a mean, and below of a covariance: (C_ii·C_jj + C_ij²)/n.
        let bound = 5.0 * fit.standard_errors[i] / (DRAWS as f64).sqrt();
        assert!(mean(&|draw| off(draw, i)).abs() < bound, "{i}");
        for j in 0..=i {
            let [ii, jj, ij] = [fit.covariance[i][i], fit.covariance[j][j], fit.covariance[i][j]];
            let bound = 5.0 * ((ii * jj + ij * ij) / DRAWS as f64).sqrt();
            let covariance = mean(&|draw| off(draw, i) * off(draw, j));
            assert!((covariance - ij).abs() < bound, "{i} {j}: {covariance} for {ij}");
        }
    }
    // Independent draws, without the correlation of the fit, are far from that.
    assert!((fit.covariance[0][2] / (fit.standard_errors[0] * fit.standard_errors[2])).abs() > 0.2);
}

#[test]
fn a_fit_is_applied_to_the_stated_path_and_combines_with_other_axes() {
    let folder = tempfile::tempdir().unwrap();
    let (file, fit) = fitted(folder.path(), 4e-3);
    let text = format!(
        "{}path = [\"plant.screw_friction.model.lugre.sliding\", \"model.own\"]\n\
         [[axis]]\nname = \"belief\"\npath = \"model.own.breakaway_torque\"\nfactor = true\nmean = 1.0\nsd = 0.1\n",
        drawing(&file, 6)
    );
    let plan = plan(&text);
    assert_eq!(plan.axes.len(), 5);
    assert_eq!(
        plan.axes[0].paths,
        ["plant.screw_friction.model.lugre.sliding.breakaway_torque", "model.own.breakaway_torque"]
    );
    let outcome = run_study(&plan, &folder.path().join("out"), &Watch::silent()).unwrap();
    let all = rows(&outcome);
    assert!(all.iter().all(|row| row.measures[0].is_some()), "{all:?}");
    let ready = plan.ready(folder.path(), &Watch::silent()).unwrap();
    let preset = ready.preset(4, &all[4].values).unwrap();
    assert_eq!(preset.model.own.breakaway_torque, all[4].values[0] * all[4].values[4], "the factor comes after");
    assert_eq!(preset.model.own.kinetic_torque, all[4].values[1]);
    outcome.findings().unwrap().write(&folder.path().join("out"), "stickslip study").unwrap();
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("Correlation of the axes") && page.contains("log-normal"));
    assert!(fit.standard_errors[0] > 0.0);
}

#[test]
fn a_fit_that_cannot_be_drawn_from_is_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    let (file, _) = fitted(folder.path(), 4e-3);
    let whole = drawing(&file, 6);
    let toml = std::fs::read_to_string(&file).unwrap();
    for ((from, to), expected) in [
        (("kind = \"normal\"\nsamples = 6\nseed = 3\n", ""), "a fit requires a normal design"),
        (("kind = \"normal\"", "kind = \"sobol\""), "the design has no seed"),
        (("file = ", "files = "), "Did you mean fit.file?"),
        (("[[fit]]\n", "[[fit]]\npath = \"plant.drive\"\n"), "unknown parameter plant.drive.breakaway_torque"),
        (("[[fit]]\n", "[[fit]]\npath = []\n"), "missing path"),
        (("fit.toml", "fitted.toml"), "cannot read it"),
        (
            (
                "[[fit]]\n",
                "[[axis]]\nname = \"own\"\npath = \"model.own.kinetic_torque\"\nmean = 0.3\nsd = 0.01\n[[fit]]\n",
            ),
            "it sets the same parameter as axis model.own.kinetic_torque",
        ),
    ] {
        let message = refused(&whole.replace(from, to));
        assert!(message.contains(expected), "{from}\n{message}");
    }
    // Standard deviations of the parameters themselves, the third far too large: nearly half of the draws would be
    // negative velocities.
    let start = toml.find("sd = [").unwrap();
    let end = start + toml[start..].find('\n').unwrap();
    let changed = toml.replace("logarithmic = true", "logarithmic = false");
    let changed = changed.replace(&toml[start..end], "sd = [0.001, 0.001, 40.0, 1e-5]");
    std::fs::write(&file, changed).unwrap();
    let message = refused(&whole);
    assert!(
        message.contains(" % of the draws of model.own.stribeck_velocity would lie outside 0.0001 … 1000 rad/s"),
        "{message}"
    );
}

#[test]
fn a_case_that_panics_reports_it_and_the_others_are_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan(MODEL);
    let silent = Watch::silent();
    let right = rows(&run_study(&plan, &folder.path().join("right"), &silent).unwrap());
    for threads in [1, 3] {
        let parts = Parts::open(&plan, &folder.path().join(threads.to_string()), &silent).unwrap();
        let work = parts.work();
        let run = |cases: std::ops::Range<u64>| {
            // As a fault of the program would: among others, and alone.
            assert!(!cases.contains(&4) && !cases.contains(&13), "the drawer is stuck");
            work.rows(cases, &silent)
        };
        let lost = |case, words: String| work.lost(case, &words);
        parts.run_by(threads, &silent, |cases| isolate_panics(cases, run, lost)).unwrap();
        for (row, right) in rows(&parts.finish().unwrap()).iter().zip(&right) {
            if [5, 14].contains(&row.case) {
                let failure = row.failure.as_deref().unwrap();
                assert!(failure.starts_with("internal error: the drawer is stuck ("), "{failure}");
                assert!(failure.contains("tests.rs:"), "{failure}");
                assert_eq!((&row.values, &row.measures[..]), (&right.values, &[None][..]));
            } else {
                assert_eq!(row, right);
            }
        }
    }
}

#[test]
fn parts_from_another_machine_give_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| std::fs::read(folder.path().join(name).join("study.parquet")).unwrap();
    let plan = plan(MODEL);
    let silent = Watch::silent();
    run_study(&plan, &folder.path().join("here"), &silent).unwrap();

    let parts = Parts::open(&plan, &folder.path().join("there"), &silent).unwrap();
    assert_eq!(parts.missing(), [0, 1, 2]);
    let work = Work::from_json(&parts.work().to_json()).unwrap();
    assert_eq!((work.parts(), work.part(2), work.part(3)), (3, 16..21, 21..21));
    // An invalid part is refused, and not stored.
    let second = work.part_bytes(1, &silent).unwrap();
    for wrong in [&second, &second[..100]] {
        assert!(parts.put(2, wrong).unwrap_err().to_string().contains("does not belong to this study"));
    }
    assert!(work.part_bytes(3, &silent).unwrap_err().to_string().contains("outside 0 … 2"));
    assert!(parts.finish().unwrap_err().to_string().contains("0000000.parquet is missing"));
    parts.put(2, &work.part_bytes(2, &silent).unwrap()).unwrap();
    parts.put(1, &second).unwrap();

    // The remaining part is run here.
    let parts = Parts::open(&plan, &folder.path().join("there"), &silent).unwrap();
    assert_eq!(parts.missing(), [0]);
    parts.run(2, &silent).unwrap();
    assert_eq!(parts.finish().unwrap().reused, 13);
    assert_eq!(bytes("there"), bytes("here"));
    let parts = Parts::open(&plan, &folder.path().join("there"), &silent).unwrap();
    assert_eq!((parts.missing().len(), parts.finish().unwrap().reused), (0, 21));
}

#[test]
fn a_work_is_the_same_on_another_machine_without_the_files_of_this_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("custom.toml");
    std::fs::write(&file, "[bench.controller]\nkind = \"cascade\"\nposition_gain = 31.7\n").unwrap();
    let stated = format!("{:?}", file.display().to_string());
    for (controller, tuned) in [("\"cascade+hold\"", true), (stated.as_str(), false)] {
        let text = format!(
            "manoeuvres = [\"hold\", \"sine_2hz\"]\ncontroller = {controller}\nplaces = 3\n[design]\nkind = \"normal\"\n\
             samples = 20\ncorrelation = [[1, 0.3], [0.3, 1]]\n\
             [[axis]]\npath = \"model.own.breakaway_torque\"\nmean = 0.4\nsd = 0.02\n\
             [[axis]]\npath = \"model.own.kinetic_torque\"\nmean = 0.3\nsd = 0.0123456789\n"
        );
        let work = plan(&text).ready(folder.path(), &Watch::silent()).unwrap();
        assert_eq!(std::fs::remove_file(folder.path().join("tuned-cascade.toml")).is_ok(), tuned);
        let sent = work.to_json();
        let moved = file.with_extension("away");
        std::fs::rename(&file, &moved).unwrap();
        let there = Work::from_json(&sent).unwrap();
        std::fs::rename(&moved, &file).unwrap();
        assert_eq!(there.follows_from, work.follows_from);
        for case in [0, 7, 19] {
            let preset = |work: &Work| work.preset(case, &work.plan.values(case)).unwrap();
            assert!(preset(&there) == preset(&work), "case {case} with {controller}");
        }
    }
}

#[test]
fn a_work_of_another_version_is_refused_with_both() {
    let folder = tempfile::tempdir().unwrap();
    let sent = plan(MODEL).ready(folder.path(), &Watch::silent()).unwrap().to_json();
    let version = format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    let refused = |text: &str| Work::from_json(text).unwrap_err().to_string();
    let other = refused(&sent.replace(&version, "\"version\":\"0.0.1\",\"more\":1"));
    assert!(
        other.contains("it was made by stickslip 0.0.1, but this is stickslip ") && other.contains("Install"),
        "{other}"
    );
    // Nothing else is checked before.
    assert_eq!(refused("{\"version\":\"0.0.1\"}"), other);
    assert!(refused("{}").contains("version") && refused(&sent[..200]).contains("Send the text unchanged"));
    assert!(refused(&sent.replace("sine_2hz", "crawl")).contains("unknown manoeuvre"));
}

#[test]
fn a_part_is_a_hundredth_of_the_cases_a_second_of_work_and_whole_vectors() {
    let parts = |manoeuvre: &str, points: usize, seeds: usize| {
        let text = format!(
            "manoeuvres = [\"{manoeuvre}\"]\nseeds = {seeds}\n[[axis]]\npath = \"plant.drive.load_inertia\"\n\
             range = [1e-3, 2e-3]\npoints = {points}\n"
        );
        let work = Work::new(plan(&text), None).unwrap();
        (work.parts(), work.part(0).end)
    };
    assert_eq!(parts("sine_2hz", 7, 1), (1, 7));
    assert_eq!(parts("sine_2hz", 1000, 1), (63, 16));
    // 3.3 s each: 90 cases, rounded up to 96.
    assert_eq!(parts("sine_2hz", 100_000, 1), (1042, 96));
    assert_eq!(parts("sine_2hz", 100_000, 100), (12_500, 8));
    // The inputs of a part take less space than the part, and differ for any bit.
    let mut long = plan(MODEL);
    let values: Vec<f64> = (0..100_000).map(|k| 1e-3 + 1e-9 * f64::from(k)).collect();
    let inputs = |plan: &Plan| Work::new(plan.clone(), None).unwrap().follows_from;
    long.axes[1].spread = Spread::Values(values.clone());
    assert!(inputs(&long).len() < 100 + inputs(&plan(MODEL)).len());
    let mut other = long.clone();
    let mut values = values;
    values[70_000] = values[70_000].next_up();
    other.axes[1].spread = Spread::Values(values);
    assert_ne!(inputs(&other), inputs(&long));
    // No more parts than can be listed.
    let mut many = plan(MODEL);
    (many.design, many.seeds) = (Design::Sobol { samples: 1_000_000_000 }, 1000);
    assert_eq!(Work::new(many, None).unwrap().part(0), 0..1000);
}

#[test]
fn a_study_of_a_program_has_its_machine_and_no_lines() {
    let machine = stickslip_base::parameters::presets::find("emps").unwrap();
    let plan = read_text(MODEL, Some(machine)).unwrap();
    assert_eq!((plan.machine.as_str(), plan.title.as_str()), ("emps", "study"));
    assert_eq!(plan.grid().unwrap()[1].len(), 7);
    assert_eq!(sampled("kind = \"sobol\"\nsamples = 12").grid(), None);
    let message = read_text("manoevres = [\"creep\"]\n", None).unwrap_err().to_string();
    assert!(message.contains("unknown parameter manoevres (study). Did you mean manoeuvres?"), "{message}");
    let message = read_text("manoeuvres = [\"creep\"]\nseeds = 0\n", None).unwrap_err().to_string();
    assert!(message.starts_with("study: seeds = 0"), "{message}");
}

/// The friction of the machine, quickly: its measures by the step of the virtual machine.
fn stiffness(more: &str) -> String {
    let axis = "[[axis]]\npath = \"plant.screw_friction.model.lugre.bristle_stiffness\"\nvalues = [300.0, 3e3, 10e3]\n";
    format!("manoeuvres = [\"sine_2hz\", \"reversal\"]\n{more}\n{axis}")
}

#[test]
fn a_study_selects_its_steps_and_states_their_true_error() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, more: &str, set: &str| {
        // Counts so small that none of them matters.
        let encoder = "counts_per_revolution = 4e6";
        let more = format!("{more}\n[set]\nplant.encoder.{encoder}\nmodel.encoder.{encoder}\n{set}");
        rows(&run_study(&plan(&stiffness(&more)), &folder.path().join(name), &Watch::silent()).unwrap())
    };
    let exact = run("exact", "", "bench.plant_step = 2e-6");
    assert!(exact.iter().all(|row| (row.step, row.error) == (None, None)));
    let chosen = [("loose", 0.1), ("usual", 0.01), ("tight", 1e-3)].map(|(name, tolerance)| {
        let rows = run(name, &format!("tolerance = {tolerance}"), "");
        for (row, exact) in rows.iter().zip(&exact) {
            let error = row.error.unwrap();
            assert!(error <= tolerance, "{row:?}");
            for (value, exact) in row.measures.iter().zip(&exact.measures) {
                let (value, exact) = (value.unwrap(), exact.unwrap());
                // Terms of higher order are added, and a noise sample that comes earlier or later.
                assert!((value - exact).abs() <= (error + 5e-4) * exact, "{value}, truly {exact}, stated {error}");
            }
        }
        rows.iter().map(|row| row.step.unwrap()).sum::<f64>()
    });
    assert!(chosen[0] > chosen[2], "a looser tolerance takes longer steps: {chosen:?}");
}

#[test]
fn a_machine_that_needs_finer_steps_gets_them() {
    let folder = tempfile::tempdir().unwrap();
    let axis = "[[axis]]\npath = \"plant.screw_friction.model.lugre.bristle_stiffness\"\nvalues = [3e3, 1e7]\n";
    let text = |more: &str| format!("manoeuvres = [\"reversal\"]\n{more}\n{axis}");
    let run = |name: &str, more: &str| {
        rows(&run_study(&plan(&text(more)), &folder.path().join(name), &Watch::silent()).unwrap())
    };
    let stated = run("stated", "[set]\nbench.plant_step = 25e-6");
    assert!(stated[1].failure.as_ref().unwrap().contains("plant_step"), "{stated:?}");
    let chosen = run("chosen", "");
    assert_eq!(chosen[1].failure, None);
    assert!(chosen[1].step.unwrap() < 25e-6 && chosen[0].step.unwrap() >= 25e-6, "{chosen:?}");
}

#[test]
fn the_accuracy_of_the_steps_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str, tolerance: f64| {
        let plan = plan(&stiffness(&format!("tolerance = {tolerance}")));
        run_study(&plan, &folder.path().join(name), &Watch::silent()).unwrap().findings().unwrap()
    };
    let sentences = run("usual", 0.01).sentences();
    assert!(
        sentences.contains("doubling them changes no measure by more than") && sentences.contains("(tolerance: 1.0 %)"),
        "{sentences}"
    );
    // Finer than a count of the encoder allows.
    let findings = run("beyond", 1e-9);
    assert!(findings.sentences().contains("exceeds the tolerance of 0.00000010 %"), "{}", findings.sentences());
    let summary = findings.summary();
    assert_eq!(summary.value("study.cases_beyond_tolerance"), Some(3.0));
    assert!(findings.report("").html().contains("were halved until no measure moved"));
}

#[test]
fn an_invalid_or_unused_tolerance_is_refused() {
    for (more, words) in [
        ("tolerance = 0.0", "must be within 1e-9 … 1"),
        ("tolerance = nan", "must be within 1e-9 … 1"),
        ("tolerance = 0.01\n[set]\nbench.plant_step = 1e-5", "are stated, and the tolerance selects"),
    ] {
        let message = refused(&stiffness(more));
        assert!(message.contains(words), "{message}");
    }
    let steps = "[[axis]]\npath = \"bench.plant_step\"\nvalues = [1e-5, 2e-5]\n";
    assert_eq!(plan(&(stiffness("") + steps)).tolerance, None);
}
