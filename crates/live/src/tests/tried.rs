//! Trials and comparisons of controllers.

use super::*;
use stickslip_bench::tap::ChangeKind;
use stickslip_software::cycle::{Change, Parameters};

fn trial(motion: &str, repetitions: u64) -> Call {
    Call::Trial { motion: motion.into(), file: None, repetitions, render: false }
}

fn rows(live: &Live) -> Vec<protocol::TrialRow> {
    match live.call("looks", Call::Trials { limit: 50 }).unwrap() {
        Answer::Trials { trials, .. } => trials,
        other => panic!("{other:?}"),
    }
}

fn pair(live: &Live, a: u64, b: Option<u64>) -> protocol::TrialPair {
    let call = Call::TrialPair { a, b, signal: Default::default(), repetition: 1, from: None, to: None, parts: 500 };
    match live.call("looks", call).unwrap() {
        Answer::TrialPair(pair) => *pair,
        other => panic!("{other:?}"),
    }
}

fn comparison(live: &Live) -> protocol::Comparison {
    match live.call("looks", Call::Comparison { run: None }).unwrap() {
        Answer::Comparison(comparison) => *comparison,
        other => panic!("{other:?}"),
    }
}

fn compare(controllers: [&str; 2]) -> Call {
    Call::Compare {
        controllers: controllers.map(String::from).to_vec(),
        manoeuvres: vec!["sine_2hz".into()],
        repetitions: 2,
        render: false,
    }
}

#[test]
fn a_trial_is_a_run_with_scores_and_two_of_them_are_compared() {
    let (live, project) = live();
    // It homes the axis first.
    live.call(ANN, trial("sine_2hz", 2)).unwrap();
    assert_eq!(ended(&live).error, None);
    live.call(ANN, set(GAIN, "8")).unwrap();
    live.call(ANN, trial("sine_2hz", 1)).unwrap();
    assert_eq!(ended(&live).error, None);
    let rows = rows(&live);
    assert_eq!(rows.iter().map(|row| row.repetitions).collect::<Vec<_>>(), [1, 2]);
    assert!(rows[0].controller == "cascade" && rows[0].friction.starts_with("own, 0.3"), "{:?}", rows[0]);
    let value = |row: usize, title: &str| rows[row].values.iter().find(|value| value.title == title).unwrap().clone();
    let [soft, stiff] = [0, 1].map(|row| value(row, "tracking, RMS"));
    assert!(soft.value > stiff.value && soft.half_width.is_none() && stiff.half_width.is_some() && soft.unit == "mrad");
    assert_eq!(value(0, "settling").value, None);
    let pair = pair(&live, rows[1].run, Some(rows[0].run));
    assert!(pair.courses.len() == 2 && pair.courses[0].trace.time.len() >= 400 && pair.note.is_none());
    assert!(pair.difference_rms.is_some_and(|rms| rms > 0.1), "{:?}", pair.difference_rms);
    let row = pair.rows.iter().find(|row| row.title == "tracking, RMS").unwrap();
    assert!((row.percent.unwrap() - 100.0 * (soft.value.unwrap() / stiff.value.unwrap() - 1.0)).abs() < 1e-9);
    // Also in the catalogue, with its number, and after a restart.
    let number = i64::try_from(rows[0].run).unwrap();
    let run = loop {
        match live.call("looks", Call::Run { number }) {
            Ok(Answer::Run { run, .. }) => break run,
            _ => thread::sleep(Duration::from_millis(10)),
        }
    };
    assert!(run.name.ends_with("test sine 2hz with wheel") && run.files.iter().any(|file| file == "trial.parquet"));
    // The inspector of runs shows the first figure.
    let figure = run.files.iter().find(|file| file.ends_with(".svg")).expect("a figure");
    let drawn = std::fs::read_to_string(project.path().join(&run.folder).join(figure)).unwrap();
    for part in ["Position", "Deviation", "Torque"] {
        assert!(drawn.contains(&format!("<title>{part}</title>")), "{part}");
    }
    assert!(drawn.contains("set-point (line)") && !drawn.contains("no data"), "{drawn}");
    live.stop();
    let again = Live::start(Start { thread_settings: ThreadSettings::PLAIN, ..Start::new(slow(), project.path()) });
    assert_eq!(super::tried::rows(&again.unwrap()).len(), 2);
}

