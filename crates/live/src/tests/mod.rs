mod controller;
mod jogged;
#[cfg(unix)]
mod loaded;
mod measured;
mod recorded;
mod scope;
mod state;
mod tried;
mod trouble;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use stickslip_rt::ThreadSettings;

use super::protocol::{Answer, Call, Ended, Quantity, Status};
use super::*;
use stickslip_base::parameters::presets::{self, Source};
use stickslip_base::{Error, Watch, parameters};

const ANN: &str = "ann";

/// The preset with a low tick rate, which a busy machine can keep.
fn slow() -> Source {
    let mut source = presets::find("clm-bench").unwrap();
    // In a hole of a busy machine the torque is held, and the screw deviates from its set-point.
    let values =
        [("bench.tick_rate", "1000"), ("bench.safety.missed_ticks", "500"), ("bench.safety.following_error", "50")];
    source.text = parameters::set_all::<stickslip_base::Preset<f64>>(&source.text, "t", &values).unwrap();
    source
}

/// A bench with this preset in its own project.
fn live() -> (Live, tempfile::TempDir) {
    live_into(|_| None)
}

/// The same, recorded into a file of its project.
fn live_into(record: impl FnOnce(&Path) -> Option<PathBuf>) -> (Live, tempfile::TempDir) {
    let project = tempfile::tempdir().unwrap();
    let record = record(project.path());
    let start = Start { thread_settings: ThreadSettings::PLAIN, record, ..Start::new(slow(), project.path()) };
    (Live::start(start).unwrap(), project)
}

fn status(live: &Live) -> Status {
    match live.call("looks", Call::Status {}).unwrap() {
        Answer::Status(status) => *status,
        other => panic!("{other:?}"),
    }
}

/// Waits for the end of the running activity.
fn ended(live: &Live) -> Ended {
    loop {
        let now = status(live);
        if now.doing.is_none() {
            return now.last.unwrap();
        }
        thread::sleep(Duration::from_millis(5));
    }
}

fn set(path: &str, value: &str) -> Call {
    Call::Set { values: BTreeMap::from([(path.to_owned(), value.to_owned())]) }
}

fn sine(amplitude: f64) -> Call {
    let values = BTreeMap::from([("amplitude".to_owned(), amplitude), ("frequency".to_owned(), 2.0)]);
    Call::Move { reference: "sine".into(), values, render: false }
}

const GAIN: &str = "bench.controller.position_gain";

