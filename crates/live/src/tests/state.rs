//! State of the target across a restart; measurements that a fault or the end of the program stopped.

use super::*;
use crate::catalogue::Catalogue;
use protocol::{EarlierState, FaultRecovery, MarkKind, Records};

const SAVED: &str = "state/target.json";

fn start(project: &Path) -> Live {
    start_with(project, RECORD_LIMIT)
}

fn start_with(project: &Path, record_limit: u64) -> Live {
    let new = Start::new(slow(), project);
    Live::start(Start { thread_settings: ThreadSettings::PLAIN, record_limit, ..new }).unwrap()
}

fn earlier(live: &Live) -> EarlierState {
    match live.call("looks", Call::EarlierState {}).unwrap() {
        Answer::EarlierState(earlier) => *earlier,
        other => panic!("{other:?}"),
    }
}

fn gain(live: &Live) -> Option<f64> {
    live.shared.parameters.read(|tuning| {
        tuning.entries().iter().find(|entry| entry.path == GAIN).and_then(|entry| match entry.value {
            parameters::Value::Number(value) => Some(value),
            parameters::Value::Variant(_) => None,
        })
    })
}

#[test]
fn the_state_before_a_restart_is_offered_and_restored_only_by_a_call() {
    let project = tempfile::tempdir().unwrap();
    let live = start(project.path());
    assert_eq!((status(&live).earlier, earlier(&live)), (None, EarlierState::default()));
    live.call(ANN, set(GAIN, "11.5")).unwrap();
    live.call(ANN, set("bench.desired.breakaway_torque", "0.41")).unwrap();
    live.call(ANN, Call::Preload { preload: 0.5 }).unwrap();
    ended(&live);
    live.stop().unwrap();

    let live = start(project.path());
    let now = status(&live);
    assert_eq!((now.earlier, now.changed, now.preload), (Some(3), 0, 1.0), "nothing changes by itself");
    let offer = earlier(&live);
    assert!(offer.saved.is_some() && offer.refused.is_none(), "{offer:?}");
    let of = |path: &str| offer.differences.iter().find(|one| one.path.contains(path)).unwrap().clone();
    assert_eq!(of("breakaway_torque").after.as_deref(), Some("0.41 N m"));
    assert_eq!(of(GAIN).after.as_deref(), Some("11.5 1/s"));
    assert_eq!(of("preload").after.as_deref(), Some("0.5"));
    live.call(ANN, Call::RestoreState {}).unwrap();
    ended(&live);
    let now = status(&live);
    assert_eq!((gain(&live), now.preload, now.earlier), (Some(11.5), 0.5, None));
    assert!(live.call(ANN, Call::RestoreState {}).is_err(), "it was restored");
    live.stop().unwrap();

    // A discarded state is preserved in a file, and not offered again.
    let live = start(project.path());
    assert_eq!(status(&live).earlier, Some(3));
    live.call(ANN, Call::DiscardState {}).unwrap();
    assert_eq!((status(&live).earlier, status(&live).changed), (None, 0));
    live.stop().unwrap();
    let before = std::fs::read_to_string(project.path().join("state/target-before.json")).unwrap();
    assert!(before.contains("11.5"));
    let live = start(project.path());
    assert_eq!(status(&live).earlier, None);
    live.stop().unwrap();
}

#[test]
fn a_change_before_the_answer_preserves_the_offered_state() {
    let project = tempfile::tempdir().unwrap();
    let live = start(project.path());
    live.call(ANN, set(GAIN, "11.5")).unwrap();
    live.stop().unwrap();
    let live = start(project.path());
    live.call(ANN, set("bench.desired.breakaway_torque", "0.41")).unwrap();
    assert_eq!(status(&live).earlier, Some(1), "it is still offered");
    let before = std::fs::read_to_string(project.path().join("state/target-before.json")).unwrap();
    let saved = std::fs::read_to_string(project.path().join(SAVED)).unwrap();
    assert!(before.contains("11.5") && saved.contains("0.41") && !saved.contains("11.5"));
    live.call(ANN, Call::RestoreState {}).unwrap();
    assert_eq!(gain(&live), Some(11.5));
}