#[test]
fn impossible_trials_are_refused_before_the_axis_moves() {
    let (live, _project) = live();
    let refused = |call: Call| live.call(ANN, call).unwrap_err().to_string();
    assert!(refused(trial("sine_3hz", 1)).contains("sine_2hz"));
    assert!(refused(trial("reversal", 0)).contains("outside 1 … 20"));
    assert!(refused(compare(["pid", "pid"])).contains("at least two"));
    assert!(refused(compare(["active", "fuzzy"])).contains("fuzzy"));
    assert!(refused(compare(["active", "/etc/passwd.toml"])).contains("Known: active"));
    let Call::Compare { controllers, repetitions, .. } = compare(["active", "pid"]) else { panic!() };
    let none = Call::Compare { controllers, repetitions, manoeuvres: Vec::new(), render: false };
    assert!(refused(none).contains("at least one"));
    let rendered = Call::Trial { motion: "hold".into(), file: None, repetitions: 1, render: true };
    assert!(refused(rendered).contains("render"));
    assert!(status(&live).doing.is_none() && rows(&live).is_empty());
}

/// Waits until the trial of this stage has begun.
fn until_stage(live: &Live, begin: &str) {
    loop {
        let now = status(live);
        let doing = now.doing.unwrap_or_else(|| panic!("it has ended: {:?}", now.last));
        if doing.stage.starts_with(begin) {
            return thread::sleep(Duration::from_millis(500));
        }
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn controllers_are_ranked_and_the_former_one_returns_after_the_end_a_cancellation_a_stop_and_a_fault() {
    let (live, project) = live_into(|project| Some(project.join("run.mf4")));
    live.call(ANN, compare(["active", "pid"])).unwrap();
    assert_eq!(ended(&live).error, None);
    let ranking = comparison(&live);
    assert!(
        ranking.complete && !ranking.running && ranking.rows.len() == 2 && ranking.columns.len() == 1,
        "{ranking:?}"
    );
    assert!(ranking.rows.iter().all(|row| row.place.is_some() && row.ci95.is_some() && row.values[0].is_some()));
    assert!(
        ranking.rows.iter().any(|row| row.controller == "cascade (active)" && row.factor == Some(1.0)),
        "{ranking:?}"
    );
    assert_eq!(rows(&live).len(), 2, "the trials of both");
    let folder = std::fs::read_dir(project.path().join("runs")).unwrap().flatten().map(|entry| entry.path());
    let folder = folder.into_iter().find(|path| path.ends_with(format!("{:04}-comparison", ranking.run))).unwrap();
    let drawn = std::fs::read_to_string(folder.join("sine_2hz.svg")).unwrap();
    assert!(drawn.contains("pid (line)") && drawn.contains("pid − active (line)"), "{drawn}");

    live.call(ANN, compare(["pid", "active"])).unwrap();
    until_stage(&live, "pid, 1 of 2: ");
    assert!(live.call(ANN, set(GAIN, "9")).is_err(), "it sets parameters itself");
    live.call("bob", Call::Halt {}).unwrap();
    assert_eq!(ended(&live).error.as_deref(), Some("cancelled"));
    assert_eq!(status(&live).state, "running");

    live.call(ANN, compare(["pid", "active"])).unwrap();
    until_stage(&live, "pid, 1 of 2: ");
    live.call("bob", Call::Stop {}).unwrap();
    assert_eq!(ended(&live).error.as_deref(), Some("cancelled"));
    while status(&live).state != "ready" {
        thread::sleep(Duration::from_millis(5));
    }
    // In the middle of the first motion of 3 s.
    let soon = status(&live).cycle as f64 / status(&live).rate + 2.0;
    live.call(ANN, Call::Inject { fault: format!("encoder-stuck@{soon}s") }).unwrap();
    live.call(ANN, compare(["pid", "active"])).unwrap();
    let error = ended(&live).error.unwrap();
    assert!(error.contains("encoder"), "{error}");
    while status(&live).state != "fault" {
        thread::sleep(Duration::from_millis(5));
    }
    let remarks = comparison(&live).remarks;
    assert!(remarks.last().unwrap().starts_with("Ended early"), "{remarks:?}");
    live.stop().unwrap();

    // Each comparison sets the entrant's parameters, and the last ones are those of the start.
    let record = stickslip_bench::run::Record::read(&project.path().join("run.mf4")).unwrap();
    let entered: Vec<Parameters<f64>> = (record.changes.iter())
        .filter_map(|changed| match changed.what {
            ChangeKind::Software(Change::Parameters(parameters), _) => Some(parameters),
            _ => None,
        })
        .collect();
    let first = entered[0];
    assert!(entered.iter().filter(|parameters| **parameters != first).count() >= 4, "{}", entered.len());
    assert!(entered.last() == Some(&first));
    let other = entered.iter().rposition(|parameters| *parameters != first).unwrap();
    assert!(entered.len() - other >= 2);
}
