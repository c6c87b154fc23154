use std::collections::BTreeMap;
use std::time::Duration;

use stickslip_rt::Wishes;

use super::*;
use crate::bench::remote::PlantServer;
use crate::parameters::presets;

const ANN: &str = "ann";

/// A bench of few ticks, which a busy machine keeps up with, in a project of its own.
fn live() -> (Live, tempfile::TempDir) {
    live_into(|_| None)
}

/// The same, recorded into a file of its project.
fn live_into(record: impl FnOnce(&Path) -> Option<PathBuf>) -> (Live, tempfile::TempDir) {
    let mut source = presets::find("clm-bench").unwrap();
    source.text = parameters::set::<crate::Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000").unwrap();
    let project = tempfile::tempdir().unwrap();
    let record = record(project.path());
    let start = Start { wishes: Wishes::PLAIN, record, ..Start::new(source, project.path()) };
    (Live::start(start).unwrap(), project)
}

fn status(live: &Live) -> Status {
    match live.call("looks", Call::Status {}).unwrap() {
        Answer::Status(status) => *status,
        other => panic!("{other:?}"),
    }
}

/// Waits until what runs has ended.
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
    assert!(matches!(&busy, Error::Busy { what } if what == "home"), "{busy}");
    assert_eq!(ended(&live), Ended { what: "home".into(), error: None, folder: None });
    // What the newest cycle was comes a moment later.
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
    let now = status(&live);
    assert!(now.state == "running" && now.velocity.abs() < 0.5 && now.clock.lost == 0, "{now:?}");
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
    assert!(live.call("looks", Call::Fetch { capture }).is_err(), "it is no capture");
    live.call("looks", Call::Drop { capture }).unwrap();
    assert!(live.call("looks", Call::Points { capture }).is_err());
}