#[test]
fn an_axis_is_homed_moved_tuned_captured_and_halted() {
    let (live, _project) = live();
    live.call(ANN, Call::Home {}).unwrap();
    let busy = live.call(ANN, sine(0.2)).unwrap_err();
    assert!(matches!(&busy.of(), Some(LiveError::Busy { what, .. }) if what == "home"), "{busy}");
    assert!(busy.to_string().contains("stickslip bench halt"), "{busy}");
    assert_eq!(ended(&live), Ended { what: "home".into(), error: None, folder: None });
    // The newest cycle arrives a moment later.
    while status(&live).state != "running" {
        thread::sleep(Duration::from_millis(5));
    }

    live.call(ANN, sine(0.2)).unwrap();
    let capture = Call::Capture {
        signals: vec!["setpoint.velocity".into(), "software.estimated_velocity".into()],
        trigger: "setpoint.velocity rises through 0.5".into(),
        before: 0.1,
        after: 0.2,
        decimation: 1,
    };
    let Answer::Capture { capture, .. } = live.call("looks", capture).unwrap() else { panic!("no capture") };
    let captured = loop {
        match live.call("looks", Call::Fetch { capture }).unwrap() {
            Answer::Captured(captured) => break captured,
            Answer::Capture { .. } => thread::sleep(Duration::from_millis(5)),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!((captured.cycles.len(), captured.trigger, captured.lost), (301, 100, 0));
    let velocity = |row: usize| captured.columns[0][row].unwrap();
    assert!(velocity(100) >= 0.5 && velocity(99) < 0.5);
    assert!(live.call("looks", Call::Fetch { capture }).is_err(), "it was fetched");

    // While it moves.
    let Answer::Entered { cycle, differences, .. } = live.call(ANN, set(GAIN, "11.5")).unwrap() else { panic!() };
    assert!(cycle > 0 && differences.len() == 1 && differences[0].after.as_deref() == Some("11.5 1/s"));
    let now = status(&live);
    assert_eq!((now.changed, now.undo, now.doing.map(|doing| doing.what)), (1, true, Some("sine".into())));
    live.call(ANN, Call::Undo {}).unwrap();
    assert_eq!((status(&live).changed, status(&live).redo), (0, true));

    live.call("looks", Call::Halt {}).unwrap();
    assert_eq!(ended(&live), Ended { what: "sine".into(), error: Some("cancelled".into()), folder: None });
    // The set-point rests; the load a moment later.
    let halted = std::time::Instant::now();
    let now = loop {
        let now = status(&live);
        if now.velocity.abs() < 0.3 || halted.elapsed() > Duration::from_secs(2) {
            break now;
        }
        thread::sleep(Duration::from_millis(5));
    };
    assert!(now.state == "running" && now.velocity.abs() < 0.3 && now.clock.lost == 0, "{now:?}");
    let clocked = live.stop().unwrap();
    assert_eq!(clocked.summary.ending.to_string(), "it was stopped");
}

#[test]
fn a_stream_has_every_cycle_in_one_of_its_points() {
    let (live, _project) = live();
    let stream = Call::Stream { signals: vec!["measurement.tacho_voltage".into(), "angle".into()], every: 0.02 };
    let Answer::Capture { capture, .. } = live.call("looks", stream).unwrap() else { panic!("no stream") };
    let mut points = Vec::new();
    while points.len() < 10 {
        match live.call("looks", Call::Points { capture }).unwrap() {
            Answer::Points { points: more } => points.extend(more),
            other => panic!("{other:?}"),
        }
        thread::sleep(Duration::from_millis(10));
    }
    for pair in points.windows(2) {
        assert_eq!((pair[1].from, pair[1].missing, pair[1].to), (pair[0].to + 1, 0, pair[0].to + 20));
        assert!(pair[1].min[0] < pair[1].max[0], "noise");
    }
    assert!(live.call("looks", Call::Fetch { capture }).is_err(), "not a capture");
    live.call("looks", Call::Drop { capture }).unwrap();
    assert!(live.call("looks", Call::Points { capture }).is_err());
}

#[test]
fn one_client_is_the_operator_and_all_clients_may_stop() {
    let (live, _project) = live();
    live.call(ANN, Call::Home {}).unwrap();
    let refused = live.call("bob", set(GAIN, "11")).unwrap_err();
    assert!(matches!(&refused.of(), Some(LiveError::Operated { by }) if by == ANN), "{refused}");
    assert_eq!(status(&live).operator.as_deref(), Some(ANN));
    ended(&live);
    live.call(ANN, sine(0.2)).unwrap();
    live.call("bob", Call::Stop {}).unwrap();
    assert_eq!(ended(&live).error.as_deref(), Some("cancelled"));
    // The status arrives a few milliseconds later.
    while status(&live).state != "ready" {
        thread::sleep(Duration::from_millis(5));
    }
    live.call("bob", Call::Operate {}).unwrap();
    assert!(live.call(ANN, Call::Start {}).is_err());
    live.call("bob", Call::Start {}).unwrap();
    let refused = live.call("bob", Call::Start {}).unwrap_err();
    assert!(matches!(refused, Error::Refused(_)), "{refused}");
}

#[test]
fn invalid_calls_are_refused_and_change_nothing() {
    let (live, _project) = live();
    let refused = |call: Call| live.call(ANN, call).unwrap_err().to_string();
    assert!(refused(Call::Start {}).contains("Home or arm first"));
    assert!(refused(Call::Move { reference: "sin".into(), values: BTreeMap::new(), render: false }).contains("sine"));
    let values = BTreeMap::from([("frequency\"]\n[x".to_owned(), 1.0)]);
    refused(Call::Move { reference: "sine".into(), values, render: false });
    // At 1 kHz the desired friction of this preset cannot be rendered.
    let values = BTreeMap::new();
    assert!(refused(Call::Move { reference: "sine".into(), values, render: true }).contains("render"));
    assert!(refused(set("bench.tick_rate", "2000")).contains("Restart the bench"));
    assert!(refused(Call::Load { name: "none".into() }).contains("No set is saved"));
    assert!(refused(Call::PreviewSet { name: "none".into() }).contains("No set is saved"));
    assert!(refused(Call::Preload { preload: f64::NAN }).contains("0 releases"));
    let capture = |signal: &str, trigger: &str, after: f64| Call::Capture {
        signals: vec![signal.into()],
        trigger: trigger.into(),
        before: 0.0,
        after,
        decimation: 1,
    };
    assert!(refused(capture("angel", "immediate", 1.0)).contains("Did you mean angle"));
    refused(capture("angle", "sometimes", 1.0));
    refused(capture("angle", "immediate", -1.0));
    refused(capture("angle", "immediate", f64::NAN));
    refused(capture("angle", "immediate", 1e9));
    for _ in 0..16 {
        live.call(ANN, capture("angle", "angle above 1e9", 0.1)).unwrap();
    }
    assert!(refused(capture("angle", "immediate", 0.1)).contains("At most 16"));
    let now = status(&live);
    assert_eq!((now.changed, now.state.as_str(), now.doing), (0, "off", None));
}

#[test]
fn the_library_lists_its_frictions_as_identified_and_scaled() {
    let (live, _project) = live();
    let list = |breakaway| match live.call("looks", Call::Frictions { breakaway }).unwrap() {
        Answer::Frictions { frictions } => frictions,
        other => panic!("{other:?}"),
    };
    let as_identified = list(None);
    assert!(as_identified.len() >= 5 && as_identified.iter().all(|one| one.scale == 1.0 && !one.source.is_empty()));
    for (one, scaled) in as_identified.iter().zip(list(Some(0.3))) {
        assert!((scaled.desired[0] - 0.3).abs() < 1e-12, "{scaled:?}");
        let ratio = |desired: &[f64; 4]| desired[1] / desired[0];
        assert!((ratio(&one.desired) - ratio(&scaled.desired)).abs() < 1e-12);
        assert_eq!(one.desired[2], scaled.desired[2], "a speed has no scale");
    }
    assert!(live.call("looks", Call::Frictions { breakaway: Some(-1.0) }).is_err());
}

#[test]
fn the_program_ends_only_without_torque() {
    let (live, _project) = live();
    let refused = || live.call(ANN, Call::Close {}).unwrap_err().to_string();
    live.call(ANN, Call::Home {}).unwrap();
    assert!(refused().starts_with("home is running"), "{}", refused());
    ended(&live);
    assert!(refused().starts_with("the drive is running. Stop the axis"), "{}", refused());
    assert!(live.call("bob", Call::Close {}).is_err(), "a viewer cannot end the program");
    live.call(ANN, Call::Stop {}).unwrap();
    while status(&live).state != "ready" {
        thread::sleep(Duration::from_millis(5));
    }
    assert!(!live.closed());
    live.call(ANN, Call::Close {}).unwrap();
    assert!(live.closed());
}

#[test]
fn calls_and_answers_read_back_from_their_json() {
    let calls = [
        r#"{"call": "status"}"#,
        r#"{"call": "set", "values": {"bench.law.kind": "bristle"}}"#,
        r#"{"call": "move", "reference": "sine", "values": {"amplitude": 0.5}}"#,
        r#"{"call": "capture", "signals": ["angle"], "trigger": "immediate", "before": 0, "after": 1}"#,
        r#"{"call": "measure", "what": "friction"}"#,
    ];
    for text in calls {
        let call = Call::from_json(serde_json::from_str(text).unwrap()).unwrap();
        assert_eq!(Call::from_json(call.to_json()).unwrap(), call);
    }
    for wrong in [r#"{"call": "status", "x": 1}"#, r#"{"call": "fly"}"#, r#"{"call": "save"}"#, "{}"] {
        assert!(Call::from_json(serde_json::from_str(wrong).unwrap()).is_err(), "{wrong}");
    }
    let answer = Answer::Status(Box::default());
    let json = answer.to_json();
    assert!(json["answer"] == "status" && json["preset"].is_string(), "{json}");
    assert_eq!(Answer::from_json(json).unwrap(), answer);
}

#[test]
fn a_kind_offers_its_own_parameters_before_it_is_active() {
    let (live, _project) = live();
    let paths = |values: &[(&str, &str)]| {
        let values = values.iter().map(|(path, value)| ((*path).to_owned(), (*value).to_owned())).collect();
        match live.call("looks", Call::Items { values }) {
            Ok(Answer::Items { items }) => Ok(items.into_iter().map(|item| item.path).collect::<Vec<_>>()),
            Ok(other) => panic!("{other:?}"),
            Err(error) => Err(error.to_string()),
        }
    };
    let proportional = "bench.controller.proportional_gain".to_owned();
    let with = paths(&[("bench.controller.kind", "pid")]).unwrap();
    assert!(with.contains(&proportional) && !with.iter().any(|path| path == GAIN), "{with:?}");
    let active = paths(&[]).unwrap();
    assert!(active.iter().any(|path| path == GAIN) && !active.contains(&proportional));
    assert!(paths(&[("bench.controller.kind", "fuzzy")]).unwrap_err().contains("fuzzy"));
}
