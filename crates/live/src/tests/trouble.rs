//! Faults, and the reports of the bench.

use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use stickslip_bench::remote::{Address, PlantServer};

/// A machine in another thread, as served by `stickslip plant`, until it is stopped.
struct Plant {
    stop: Arc<AtomicBool>,
    serving: JoinHandle<()>,
}

impl Plant {
    fn serve(address: &Address, source: &Source) -> Self {
        let mut server = PlantServer::bind(address, &source.read().unwrap(), 1).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let watch = Watch::new(stop.clone(), |_, _| {});
        Plant { stop, serving: thread::spawn(move || drop(server.serve(false, &watch))) }
    }

    fn kill(self) {
        self.stop.store(true, Ordering::Relaxed);
        self.serving.join().unwrap();
    }
}

#[test]
fn the_loss_and_return_of_a_remote_machine_are_reported_and_the_bench_continues() {
    let project = tempfile::tempdir().unwrap();
    let mut source = presets::find("clm-bench").unwrap();
    // Far longer than the delays of a busy machine.
    for (path, value) in [("bench.tick_rate", "1000"), ("bench.safety.missed_ticks", "500")] {
        source.text = parameters::set::<stickslip_base::Preset<f64>>(&source.text, "t", path, value).unwrap();
    }
    let address = Address::Shm(project.path().join("axis").display().to_string());
    let plant = Plant::serve(&address, &source);
    let (io, record) = (Some(address.clone()), Some(project.path().join("run.mf4")));
    let (folder, thread_settings) = (project.path().join("project"), ThreadSettings::PLAIN);
    let live = Live::start(Start { io, thread_settings, record, ..Start::new(source.clone(), &folder) }).unwrap();
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
    // While it is gone the fault returns; cycles continue.
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
    // The whole run replays bit for bit.
    let replayed = stickslip_bench::run::replay(
        &stickslip_bench::run::Record::read(&project.path().join("run.mf4")).unwrap(),
        &Watch::silent(),
    );
    let replayed = replayed.unwrap();
    assert!(replayed.identical() && !replayed.machine, "{replayed:?}");
}

#[test]
fn a_silent_operator_stops_the_axis_and_an_active_one_does_not() {
    let project = tempfile::tempdir().unwrap();
    let mut source = presets::find("clm-bench").unwrap();
    source.text = parameters::set::<stickslip_base::Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000").unwrap();
    let start = |operator_time| {
        let new = Start::new(source.clone(), project.path());
        Live::start(Start { thread_settings: ThreadSettings::PLAIN, operator_time: Some(operator_time), ..new })
    };
    for nonsense in [0.0, -1.0, f64::NAN, 1e9] {
        assert!(matches!(start(nonsense), Err(Error::OutOfRange { .. })), "{nonsense}");
    }
    let live = start(1.0).unwrap();
    live.call(ANN, Call::Home {}).unwrap();
    let poll = |live: &Live| live.call(ANN, Call::Sets {}).map(drop).unwrap();
    while status(&live).doing.is_some() {
        poll(&live);
        thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(status(&live).last.unwrap().error, None);
    live.call(ANN, sine(0.2)).unwrap();
    let begun = std::time::Instant::now();
    while begun.elapsed() < Duration::from_secs(2) {
        poll(&live);
        assert!(status(&live).doing.is_some());
        thread::sleep(Duration::from_millis(5));
    }
    // Calls of other clients do not count.
    let why = ended(&live).error.unwrap();
    assert!(why.contains("silent for more than 1 s"), "{why}");
    while status(&live).state != "ready" {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::Start {}).unwrap();
}

#[test]
fn an_injected_fault_stops_the_axis_and_is_replayed() {
    let (live, project) = live_into(|project| Some(project.join("run.mf4")));
    live.call(ANN, Call::Home {}).unwrap();
    ended(&live);
    live.call(ANN, sine(0.5)).unwrap();
    while status(&live).doing.is_none_or(|doing| doing.stage != "moving") {
        thread::sleep(Duration::from_millis(5));
    }
    let refused = |fault: &str| live.call(ANN, Call::Inject { fault: fault.into() }).unwrap_err().to_string();
    let unknown = refused("encoder-stick");
    assert!(unknown.contains("\"encoder-stick\"") && unknown.contains("encoder-stuck"), "{unknown}");
    assert!(refused("counts-lost=7").contains("counts-lost"));
    live.call(ANN, Call::Inject { fault: "encoder-stuck".into() }).unwrap();
    while status(&live).state != "fault" {
        thread::sleep(Duration::from_millis(5));
    }
    assert!(status(&live).reason.is_some());
    live.stop();
    let path = project.path().join("run.mf4");
    let replayed = stickslip_bench::run::Stored::open(&path).unwrap().replay(&Watch::silent()).unwrap();
    assert!(replayed.identical() && replayed.machine, "{replayed:?}");
    // An existing record is not overwritten.
    let source = presets::find("clm-bench").unwrap();
    let again = Live::start(Start { record: Some(path), ..Start::new(source, project.path()) }).err().unwrap();
    assert!(again.to_string().contains("run.mf4"), "{again}");
}

#[test]
fn missed_deadlines_are_reported_with_their_cause() {
    let (live, _project) = live();
    let losses = |live: &Live| match live.call("looks", Call::Losses {}).unwrap() {
        Answer::Losses { lost, held } => (lost, held),
        other => panic!("{other:?}"),
    };
    let overrun = stickslip_rt::Overrun {
        cycle: 7,
        late: 0,
        by: 2_500_000,
        cause: stickslip_rt::Cause::Block(0),
        evidence: None,
    };
    live.shared.health.add_overrun(overrun);
    live.shared.health.lost(9, 4, health::Lost::Watching);
    live.shared.health.lost(6, 2, health::Lost::Waiting);
    let (lost, held) = losses(&live);
    let late = held.iter().find(|one| one.cycle == 7).unwrap();
    assert!(late.count == 3 && late.cause.contains("longer than usual") && late.remedy.contains("doctor"), "{late:?}");
    let waited = held.iter().find(|one| one.cycle == 6).unwrap();
    assert!(
        waited.count == 2 && waited.cause.contains("virtual machine waited") && !waited.remedy.is_empty(),
        "{waited:?}"
    );
    assert!(held.is_sorted_by_key(|one| one.cycle));
    assert!(lost.iter().any(|one| (one.cycle, one.count) == (9, 4)));
    live.stop().unwrap();
}