#[test]
fn one_operates_and_everybody_may_stop() {
    let (live, _project) = live();
    live.call(ANN, Call::Home {}).unwrap();
    let refused = live.call("bob", set(GAIN, "11")).unwrap_err();
    assert!(matches!(&refused, Error::Operated { by } if by == ANN), "{refused}");
    assert_eq!(status(&live).operator.as_deref(), Some(ANN));
    ended(&live);
    live.call(ANN, sine(0.2)).unwrap();
    live.call("bob", Call::Stop {}).unwrap();
    assert_eq!(ended(&live).error.as_deref(), Some("cancelled"));
    // The stream is behind by a look or two.
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
fn a_measurement_leaves_its_results_and_keeps_parameters_of_its_own() {
    let (live, project) = live();
    let plan = [("slowest", "20"), ("fastest", "40"), ("speeds", "2")];
    let plan = plan.map(|(name, value)| (name.to_owned(), value.to_owned()));
    let measure = Call::Measure { what: Quantity::Friction, plan: plan.into(), render: false };
    live.call(ANN, measure.clone()).unwrap();
    let busy = live.call(ANN, set(GAIN, "11")).unwrap_err();
    assert!(matches!(busy, Error::Busy { .. }), "{busy}");
    let ended = ended(&live);
    assert_eq!(ended.error, None);
    let folder = ended.folder.unwrap();
    assert!(folder.ends_with("runs/0001-measure-friction"), "{folder}");
    assert!(Path::new(&folder).starts_with(project.path()));
    assert!(Path::new(&folder).join("summary.json").exists());
    live.call(ANN, set(GAIN, "11")).unwrap();
    let unknown =
        Call::Measure { what: Quantity::Friction, plan: BTreeMap::from([("sped".into(), "2".into())]), render: false };
    let refused = live.call(ANN, unknown).unwrap_err().to_string();
    assert!(refused.contains("speeds"), "{refused}");
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let (live, _project) = live();
    let refused = |call: Call| live.call(ANN, call).unwrap_err().to_string();
    assert!(refused(Call::Start {}).contains("Home or arm first"));
    assert!(refused(Call::Move { reference: "sin".into(), values: BTreeMap::new(), render: false }).contains("sine"));
    let values = BTreeMap::from([("frequency\"]\n[x".to_owned(), 1.0)]);
    refused(Call::Move { reference: "sine".into(), values, render: false });
    // At 1 kHz the desired friction of this preset is out of reach.
    let values = BTreeMap::new();
    assert!(refused(Call::Move { reference: "sine".into(), values, render: true }).contains("render"));
    assert!(refused(set("bench.tick_rate", "2000")).contains("anew"));
    assert!(refused(Call::Load { name: "none".into() }).contains("None is saved"));
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
fn every_call_and_answer_is_the_same_behind_its_json() {
    let calls = [
        r#"{"call": "status"}"#,
        r#"{"call": "set", "values": {"bench.law.kind": "bristle"}}"#,
        r#"{"call": "move", "reference": "sine", "values": {"amplitude": 0.5}}"#,
        r#"{"call": "capture", "signals": ["angle"], "trigger": "immediate", "before": 0, "after": 1}"#,
        r#"{"call": "measure", "what": "friction"}"#,
    ];
    for text in calls {
        let call: Call = serde_json::from_str(text).unwrap();
        let again: Call = serde_json::from_str(&serde_json::to_string(&call).unwrap()).unwrap();
        assert_eq!(call, again);
    }
    for wrong in [r#"{"call": "status", "x": 1}"#, r#"{"call": "fly"}"#, r#"{"call": "save"}"#, "{}"] {
        assert!(serde_json::from_str::<Call>(wrong).is_err(), "{wrong}");
    }
    let answer = Answer::Status(Box::default());
    let text = serde_json::to_string(&answer).unwrap();
    assert!(text.starts_with(r#"{"answer":"status","preset":"#), "{text}");
    assert_eq!(serde_json::from_str::<Answer>(&text).unwrap(), answer);
}

#[test]
fn a_live_run_is_recorded_from_its_begin_and_replays_with_all_that_was_done_to_it() {
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
    let record = crate::run::Record::read(&project.path().join("run.mf4")).unwrap();
    let replayed = crate::run::replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine && replayed.cycles > 500, "{replayed:?}");
    // The law of the begin, home (3), start, two sets, preload, stop.
    assert!(record.changes.len() >= 7, "{}", record.changes.len());
}

/// A machine in another thread, as `stickslip plant` serves one, until it is told to end.
struct Plant {
    gone: Arc<AtomicBool>,
    serving: JoinHandle<()>,
}

impl Plant {
    fn serve(address: &Address, source: &Source) -> Self {
        let mut server = PlantServer::bind(address, &source.read().unwrap(), 1).unwrap();
        let gone = Arc::new(AtomicBool::new(false));
        let watch = Watch::new(gone.clone(), |_, _| {});
        Plant { gone, serving: thread::spawn(move || drop(server.serve(false, &watch))) }
    }

    fn kill(self) {
        self.gone.store(true, Ordering::Relaxed);
        self.serving.join().unwrap();
    }
}

#[test]
fn a_machine_elsewhere_may_die_and_come_back_and_the_bench_says_so_and_lives() {
    let project = tempfile::tempdir().unwrap();
    let mut source = presets::find("clm-bench").unwrap();
    // Far longer than a busy machine lets a thread wait.
    for (path, value) in [("bench.tick_rate", "1000"), ("bench.safety.missed_ticks", "500")] {
        source.text = parameters::set::<crate::Preset<f64>>(&source.text, "t", path, value).unwrap();
    }
    let address = Address::Shm(project.path().join("axis").display().to_string());
    let plant = Plant::serve(&address, &source);
    let (io, record) = (Some(address.clone()), Some(project.path().join("run.mf4")));
    let (folder, wishes) = (project.path().join("project"), Wishes::PLAIN);
    let live = Live::start(Start { io, wishes, record, ..Start::new(source.clone(), &folder) }).unwrap();
    let until = |state: &str| {
        while status(&live).state != state {
            thread::sleep(Duration::from_millis(5));
        }
    };
    until("off");
    plant.kill();
    until("fault");
    let reason = status(&live).reason.unwrap();
    assert!(reason.contains("has not answered for 501 ticks") && reason.contains("home"), "{reason}");
    // As long as it is gone nothing helps; cycles go on.
    live.call(ANN, Call::Acknowledge {}).unwrap();
    until("fault");
    let plant = Plant::serve(&address, &source);
    while status(&live).link.unwrap().begun < 2 {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::Acknowledge {}).unwrap();
    until("off");
    let cycle = status(&live).cycle;
    while status(&live).cycle < cycle + 100 {
        thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(status(&live).state, "off", "it answers again");
    live.stop().unwrap();
    plant.kill();
    // The whole story replays, bit for bit.
    let replayed =
        crate::run::replay(&crate::run::Record::read(&project.path().join("run.mf4")).unwrap(), &Watch::silent());
    let replayed = replayed.unwrap();
    assert!(replayed.identical() && !replayed.machine, "{replayed:?}");
}

#[test]
fn an_operator_who_falls_silent_stops_what_runs_and_who_is_heard_does_not() {
    let project = tempfile::tempdir().unwrap();
    let mut source = presets::find("clm-bench").unwrap();
    source.text = parameters::set::<crate::Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000").unwrap();
    let start = |operator_time| {
        let new = Start::new(source.clone(), project.path());
        Live::start(Start { wishes: Wishes::PLAIN, operator_time: Some(operator_time), ..new })
    };
    for nonsense in [0.0, -1.0, f64::NAN, 1e9] {
        assert!(matches!(start(nonsense), Err(Error::OutOfRange { .. })), "{nonsense}");
    }
    let live = start(1.0).unwrap();
    live.call(ANN, Call::Home {}).unwrap();
    let heard = |live: &Live| live.call(ANN, Call::Sets {}).map(drop).unwrap();
    while status(&live).doing.is_some() {
        heard(&live);
        thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(status(&live).last.unwrap().error, None);
    live.call(ANN, sine(0.2)).unwrap();
    let begun = std::time::Instant::now();
    while begun.elapsed() < Duration::from_secs(2) {
        heard(&live);
        assert!(status(&live).doing.is_some());
        thread::sleep(Duration::from_millis(5));
    }
    // Others who look are no operator.
    let why = ended(&live).error.unwrap();
    assert!(why.contains("silent for more than 1 s"), "{why}");
    while status(&live).state != "ready" {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::Start {}).unwrap();
}

#[test]
fn a_fault_on_purpose_stops_the_axis_and_is_replayed() {
    let (live, project) = live_into(|project| Some(project.join("run.mf4")));
    live.call(ANN, Call::Home {}).unwrap();
    ended(&live);
    live.call(ANN, sine(0.5)).unwrap();
    while status(&live).doing.is_none_or(|doing| doing.stage != "moving") {
        thread::sleep(Duration::from_millis(5));
    }
    let refused = |fault: &str| live.call(ANN, Call::Inject { fault: fault.into() }).unwrap_err().to_string();
    assert!(refused("encoder-stick").contains("encoder-stuck"));
    assert!(refused("counts-lost=7").contains("counts-lost"));
    live.call(ANN, Call::Inject { fault: "encoder-stuck".into() }).unwrap();
    while status(&live).state != "fault" {
        thread::sleep(Duration::from_millis(5));
    }
    assert!(status(&live).reason.is_some());
    live.stop();
    let path = project.path().join("run.mf4");
    let replayed = crate::run::Stored::open(&path).unwrap().replay(&Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine, "{replayed:?}");
    // A record is not written over.
    let source = presets::find("clm-bench").unwrap();
    let again = Live::start(Start { record: Some(path), ..Start::new(source, project.path()) }).err().unwrap();
    assert!(again.to_string().contains("run.mf4"), "{again}");
}

#[test]
fn a_sketch_and_a_margin_are_told_and_nothing_is_put_in_force() {
    let (live, _folder) = live();
    let sketch: Call = serde_json::from_str(
        r#"{"call": "sketch", "speeds": [0, 1, 10], "desired": [0.3, 0.12, 0.01, 1e-4], "thorough": true}"#,
    )
    .unwrap();
    let Answer::Drawn(drawn) = live.call("looks", sketch).unwrap() else { panic!("it is drawn") };
    assert_eq!((drawn.curve.len(), drawn.renderable), (3, false));
    let margin = |law: &str, stiffness: &str| {
        let values = [("bench.law.kind", law), ("bench.desired_bristles.stiffness", stiffness)];
        let values = values.map(|(path, value)| (path.to_owned(), value.to_owned())).into();
        live.call("looks", Call::Margin { values })
    };
    let Answer::Margin(soft) = margin("bristle", "300").unwrap() else { panic!("it is a margin") };
    assert!(soft.stable && soft.stiffness == Some(300.0) && soft.chatter < soft.chatter_limit, "{soft:?}");
    assert!(matches!(margin("bristly", "300"), Err(Error::Parameters(_))));
    let Answer::Status(status) = live.call("looks", Call::Status {}).unwrap() else { panic!("a status") };
    assert_eq!((status.changed, status.operator), (0, None));
    live.stop().unwrap();
}

/// What is in the catalogue, once so many are.
fn entered(live: &Live, many: u64) -> Vec<crate::catalogue::Run> {
    loop {
        match live.call("looks", Call::Runs { query: String::new(), limit: 10 }).unwrap() {
            Answer::Runs { runs, of, .. } if of >= many => return runs,
            Answer::Runs { .. } => thread::sleep(Duration::from_millis(5)),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_recording_is_begun_and_ended_while_the_bench_runs_and_replays_to_the_bit() {
    let (live, project) = live();
    live.call(ANN, Call::Home {}).unwrap();
    ended(&live);
    live.call(ANN, sine(0.2)).unwrap();
    while status(&live).doing.is_none_or(|doing| doing.stage != axis::MOVING) {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, set(GAIN, "14")).unwrap();
    assert!(live.call(ANN, Call::EndRecord {}).is_err(), "nothing is recorded");
    assert!(live.call(ANN, Call::Record { name: "../out".into() }).is_err());
    live.call(ANN, Call::Record { name: "grease".into() }).unwrap();
    let twice = live.call(ANN, Call::Record { name: "again".into() }).unwrap_err();
    assert!(matches!(&twice, Error::Busy { what } if what.contains("grease")), "{twice}");
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
    // What comes into force behind the last cycle of a record is not in it.
    while status(&live).cycle <= cycle {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::EndRecord {}).unwrap();
    let now = status(&live);
    assert_eq!((now.recording, now.recorded, now.doing.is_some()), (None, None, true), "the bench goes on");

    let run = entered(&live, 1).remove(0);
    assert_eq!((run.name.as_str(), run.kind.as_str()), ("run 1, grease", "recording"));
    assert_eq!((run.preset.as_str(), run.record.as_deref()), ("clm-bench", Some("run.mf4")));
    let file = project.path().join(&run.folder).join("run.mf4");
    let stored = crate::run::Stored::open(&file).unwrap();
    let replayed = stored.replay(&Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine && replayed.of > 500, "{replayed:?}");
    let record = crate::run::Record::read(&file).unwrap();
    assert!(record.changes.len() >= 3 && record.state.is_some());
    assert_ne!(record.preset.bench.controller, lock(&live.shared.tuning).reference().bench.controller, "14");

    // The same by a call, and what happened in it.
    let again = again(&live, run.number);
    assert_eq!((again.identical, again.fraction), (Some(true), 1.0), "{again:?}");
    assert!(again.sentence.unwrap().contains("every bit is the same"));
    let Answer::Story { happened } = live.call(ANN, Call::Story { number: run.number }).unwrap() else { panic!() };
    let words: Vec<_> = happened.iter().map(|one| one.what.as_str()).collect();
    assert!(
        words[0] == "Begin" && words.iter().any(|words| words.starts_with("Injected: accelerometer-jump")),
        "{words:?}"
    );
    let gain = happened.iter().flat_map(|one| &one.details).any(|line| line.contains("position_gain"));
    assert!(gain, "{happened:?}");
    let none = live.call(ANN, Call::Replay { number: 99 }).unwrap_err();
    assert!(matches!(none, Error::NoRun { number: 99 }), "{none}");

    // On the virtual bench it is the same to the bit, and another with another gain.
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
    assert!(live.call("looks", refused).unwrap_err().to_string().contains("counted by it"));

    // A second one, ended by the end of the bench.
    live.call(ANN, Call::Record { name: "second".into() }).unwrap();
    thread::sleep(Duration::from_millis(100));
    let catalogue = live.shared.catalogue.clone();
    live.stop().unwrap();
    let second = catalogue.runs("second", 9).unwrap().runs.remove(0);
    let file = project.path().join(&second.folder).join("run.mf4");
    assert!(crate::run::Stored::open(&file).unwrap().replay(&Watch::silent()).unwrap().identical());
}

/// A replay to its end.
fn again(live: &Live, number: i64) -> protocol::ReplayProgress {
    loop {
        match live.call("looks", Call::Replay { number }).unwrap() {
            Answer::Replay(again) if again.ended => return again,
            Answer::Replay(again) => assert_eq!((again.run, again.identical), (number, None)),
            other => panic!("{other:?}"),
        }
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn what_is_measured_comes_into_the_catalogue_and_can_be_named() {
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
    assert!(matches!(other, Error::Operated { .. }), "{other}");
    let Answer::Run { run, values } = live.call("bob", Call::Run { number: 1 }).unwrap() else { panic!() };
    assert_eq!((run.name.as_str(), run.note.as_str(), run.tags.len()), ("first", "new grease", 1));
    assert!(values.iter().any(|value| value.path == "bench.tick_rate" && value.number == Some(1000.0)));
    let unrecorded = live.call("bob", Call::Replay { number: 1 }).unwrap_err();
    assert!(unrecorded.to_string().contains("no record"), "{unrecorded}");
    live.call(ANN, Call::DeleteRun { number: 1 }).unwrap();
    assert!(!project.path().join(&run.folder).exists());
    live.call(ANN, Call::RestoreRun { number: 1 }).unwrap();
    assert!(project.path().join(&run.folder).exists());
    live.stop().unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn a_recording_that_cannot_begin_says_why_and_the_bench_goes_on() {
    let (live, project) = live();
    // A file where the folder of runs should be.
    std::fs::write(project.path().join("runs"), "").unwrap();
    let refused = live.call(ANN, Call::Record { name: "grease".into() }).unwrap_err().to_string();
    assert!(refused.contains("runs"), "{refused}");
    std::fs::remove_file(project.path().join("runs")).unwrap();
    assert_eq!(status(&live).recording, None);
    live.call(ANN, Call::Record { name: "grease".into() }).unwrap();
    live.call(ANN, Call::EndRecord {}).unwrap();
    live.stop().unwrap();
}

#[test]
fn a_friction_curve_is_told_while_it_is_measured_and_its_fit_behind() {
    let (live, project) = live();
    let plan: BTreeMap<String, String> = [("slowest", "5"), ("fastest", "40"), ("speeds", "3")]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .into();
    let curve = |run| match live.call("looks", Call::Curve { run }).unwrap() {
        Answer::Curve(curve) => *curve,
        other => panic!("{other:?}"),
    };
    assert_eq!(curve(None), protocol::MeasuredCurve::default());
    let asked = Call::Plan { what: Quantity::Friction, thorough: false, plan: plan.clone() };
    let Answer::Plan(form) = live.call("looks", asked).unwrap() else { panic!("no plan") };
    assert!(form.duration > 0.0 && form.items.iter().any(|item| item.path == "speeds" && item.value == Some(3.0)));
    live.call(ANN, Call::Measure { what: Quantity::Friction, plan, render: false }).unwrap();
    let growing = loop {
        let growing = curve(None);
        if growing.points.len() >= 2 {
            break growing;
        }
        thread::sleep(Duration::from_millis(5));
    };
    assert!(growing.measuring && growing.run.is_none() && !growing.course.is_empty(), "{growing:?}");
    assert_eq!(ended(&live).error, None);
    let measured = curve(None);
    assert_eq!((measured.run, measured.measuring, measured.points.len()), (Some(1), false, 6));
    let fit = measured.fit.as_ref().unwrap();
    // The numbers are those of `stickslip fit` on the same folder.
    let folder = project.path().join("runs/0001-measure-friction");
    let fits = crate::workflow::fit::fit_file(&folder, &Default::default(), false).unwrap();
    assert_eq!(fit.rms, fits.fits[0].fit.rms);
    for (shown, (_, estimate)) in fit.parameters.iter().zip(fits.fits[0].fit.lines()) {
        assert_eq!(shown.value, estimate.written().value);
    }
    assert_eq!(fit.velocity.len(), fit.band.len());
    assert_eq!(curve(Some(1)), measured);
    assert!(live.call("looks", Call::Curve { run: Some(7) }).unwrap_err().to_string().contains("curves"));
    // What a download would change, and nothing of it is in force.
    let values = BTreeMap::from([("model.own.kinetic_torque".to_owned(), "0.17".to_owned())]);
    let Answer::Differences { differences } = live.call("looks", Call::Preview { values }).unwrap() else { panic!() };
    assert_eq!((differences.len(), status(&live).changed), (1, 0));
    let Answer::Machine(machine) = live.call("looks", Call::Machine {}).unwrap() else { panic!("no machine") };
    assert_eq!(machine.speeds[1].factor, 60.0 / std::f64::consts::TAU);
}

#[test]
fn the_friction_that_is_rendered_is_measured_told_and_reported() {
    let (live, project) = live();
    let plan: BTreeMap<String, String> = [("slowest", "10"), ("fastest", "40"), ("speeds", "2")]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .into();
    let measure = |render| Call::Measure { what: Quantity::Friction, plan: plan.clone(), render };
    let rendered = |run| match live.call("looks", Call::Rendered { run }).unwrap() {
        Answer::Rendered(rendered) => *rendered,
        other => panic!("{other:?}"),
    };
    // Nothing is there, nothing moves for what cannot be rendered, and only friction is measured under the law.
    assert_eq!(rendered(None), protocol::RenderedFriction::default());
    assert!(matches!(live.call(ANN, Call::SaveReport {}).unwrap_err(), Error::TooFew { found: 0, .. }));
    let refused = live.call(ANN, measure(true)).unwrap_err();
    assert!(matches!(refused, Error::NotRenderable { .. }), "{refused}");
    let bristles = Call::Measure { what: Quantity::Presliding, plan: BTreeMap::new(), render: true };
    assert!(live.call(ANN, bristles).unwrap_err().to_string().contains("Only the friction curve"));
    assert_eq!((status(&live).state.as_str(), status(&live).doing), ("off", None));

    live.call(ANN, measure(false)).unwrap();
    assert_eq!(ended(&live).error, None);
    let sketch = crate::workflow::sketch::Sketch { nearest: true, speeds: vec![0.0], ..Default::default() };
    let Answer::Drawn(nearest) = live.call("looks", Call::Sketch(sketch)).unwrap() else { panic!("not drawn") };
    let values = crate::fit::PARAMETERS.iter().zip(nearest.desired);
    let values = values.map(|((key, ..), value)| (format!("bench.desired.{key}"), format!("{value:?}"))).collect();
    live.call(ANN, Call::Set { values }).unwrap();
    live.call(ANN, measure(true)).unwrap();
    let growing = loop {
        let growing = rendered(None);
        if growing.measuring && !growing.keys.is_empty() {
            break growing;
        }
        thread::sleep(Duration::from_millis(5));
    };
    assert_eq!((growing.run, growing.figures.len()), (None, 4));
    assert_eq!(ended(&live).error, None);

    let told = rendered(None);
    assert_eq!((told.run, told.measuring, told.figures.len()), (Some(2), false, 4));
    assert!(told.verdict.contains("% of M_S"), "{}", told.verdict);
    let summary = std::fs::read_to_string(project.path().join("runs/0002-render/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let error =
        crate::quantity::Estimate::new(summary["results"]["render.rms_error"]["value"].as_f64().unwrap(), "N m");
    let key = &told.keys[0];
    let (error, number) = (error.written(), |text: &str| text.parse::<f64>().unwrap());
    assert!(!key.half_width.is_empty() && key.unit == error.unit, "{error} {key:?}");
    // The key number is rounded as its uncertainty is.
    assert!((number(&error.value) - number(&key.value)).abs() <= number(&key.half_width), "{error} {key:?}");
    // It is a curve like others, and not the own friction.
    let curves = |live: &Live| match live.call("looks", Call::Curves {}).unwrap() {
        Answer::Curves { curves } => curves.into_iter().map(|name| (name.run, name.rendered)).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    assert_eq!(curves(&live), [(2, true), (1, false)]);
    let Answer::Curve(own) = live.call("looks", Call::Curve { run: None }).unwrap() else { panic!("no curve") };
    assert_eq!((own.run, own.rendered, own.course.is_empty()), (Some(1), false, false));
    let Answer::Curve(again) = live.call("looks", Call::Curve { run: Some(2) }).unwrap() else { panic!("no curve") };
    assert_eq!((again.rendered, again.points.len(), again.course.is_empty()), (true, 4, false));

    let Answer::Report { run, folder } = live.call(ANN, Call::SaveReport {}).unwrap() else { panic!("no report") };
    assert_eq!(run, 3);
    let page = live.report_page(run).unwrap();
    assert_eq!(page, std::fs::read_to_string(Path::new(&folder).join("report.html")).unwrap());
    for part in
        ["Own friction", "Desired friction", "Rendered friction", "figure 12", "figure 13", "figure 14", "cascade"]
    {
        assert!(page.contains(part), "{part}");
    }
    assert!(live.report_page(77).unwrap_err().to_string().contains("no run with a report 77"));
    // A link leads nowhere.
    #[cfg(unix)]
    {
        let link = project.path().join("runs/0009-link");
        std::fs::create_dir(&link).unwrap();
        std::os::unix::fs::symlink(project.path().join("serve-token"), link.join("report.html")).unwrap();
        assert!(live.report_page(9).is_err());
    }
    live.stop();
}

#[test]
fn breakaway_and_presliding_are_told_while_they_are_measured_and_leave_the_friction_curve_alone() {
    let (live, _project) = live();
    let at_rest = |what, run| match live.call("looks", Call::AtRest { what, run }).unwrap() {
        Answer::AtRest(told) => *told,
        other => panic!("{other:?}"),
    };
    let plan = |values: &[(&str, &str)]| -> BTreeMap<String, String> {
        values.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
    };
    let growing = |what, found: &dyn Fn(&protocol::MeasuredAtRest) -> bool| loop {
        let growing = at_rest(what, None);
        if growing.measuring && found(&growing) {
            break growing;
        }
        assert_eq!(status(&live).last.and_then(|last| last.error), None);
        thread::sleep(Duration::from_millis(2));
    };
    assert_eq!(at_rest(Quantity::Breakaway, None), protocol::MeasuredAtRest::default());
    let refused = live.call("looks", Call::AtRest { what: Quantity::Friction, run: None }).unwrap_err();
    assert!(refused.to_string().contains("`curve`"), "{refused}");

    let ramps = |rate| {
        let plan = plan(&[("repetitions", "1"), ("angles", "1"), ("rest_time", "0.05"), ("rate", rate)]);
        Call::Measure { what: Quantity::Breakaway, plan, render: false }
    };
    // Slow: by the clock the control catches the load only some time after it has broken away.
    live.call(ANN, ramps("0.1")).unwrap();
    let first = growing(Quantity::Breakaway, &|told| !told.keys.is_empty());
    assert_eq!((first.run, first.figures.len()), (None, 1));
    assert_eq!(ended(&live).error, None);
    let found = at_rest(Quantity::Breakaway, None);
    assert_eq!((found.run, found.measuring, found.keys.len(), found.figures.len()), (Some(1), false, 3, 1));
    let own: f64 = found.own["model.own.breakaway_torque"].parse().unwrap();
    assert!((own - found.keys[0].value.parse::<f64>().unwrap()).abs() < 0.01, "{found:?}");
    // Another rate: what earlier runs found stands beside it.
    live.call(ANN, ramps("0.15")).unwrap();
    assert_eq!(ended(&live).error, None);
    let found = at_rest(Quantity::Breakaway, None);
    assert_eq!((found.run, found.runs.as_slice(), found.figures.len()), (Some(2), &[2, 1][..], 2));
    assert!(found.figures[1].figure.title().contains("rate of the ramp"));
    assert_eq!(at_rest(Quantity::Breakaway, Some(1)).run, Some(1));
    assert!(live.call("looks", Call::AtRest { what: Quantity::Breakaway, run: Some(9) }).is_err());

    let plan = plan(&[("slow_frequency", "4"), ("slow_cycles", "3")]);
    live.call(ANN, Call::Measure { what: Quantity::Presliding, plan, render: false }).unwrap();
    let before = growing(Quantity::Presliding, &|told| !told.figures.is_empty());
    assert!(before.figures[0].figure.title().contains("friction"), "{before:?}");
    // The friction that comes first is no curve of a run.
    assert!(lock(&live.shared.measured).plateaus.is_empty());
    live.call(ANN, Call::Halt {}).unwrap();
    ended(&live);
    live.stop().unwrap();
}

#[test]
fn missed_deadlines_are_told_with_their_cause() {
    let (live, _project) = live();
    let losses = |live: &Live| match live.call("looks", Call::Losses {}).unwrap() {
        Answer::Losses { lost, overruns } => (lost, overruns),
        other => panic!("{other:?}"),
    };
    let overrun = stickslip_rt::Overrun {
        cycle: 7,
        late: 0,
        by: 2_500_000,
        cause: stickslip_rt::Cause::Block(0),
        evidence: None,
    };
    lock(&live.shared.histograms).overruns.push(overrun);
    lock(&live.shared.losses).push(9, 4, losses::Lost::Watching);
    let (lost, overruns) = losses(&live);
    let told = overruns.iter().find(|one| one.cycle == 7).unwrap();
    assert!(told.count == 3 && told.cause.contains("longer than usual") && told.remedy.contains("doctor"), "{told:?}");
    assert!(lost.iter().any(|one| (one.cycle, one.count) == (9, 4)));
    live.stop().unwrap();
}

#[test]
fn a_preload_is_advised_for_parameters_that_are_not_in_force_yet() {
    let (live, _project) = live();
    let advised = |law: &str| {
        let values = [("bench.law.kind", law), ("bench.desired.breakaway_torque", "0.2")];
        let values = values.map(|(path, value)| (path.to_owned(), value.to_owned())).into();
        match live.call("looks", Call::AdvisePreload { values }).unwrap() {
            Answer::AdvisedPreload(advised) => advised,
            other => panic!("{other:?}"),
        }
    };
    let faded = advised("paper");
    assert!(faded.needed && !faded.by_hand && faded.sentence.contains("two preloads"), "{faded:?}");
    assert!(!advised("bristle").needed);
    live.stop().unwrap();
}
