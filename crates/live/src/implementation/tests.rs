use std::collections::BTreeMap;
#[cfg(unix)]
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use stickslip_rt::ThreadSettings;

use super::*;
#[cfg(unix)]
use crate::LiveError;
use crate::protocol::Call;
use crate::{Live, Start};
use stickslip_base::parameters::{self, presets};
use stickslip_bench::run::channels;

fn live() -> (Live, tempfile::TempDir) {
    let mut source = presets::find("clm-bench").unwrap();
    source.text = parameters::set::<stickslip_base::Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000").unwrap();
    let project = tempfile::tempdir().unwrap();
    let start = Start { thread_settings: ThreadSettings::PLAIN, ..Start::new(source, project.path()) };
    (Live::start(start).unwrap(), project)
}

fn flow(live: &Live) -> Flow {
    let Answer::Flow(flow) = live.call("ann", Call::Flow {}).unwrap() else { panic!("a flow") };
    *flow
}

fn set(live: &Live, path: &str, value: &str) {
    live.call("ann", Call::Set { values: BTreeMap::from([(path.into(), value.into())]) }).unwrap();
}

#[test]
fn wires_carry_signals_of_the_bench_from_block_to_block() {
    let (live, _project) = live();
    let flow = flow(&live);
    let signals = channels();
    let block = |id: &str| flow.blocks.iter().find(|block| block.id == id).unwrap_or_else(|| panic!("no block {id}"));
    for wire in &flow.wires {
        assert!(signals.iter().any(|signal| signal.path == wire.signal), "{}", wire.signal);
        let on_edge = |id: &str, [x, y]: [f64; 2]| {
            let [left, top, width, height] = block(id).at;
            let across = (left..=left + width).contains(&x) && (top..=top + height).contains(&y);
            across && (x == left || x == left + width || y == top || y == top + height)
        };
        assert!(on_edge(&wire.to, *wire.points.last().unwrap()), "{} to {}", wire.signal, wire.to);
        assert!(wire.label.is_none() || on_edge(&wire.from, wire.points[0]), "{} from {}", wire.signal, wire.from);
        assert!(wire.points.windows(2).all(|pair| pair[0][0] == pair[1][0] || pair[0][1] == pair[1][1]), "{wire:?}");
    }
    let items = parameters::flatten(&live.in_force());
    for group in flow.blocks.iter().flat_map(|block| &block.groups) {
        assert!(items.iter().any(|item| parameters::within(&item.path, &group.path)), "{}", group.path);
    }
    // Each block of the software with its own function has its own page.
    for id in ["controller", "observer", "law", "decoder", "current"] {
        let page = block(id).page.clone().unwrap();
        assert_ne!(page, "tick.svg", "{id}");
        let Answer::DiagramPage(page) = live.call("ann", Call::DiagramPage { page }).unwrap() else { panic!("a page") };
        assert!(page.svg.contains("<svg") && page.code.contains("_step("), "{id}");
        assert!(page.size.operations > 3 && page.size.lines > 5, "{id}: {:?}", page.size);
    }
    let refused = live.call("ann", Call::DiagramPage { page: "none.svg".into() }).unwrap_err().to_string();
    assert!(refused.contains("tick.svg"), "{refused}");
    live.stop();
}

#[test]
fn the_diagram_shows_the_active_choices_and_marks_changed_parameters() {
    let (live, _project) = live();
    let block = |id: &str| flow(&live).blocks.into_iter().find(|block| block.id == id).unwrap();
    assert_eq!((block("controller").choice.as_str(), block("controller").changed.len()), ("cascade", 0));
    set(&live, "bench.controller.position_gain", "12");
    assert_eq!(block("controller").changed, ["bench.controller.position_gain"]);
    set(&live, "bench.controller.kind", "pid");
    assert_eq!(block("controller").choice, "pid");
    for law in ["bristle", "smooth"] {
        set(&live, "bench.law.kind", law);
        assert_eq!(block("law").choice, law);
        assert_ne!(block("law").page.as_deref(), Some("tick.svg"), "{law}");
    }
    live.stop();
}

#[test]
fn downloaded_files_are_those_of_the_running_software() {
    let (live, _project) = live();
    set(&live, "bench.controller.position_gain", "12.5");
    let source = String::from_utf8(live.implementation_file("tick.c").unwrap()).unwrap();
    assert!(source.contains("position_gain = 12.5;"));
    assert!(live.implementation_file("tick.zip").unwrap().starts_with(b"PK"));
    assert!(live.implementation_file("bench.a2l").unwrap().starts_with(b"ASAP2_VERSION"));
    assert!(live.implementation_file("diagram/tick.svg").unwrap().starts_with(b"<svg"));
    let refused = live.implementation_file("../secret").unwrap_err().to_string();
    assert!(refused.contains("tick.zip"), "{refused}");
    live.stop();
}

