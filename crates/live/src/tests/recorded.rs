//! Runs of a running bench: recorded, entered, replayed.

use super::*;
use crate::LiveError;

#[test]
fn a_live_run_is_recorded_from_its_start_and_replays_with_all_changes() {
    let (live, project) = live_into(|project| Some(project.join("run.mf4")));
    live.call(ANN, Call::Home {}).unwrap();
    ended(&live);
    live.call(ANN, sine(0.2)).unwrap();
    live.call(ANN, set("bench.law.kind", "bristle")).unwrap();
    live.call(ANN, set(GAIN, "11.5")).unwrap();
    live.call(ANN, Call::Halt {}).unwrap();
    ended(&live);
    live.call(ANN, Call::Preload { preload: 0.5 }).unwrap();
    ended(&live);
    live.call(ANN, Call::Stop {}).unwrap();
    assert!(status(&live).recording.unwrap().ends_with("run.mf4"));
    live.stop().unwrap();
    let record = stickslip_bench::run::Record::read(&project.path().join("run.mf4")).unwrap();
    let replayed = stickslip_bench::run::replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine && replayed.cycles > 500, "{replayed:?}");
    // The initial law, home (3), start, two sets, preload, stop.
    assert!(record.changes.len() >= 7, "{}", record.changes.len());
}

