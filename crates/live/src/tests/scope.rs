//! The scope's history, captures and exports on a running bench.

use super::*;
use protocol::Past;
use stickslip_recording::Recording;
use stickslip_recording::samples::{Head, SampledSignal, Samples};

fn samples(rows: u64) -> Samples {
    let signal = |name: &str, unit: &str| SampledSignal { name: name.into(), unit: unit.into(), help: String::new() };
    let cycles: Vec<u64> = (0..rows).map(|row| 5000 + row + row / 100).collect();
    let column = |factor: f64| cycles.iter().map(|&cycle| (factor * cycle as f64).sin()).collect();
    let head =
        Head { rate: 4000.0, trigger: Some(5010), signals: vec![signal("angle", "rad"), signal("slope", "rad/s")] };
    Samples { head, columns: vec![column(1e-3), column(2e-3)], cycles }
}

#[test]
fn the_history_has_the_extremes_of_all_signals_since_the_start() {
    let (live, _project) = live();
    while status(&live).cycle < 2000 {
        thread::sleep(Duration::from_millis(5));
    }
    let past = |signals: &[&str], points| {
        let signals = signals.iter().map(|&name| name.into()).collect();
        live.call("looks", Call::Past { signals, from: 0, to: u64::MAX, points })
    };
    let Answer::Past(found) = past(&["measurement.tacho_voltage", "angle"], 100).unwrap() else { panic!() };
    let Past { oldest, next, finest, block, low, high, .. } = *found;
    assert!(oldest < 1000 && next >= 2000 && (finest, block) == (16, 64), "{oldest} {next} {block}");
    let noise = low[0].iter().zip(&high[0]).filter(|(low, high)| low < high).count();
    assert!(low.len() == 2 && low[0].len() <= 100 && noise > 20, "{noise}");
    assert!(past(&["angel"], 100).unwrap_err().to_string().contains("Did you mean angle"));
    assert!(past(&["angle"], 0).is_err() && past(&[], 10).is_err());
    // Ten minutes at 4 kHz fit into the memory of the history with all signals.
    let width = stickslip_bench::run::channels().len();
    let blocks = (128 << 20) * 3 / 4 / (width * 8);
    assert!(blocks * 16 > 600 * 4000, "{width} signals");
}

#[test]
fn a_capture_is_a_run_that_can_be_read_again_after_a_restart() {
    let project = tempfile::tempdir().unwrap();
    let start = || {
        let new = Start::new(slow(), project.path());
        Live::start(Start { thread_settings: ThreadSettings::PLAIN, ..new }).unwrap()
    };
    let live = start();
    let bytes = samples(250).to_bytes();
    let number = live.keep_samples("single shot, angle rises through 1", &bytes).unwrap();
    assert!(live.keep_samples("  ", &bytes).is_err() && live.keep_samples("x", &bytes[..99]).is_err());
    live.stop().unwrap();
    let live = start();
    let Answer::Runs { runs, .. } = live.call("looks", Call::Runs { query: "kind:capture".into(), limit: 9 }).unwrap()
    else {
        panic!()
    };
    let run = &runs[0];
    assert_eq!((runs.len(), run.number, run.kind.as_str()), (1, number, "capture"));
    assert!(run.name.ends_with("single shot, angle rises through 1") && run.record.is_none(), "{run:?}");
    assert_eq!(live.kept_samples(number).unwrap(), bytes);
    assert!(live.kept_samples(number + 1).is_err());
}

#[test]
fn samples_are_exported_for_other_programs() {
    let (live, _project) = live();
    let samples = samples(250);
    for kind in ["mf4", "parquet", "mat", "csv"] {
        let mut file = live.export_samples(&samples.to_bytes(), kind, &Watch::silent()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("scope.{kind}"));
        std::io::copy(&mut file, &mut std::fs::File::create(&path).unwrap()).unwrap();
        let read = Recording::read(&path).unwrap();
        assert_eq!(read.column("slope").unwrap().values, samples.columns[1], "{kind}");
        let time = &read.column("time").unwrap().values;
        assert!((time[200] - 5202.0 / 4000.0).abs() < 1e-12, "{kind}: {}", time[200]);
    }
    assert!(live.export_samples(&samples.to_bytes(), "../x", &Watch::silent()).is_err());
}

#[test]
fn the_signals_around_a_fault_are_saved_with_its_cycle() {
    let (live, _project) = live();
    live.call(ANN, Call::Home {}).unwrap();
    ended(&live);
    live.call(ANN, sine(0.5)).unwrap();
    while status(&live).doing.is_none_or(|doing| doing.stage != "moving") {
        thread::sleep(Duration::from_millis(5));
    }
    while status(&live).cycle < 2500 {
        thread::sleep(Duration::from_millis(5));
    }
    live.call(ANN, Call::Inject { fault: "controller-nan".into() }).unwrap();
    let fault = loop {
        match status(&live).fault {
            Some(fault) if fault.capture.is_some() => break fault,
            _ => thread::sleep(Duration::from_millis(5)),
        }
    };
    let bytes = live.kept_samples(fault.capture.unwrap()).unwrap();
    let samples = Samples::read(&bytes).unwrap();
    assert_eq!(samples.head.trigger, Some(fault.cycle));
    let (first, last) = (samples.cycles[0], *samples.cycles.last().unwrap());
    // At 1 kHz: at least 2 s before, and 0.5 s after the standstill.
    assert!(first + 2000 <= fault.cycle && last >= fault.cycle + 500, "{first} {} {last}", fault.cycle);
    let state = samples.head.signals.iter().position(|signal| signal.name == "state").unwrap();
    let at = samples.cycles.iter().position(|&cycle| cycle == fault.cycle).unwrap();
    let states = &samples.columns[state];
    assert_eq!((states[at - 1], *states.last().unwrap()), (3.0, 4.0), "running before, fault at the end");
    let Answer::Run { run, .. } = live.call("looks", Call::Run { number: fault.capture.unwrap() }).unwrap() else {
        panic!()
    };
    assert!(run.name.ends_with("fault, output not finite"), "{}", run.name);
}