#[test]
fn the_time_of_each_cycle_is_in_a_bar() {
    let (live, _project) = live();
    let timing = || {
        let Answer::Timing(timing) = live.call("ann", Call::Timing {}).unwrap() else { panic!("times") };
        *timing
    };
    while timing().cycles < 20 {
        thread::sleep(Duration::from_millis(5));
    }
    let timing = timing();
    assert_eq!(timing.bins.iter().map(|bin| bin.count).sum::<u64>(), timing.cycles);
    let names: Vec<&str> = timing.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["lateness", "whole cycle", "commands", "software", "machine", "frames"]);
    assert_eq!(timing.period, 1e-3);
    let Answer::Target(target) = live.call("ann", Call::Target {}).unwrap() else { panic!("a target") };
    assert_eq!((target.machine.as_str(), target.rate), ("virtual", 1000.0));
    for file in &target.files {
        assert!(!live.implementation_file(&file.file).unwrap().is_empty(), "{}", file.file);
    }
    assert!(target.since > 1.7e9 && !target.thread_settings.is_empty());
    live.stop();
}

#[cfg(unix)]
fn generated() -> Arc<Generated> {
    let preset = presets::find("clm-bench").unwrap().read::<stickslip_base::Preset<f64>>().unwrap();
    Arc::new(generate::generate("tick", &preset, generate::Precision::Double, None).unwrap())
}

#[cfg(unix)]
fn built(mut builder: Builder, cancel: bool) -> BuildProgress {
    let folder = tempfile::tempdir().unwrap();
    builder.begin(generated(), folder.path()).unwrap();
    if cancel {
        let busy = builder.begin(generated(), folder.path()).unwrap_err();
        assert!(matches!(busy.of(), Some(LiveError::Busy { .. })), "{busy}");
        builder.cancel();
    }
    loop {
        let progress = builder.progress();
        if !matches!(progress.stage, BuildStage::Compiling | BuildStage::Testing) {
            return progress;
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// A script in place of the compiler.
#[cfg(unix)]
fn script(folder: &tempfile::TempDir, text: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt as _;
    let path = folder.path().join("compiler");
    std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path
}

#[cfg(unix)]
#[test]
fn the_compiled_software_agrees_with_the_model_bit_for_bit() {
    let built = built(Builder::default(), false);
    assert_eq!(built.stage, BuildStage::Passed, "{}\n{}", built.sentence, built.log);
    assert!(built.seconds.is_some() && built.log.contains("tick_selftest.c"), "{}", built.log);
}

#[cfg(unix)]
#[test]
fn an_error_is_shown_with_its_block() {
    let folder = tempfile::tempdir().unwrap();
    let generated = generated();
    let source = generated.text("tick.c").unwrap();
    let line = 3 + source.lines().position(|line| line.starts_with("static void tick_decoder_step(")).unwrap();
    let compiler = script(&folder, &format!("echo \"tick.c:{line}:5: error: no such thing\" >&2; exit 1"));
    let built = built(Builder::by(&compiler, Duration::from_secs(60)), false);
    assert_eq!((built.stage, built.errors.len()), (BuildStage::Failed, 1), "{}", built.log);
    let error = &built.errors[0];
    assert_eq!((error.block.as_str(), error.page.as_deref()), ("Decoder", Some("tick.decoder.svg")));
    assert_eq!((error.place.clone(), error.text.as_str()), (format!("tick.c:{line}"), "no such thing"));
}

#[cfg(unix)]
#[test]
fn a_missing_or_endless_compiler_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let missing = built(Builder::by(&folder.path().join("none"), Duration::from_secs(60)), false);
    assert_eq!(missing.stage, BuildStage::NoCompiler);
    assert!(missing.sentence.contains("CC"), "{}", missing.sentence);
    let compiler = script(&folder, "exec sleep 60");
    let slow = built(Builder::by(&compiler, Duration::from_millis(50)), false);
    assert_eq!(slow.stage, BuildStage::Failed);
    assert!(slow.sentence.contains("longer than 0.05 s"), "{}", slow.sentence);
    let cancelled = built(Builder::by(&compiler, Duration::from_secs(60)), true);
    assert_eq!(cancelled.stage, BuildStage::Cancelled);
}