/// Waits for a number of runs in the catalogue and lists them.
fn entered(live: &Live, count: u64) -> Vec<crate::catalogue::Run> {
    loop {
        match live.call("looks", Call::Runs { query: String::new(), limit: 10 }).unwrap() {
            Answer::Runs { runs, of, .. } if of >= count => return runs,
            Answer::Runs { .. } => thread::sleep(Duration::from_millis(5)),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_recording_starts_and_ends_on_a_running_bench_and_replays_bit_for_bit() {
    let (live, project) = live();
    live.call(ANN, Call::Home {}).unwrap();
    ended(&live);
    live.call(ANN, sine(0.2)).unwrap();
    while status(&live).doing.is_none_or(|doing| doing.stage != motion::MOVING) {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, set(GAIN, "14")).unwrap();
    assert!(live.call(ANN, Call::EndRecord {}).is_err(), "nothing is recorded");
    assert!(live.call(ANN, Call::Record { name: "../out".into() }).is_err());
    live.call(ANN, Call::Record { name: "grease".into() }).unwrap();
    let twice = live.call(ANN, Call::Record { name: "again".into() }).unwrap_err();
    assert!(matches!(&twice.of(), Some(LiveError::Busy { what, .. }) if what.contains("grease")), "{twice}");
    assert!(twice.to_string().contains("stickslip bench record --stop"), "{twice}");
    live.call(ANN, set(GAIN, "12")).unwrap();
    live.call(ANN, Call::Inject { fault: "accelerometer-jump=0.001".into() }).unwrap();
    let recorded = loop {
        let recorded = status(&live).recorded.unwrap();
        if recorded.length > 0.5 && recorded.bytes > 20_000 {
            break recorded;
        }
        thread::sleep(Duration::from_millis(5));
    };
    assert!(recorded.from > 100 && recorded.lost == 0, "{recorded:?}");
    let law = live.call(ANN, set("bench.law.kind", "bristle")).unwrap();
    let Answer::Entered { cycle, .. } = law else { panic!("{law:?}") };
    // Changes after the last cycle of a record are not in it.
    while status(&live).cycle <= cycle {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::EndRecord {}).unwrap();
    let now = status(&live);
    assert_eq!((now.recording, now.recorded, now.doing.is_some()), (None, None, true), "the bench continues");

    let run = entered(&live, 1).remove(0);
    assert_eq!((run.name.as_str(), run.kind.as_str()), ("run 1, grease", "recording"));
    assert_eq!((run.preset.as_str(), run.record.as_deref()), ("clm-bench", Some("run.mf4")));
    let file = project.path().join(&run.folder).join("run.mf4");
    let stored = stickslip_bench::run::Stored::open(&file).unwrap();
    let replayed = stored.replay(&Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine && replayed.of > 500, "{replayed:?}");
    let record = stickslip_bench::run::Record::read(&file).unwrap();
    assert!(record.changes.len() >= 3 && record.state.is_some());
    let reference = live.shared.parameters.read(|tuning| *tuning.reference());
    assert_ne!(record.preset.bench.controller, reference.bench.controller, "14");

    is_replayed_with_its_story(&live, run.number);

    // Its simulation is identical bit for bit, and differs with another gain.
    let simulate = |gain: Option<&str>| {
        let values = gain.map(|gain| (GAIN.to_owned(), gain.to_owned())).into_iter().collect();
        let signals = vec!["angle".into(), "software.commanded_torque".into()];
        let call = Call::Simulate { number: run.number, values, signals, length: 60.0, parts: 50 };
        match live.call("looks", call).unwrap() {
            Answer::Simulated { simulated, differences } => (simulated, differences.len()),
            other => panic!("{other:?}"),
        }
    };
    let (same, changed) = simulate(None);
    assert_eq!((same.cycles, changed, same.ended.as_deref()), (replayed.of, 0, None));
    assert!(same.traces.iter().all(|trace| trace.peak == Some(0.0) && trace.rms == Some(0.0)), "{same:?}");
    assert!(same.time.len() <= 50 && same.traces[0].recorded == same.traces[0].simulated);
    let (other, changed) = simulate(Some("5"));
    assert_eq!(changed, 1);
    assert!(other.traces.iter().all(|trace| trace.rms > Some(1e-6) && trace.peak > trace.rms), "{other:?}");
    let values = BTreeMap::from([("bench.tick_rate".to_owned(), "500".to_owned())]);
    let refused = Call::Simulate { number: run.number, values, signals: vec!["angle".into()], length: 1.0, parts: 9 };
    assert!(live.call("looks", refused).unwrap_err().to_string().contains("depend on it"));

    // A second one, ended by the end of the bench.
    live.call(ANN, Call::Record { name: "second".into() }).unwrap();
    thread::sleep(Duration::from_millis(100));
    let catalogue = crate::catalogue::Catalogue::of_project(project.path(), Path::new("."));
    live.stop().unwrap();
    let second = catalogue.runs("second", 9).unwrap().runs.remove(0);
    let file = project.path().join(&second.folder).join("run.mf4");
    assert!(stickslip_bench::run::Stored::open(&file).unwrap().replay(&Watch::silent()).unwrap().identical());
}

/// Replays a run by a call, and reads its events.
fn is_replayed_with_its_story(live: &Live, number: i64) {
    let replay = replayed(live, number);
    assert_eq!((replay.identical, replay.fraction), (Some(true), 1.0), "{replay:?}");
    assert!(replay.sentence.unwrap().contains("every bit is the same"));
    let Answer::Story { happened } = live.call(ANN, Call::Story { number }).unwrap() else { panic!() };
    let words: Vec<_> = happened.iter().map(|one| one.what.as_str()).collect();
    assert!(
        words[0] == "Begin" && words.iter().any(|words| words.starts_with("Injected: accelerometer-jump")),
        "{words:?}"
    );
    let gain = happened.iter().flat_map(|one| &one.details).any(|line| line.contains("position_gain"));
    assert!(gain, "{happened:?}");
    let none = live.call(ANN, Call::Replay { number: 99 }).unwrap_err();
    assert!(matches!(none.of(), Some(LiveError::NoRun { number: 99 })), "{none}");
}

/// Waits for the end of a replay.
fn replayed(live: &Live, number: i64) -> protocol::ReplayProgress {
    loop {
        match live.call("looks", Call::Replay { number }).unwrap() {
            Answer::Replay(replay) if replay.ended => return replay,
            Answer::Replay(replay) => assert_eq!((replay.run, replay.identical), (number, None)),
            other => panic!("{other:?}"),
        }
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn measurements_are_entered_into_the_catalogue_and_can_be_renamed() {
    let (live, project) = live();
    let plan = [("speeds", "2"), ("slowest", "10"), ("fastest", "20")];
    let plan = plan.map(|(name, value)| (name.to_owned(), value.to_owned())).into();
    live.call(ANN, Call::Measure { what: Quantity::Friction, plan, render: false }).unwrap();
    assert_eq!(ended(&live).error, None);
    let run = entered(&live, 1).remove(0);
    assert_eq!((run.number, run.kind.as_str(), run.curve.is_empty()), (1, "measure friction", false));
    assert_eq!(run.folder, "runs/0001-measure-friction", "one number everywhere");
    live.call(ANN, Call::RenameRun { number: 1, name: "first".into() }).unwrap();
    live.call(ANN, Call::TagRun { number: 1, add: vec!["good".into()], remove: Vec::new() }).unwrap();
    live.call(ANN, Call::NoteRun { number: 1, note: "new grease".into() }).unwrap();
    let other = live.call("bob", Call::DeleteRun { number: 1 }).unwrap_err();
    assert!(matches!(other.of(), Some(LiveError::Operated { .. })), "{other}");
    let Answer::Run { run, values, .. } = live.call("bob", Call::Run { number: 1 }).unwrap() else { panic!() };
    assert_eq!((run.name.as_str(), run.note.as_str(), run.tags.len()), ("first", "new grease", 1));
    assert!(values.iter().any(|value| value.path == "bench.tick_rate" && value.number == Some(1000.0)));
    let Answer::Replay(replay) = live.call("bob", Call::Replay { number: 1 }).unwrap() else { panic!() };
    assert_eq!(replay.run, 1, "every measurement is recorded");
    live.call("bob", Call::EndReplay {}).unwrap();
    live.call(ANN, Call::DeleteRun { number: 1 }).unwrap();
    assert!(!project.path().join(&run.folder).exists());
    live.call(ANN, Call::RestoreRun { number: 1 }).unwrap();
    assert!(project.path().join(&run.folder).exists());
    live.stop().unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn a_recording_that_cannot_start_reports_why_and_the_bench_continues() {
    let (live, project) = live();
    // A file in place of the folder of runs.
    std::fs::write(project.path().join("runs"), "").unwrap();
    let refused = live.call(ANN, Call::Record { name: "grease".into() }).unwrap_err().to_string();
    assert!(refused.contains("runs"), "{refused}");
    std::fs::remove_file(project.path().join("runs")).unwrap();
    assert_eq!(status(&live).recording, None);
    live.call(ANN, Call::Record { name: "grease".into() }).unwrap();
    live.call(ANN, Call::EndRecord {}).unwrap();
    live.stop().unwrap();
}