#[test]
fn a_damaged_state_is_refused_with_its_name_and_the_bench_starts_with_the_preset() {
    let project = tempfile::tempdir().unwrap();
    let live = start(project.path());
    live.call(ANN, set(GAIN, "11.5")).unwrap();
    live.stop().unwrap();
    let file = project.path().join(SAVED);
    let whole = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    let live = start(project.path());
    let now = status(&live);
    assert_eq!((now.changed, now.earlier), (0, None));
    let problem = now.not_saved.unwrap();
    assert!(problem.contains("target.json") && problem.contains("started with the preset"), "{problem}");
    // The next change writes a valid file and preserves the damaged one.
    live.call(ANN, set(GAIN, "12.5")).unwrap();
    assert_eq!(status(&live).not_saved, None);
    live.stop().unwrap();
    assert_eq!(
        std::fs::read_to_string(project.path().join("state/target-before.json")).unwrap(),
        whole[..whole.len() / 2]
    );
    let live = start(project.path());
    assert_eq!(status(&live).earlier, Some(1));
    live.stop().unwrap();
    // The values are checked again: a state that the bench does not accept is refused with its name.
    let text = std::fs::read_to_string(&file).unwrap().replace("12.5", "-12.5");
    std::fs::write(&file, text).unwrap();
    let live = start(project.path());
    let refused = earlier(&live).refused.unwrap();
    assert!(refused.contains("position_gain") && refused.contains("target.json"), "{refused}");
    assert!(live.call(ANN, Call::RestoreState {}).is_err());
    assert_eq!(status(&live).changed, 0, "all of it or nothing");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_and_the_bench_continues() {
    let project = tempfile::tempdir().unwrap();
    std::fs::create_dir(project.path().join("state")).unwrap();
    std::os::unix::fs::symlink("/dev/full", project.path().join(SAVED)).unwrap();
    let live = start(project.path());
    // The link is not a state.
    assert!(status(&live).not_saved.is_some());
    std::fs::remove_file(project.path().join(SAVED)).unwrap();
    std::fs::create_dir_all(project.path().join(SAVED).join("taken")).unwrap();
    live.call(ANN, set(GAIN, "11.5")).unwrap();
    let problem = status(&live).not_saved;
    assert!(problem.is_none() || problem.as_ref().unwrap().contains("target"), "{problem:?}");
    assert_eq!(gain(&live), Some(11.5));
}

#[test]
fn the_layout_of_the_operators_scope_is_stored() {
    let project = tempfile::tempdir().unwrap();
    let live = start(project.path());
    let layout = |live: &Live| match live.call("looks", Call::Layout {}).unwrap() {
        Answer::Text { text } => text,
        other => panic!("{other:?}"),
    };
    assert_eq!(layout(&live), "");
    let keep = |layout: &str| Call::KeepLayout { layout: layout.into() };
    live.call("looks", keep("viewer")).unwrap();
    assert_eq!((layout(&live), status(&live).operator), (String::new(), None), "a viewer");
    live.call(ANN, Call::Operate {}).unwrap();
    live.call(ANN, keep("{\"span\": 3}")).unwrap();
    assert!(live.call(ANN, keep(&"x".repeat(70_000))).is_err());
    live.stop().unwrap();
    assert_eq!(layout(&start(project.path())), "{\"span\": 3}");
}

/// A friction measurement with short plateaus.
fn measure(speeds: &str) -> Call {
    let plan = [("slowest", "20"), ("fastest", "40"), ("speeds", speeds)];
    let plan = plan.map(|(name, value)| (name.to_owned(), value.to_owned())).into();
    Call::Measure { what: Quantity::Friction, plan, render: false }
}

/// Waits for a number of measured speeds.
fn measured(live: &Live, points: usize) {
    loop {
        match live.call("looks", Call::Curve { run: None }).unwrap() {
            Answer::Curve(curve) if curve.points.len() >= points => return,
            _ => thread::sleep(Duration::from_millis(5)),
        }
    }
}

/// Waits for a number of measurements in the catalogue.
fn runs(live: &Live, count: u64) -> Vec<crate::catalogue::Run> {
    loop {
        match live.call("looks", Call::Runs { query: "kind:measure".into(), limit: 10 }).unwrap() {
            Answer::Runs { runs, of, .. } if of >= count => return runs,
            _ => thread::sleep(Duration::from_millis(5)),
        }
    }
}

#[test]
fn a_fault_during_a_measurement_leaves_an_incomplete_run_with_its_record() {
    let project = tempfile::tempdir().unwrap();
    let live = start(project.path());
    live.call(ANN, measure("8")).unwrap();
    measured(&live, 2);
    assert!(status(&live).measurement_record.is_some_and(|record| record.length > 0.0));
    live.call("looks", Call::Inject { fault: "encoder-stuck".into() }).unwrap_err();
    // A fault of the machine, as the injection of the virtual one is not admitted during a measurement.
    live.shared
        .motion
        .change(stickslip_bench::Change::MachineFailed(stickslip_software::supervise::MachineFault::Restarted))
        .unwrap();
    let error = ended(&live).error.unwrap();
    assert!(error.contains("lost its connection"), "{error}");
    let run = runs(&live, 1).remove(0);
    assert_eq!((run.number, run.kind.as_str(), run.record.as_deref()), (1, "measure friction", Some("run.mf4")));
    assert!(run.incomplete.as_ref().is_some_and(|cause| cause.contains("lost its connection")), "{run:?}");
    assert!(run.curve.len() >= 2 && !run.controller.is_empty(), "{run:?}");
    let Answer::Curve(curve) = live.call("looks", Call::Curve { run: None }).unwrap() else { panic!() };
    assert!(curve.run == Some(1) && curve.notes.iter().any(|note| note.starts_with("Incomplete")), "{curve:?}");

    // After Stop likewise, and before the first result.
    while status(&live).state != "fault" {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::Recover {}).unwrap();
    assert_eq!(ended(&live), Ended { what: "home".into(), error: None, folder: None });
    live.call(ANN, measure("8")).unwrap();
    while status(&live).measurement_record.is_none_or(|record| record.length < 0.2) {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::Stop {}).unwrap();
    ended(&live);
    let run = runs(&live, 2).remove(0);
    assert_eq!(run.kind, "measure friction");
    assert!(run.incomplete.is_some() && run.record.is_some() && !run.controller.is_empty(), "{run:?}");
    live.stop().unwrap();
    let file = project.path().join("runs/0001-measure-friction/run.mf4");
    let replayed = stickslip_bench::run::Stored::open(&file).unwrap().replay(&Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.of > 500, "{replayed:?}");
    let report = std::fs::read_to_string(project.path().join("runs/0001-measure-friction/report.json")).unwrap();
    assert!(report.contains("Stopped: ") && report.contains("incomplete"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_measurement_ends_with_its_results_if_the_disk_is_full_for_its_record() {
    let project = tempfile::tempdir().unwrap();
    let live = start(project.path());
    let folder = project.path().join("runs/0001-measure-friction");
    // The record waits between the creation of its folder and of its file.
    let changing = live.shared.parameters.changing();
    live.call(ANN, measure("2")).unwrap();
    while !folder.is_dir() {
        thread::sleep(Duration::from_millis(5));
    }
    std::os::unix::fs::symlink("/dev/full", folder.join("run.mf4")).unwrap();
    drop(changing);
    assert_eq!(ended(&live).error, None);
    let problem = status(&live).not_saved.unwrap();
    assert!(
        problem.contains("not recorded") && problem.contains("run.mf4") && problem.contains("make room"),
        "{problem}"
    );
    let run = runs(&live, 1).remove(0);
    assert_eq!((run.record, run.incomplete), (None, None));
    assert!(run.curve.len() > 1 && !run.files.iter().any(|file| file == "run.mf4"), "{:?}", run.files);
    // With room again the next measurement is recorded, and the message disappears.
    live.call(ANN, measure("2")).unwrap();
    assert_eq!(ended(&live).error, None);
    assert_eq!(status(&live).not_saved, None);
    assert_eq!(runs(&live, 2)[0].record.as_deref(), Some("run.mf4"));
}

#[test]
fn records_of_measurements_are_limited_and_interrupted_ones_are_listed_after_a_start() {
    let project = tempfile::tempdir().unwrap();
    let live = start_with(project.path(), 1);
    let records = |live: &Live| match live.call("looks", Call::Records {}).unwrap() {
        Answer::Records(records) => records,
        other => panic!("{other:?}"),
    };
    for number in 1..=2 {
        live.call(ANN, measure("2")).unwrap();
        assert_eq!(ended(&live).error, None);
        runs(&live, number);
    }
    // The oldest goes first; the newest stays, and so do all results.
    while records(&live).removed == 0 {
        thread::sleep(Duration::from_millis(20));
    }
    let Records { limit, used, count, removed } = records(&live);
    assert!(used > 10_000, "{used}");
    assert_eq!((limit, count, removed), (1, 1, 1));
    let listed = runs(&live, 2);
    assert_eq!((listed[0].record.as_deref(), listed[0].record_removed), (Some("run.mf4"), false));
    assert_eq!((listed[1].record.as_deref(), listed[1].record_removed), (None, true));
    assert!(!listed[1].files.iter().any(|file| file == "run.mf4") && listed[1].curve.len() > 1);
    assert_eq!(listed[1].incomplete, None);
    live.stop().unwrap();

    // A program that was killed leaves a record without a label.
    let runs_folder = project.path().join("runs");
    let (from, to) = (runs_folder.join("0002-measure-friction"), runs_folder.join("0003-measure-friction"));
    std::fs::create_dir(&to).unwrap();
    let bytes = std::fs::read(from.join("run.mf4")).unwrap();
    std::fs::write(to.join("run.mf4"), bytes).unwrap();
    let live = start_with(project.path(), 0);
    let run = runs(&live, 3).remove(0);
    assert_eq!((run.number, run.kind.as_str(), run.record.as_deref()), (3, "measure friction", Some("run.mf4")));
    assert_eq!(run.incomplete.as_deref(), Some("the program ended during the run"));
    // With the limit 0 nothing is recorded.
    live.call(ANN, measure("2")).unwrap();
    ended(&live);
    let run = runs(&live, 4).remove(0);
    assert_eq!((run.record, run.record_removed, run.incomplete), (None, false, None));
    let catalogue = Catalogue::of_project(project.path(), Path::new("."));
    live.stop().unwrap();
    // A rebuilt catalogue has the same.
    catalogue.rebuild().unwrap();
    let found = catalogue.runs("", 10).unwrap().runs;
    assert_eq!(found[1].incomplete.as_deref(), Some("the program ended during the run"));
    assert!(found.iter().any(|run| run.record_removed));
}

#[test]
fn the_offered_way_back_makes_the_bench_usable_again() {
    for (fault, recovery, state) in
        [("controller-nan", FaultRecovery::Arm, "ready"), ("ticks-missed=700", FaultRecovery::Home, "running")]
    {
        let project = tempfile::tempdir().unwrap();
        let live = start(project.path());
        live.call(ANN, Call::Home {}).unwrap();
        ended(&live);
        live.call(ANN, sine(0.5)).unwrap();
        while status(&live).doing.is_none_or(|doing| doing.stage != "moving") {
            thread::sleep(Duration::from_millis(5));
        }
        live.call(ANN, Call::Inject { fault: fault.into() }).unwrap();
        while status(&live).state != "fault" {
            thread::sleep(Duration::from_millis(5));
        }
        let now = status(&live);
        let shown = now.fault.unwrap();
        assert_eq!(shown.recovery, recovery, "{shown:?}");
        assert_eq!(now.reason, Some(format!("{} {}", shown.cause, shown.remedy)));
        let Answer::Marks { marks } = live.call("looks", Call::Marks {}).unwrap() else { panic!() };
        assert!(marks.iter().any(|mark| mark.kind == MarkKind::Fault && mark.cycle == shown.cycle), "{marks:?}");
        live.call(ANN, Call::Recover {}).unwrap();
        if recovery == FaultRecovery::Home {
            assert_eq!(ended(&live).error, None);
        }
        while status(&live).state != state {
            thread::sleep(Duration::from_millis(5));
        }
        assert!(live.call(ANN, Call::Recover {}).is_err(), "without a fault");
    }
}
