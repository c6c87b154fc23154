//! A controller that was loaded, on a bench that runs: trusted, so that no busy machine makes it late.

use std::process::Command;

use super::*;
use crate::foreign::ControllerFile;
use crate::xcp::Layout;
use crate::xcp::a2l::{Doors, describe};

/// Compiles the controller of the tests.
fn compile(to: &Path, options: &[&str]) {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/foreign");
    let mut compiler = Command::new("cc");
    let compiler = compiler.args(["-O1", "-Wall", "-Werror", "-shared", "-fPIC"]).args(options).arg("-I").arg(&sources);
    let compiler = compiler.arg("-o").arg(to).arg(sources.join("tests/tuned.c"));
    assert!(compiler.status().expect("there is a compiler").success());
}

/// A bench with it, its project, and its file.
fn with_controller(values: &[(&str, f64)], record: bool) -> (Live, tempfile::TempDir, PathBuf) {
    let project = tempfile::tempdir().unwrap();
    let path = project.path().join("mine.so");
    compile(&path, &[]);
    let mut source = presets::find("clm-bench").unwrap();
    let settings = [("bench.tick_rate", "1000"), ("bench.safety.following_error", "50")];
    source.text = parameters::set_all::<crate::Preset<f64>>(&source.text, "t", &settings).unwrap();
    let values = values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let controller = Some(ControllerFile { path: path.clone(), trust: true, values, ..ControllerFile::default() });
    let record = record.then(|| project.path().join("run.mf4"));
    let start = Start { wishes: Wishes::PLAIN, controller, record, ..Start::new(source, project.path()) };
    (Live::start(start).unwrap(), project, path)
}

fn item(live: &Live, path: &str) -> Option<protocol::Item> {
    let Answer::Items { items } = live.call("looks", Call::Items {}).unwrap() else { panic!("no items") };
    items.into_iter().find(|item| item.path == path)
}

fn value(live: &Live, path: &str) -> f64 {
    item(live, path).and_then(|item| item.value).unwrap_or(f64::NAN)
}

/// The torque of the drive, a moment later [N m].
fn torque(live: &Live) -> f64 {
    let cycle = status(live).cycle;
    loop {
        let now = status(live);
        if now.cycle > cycle + 50 {
            return now.drive_torque;
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// Homes it; at rest under control.
fn at_rest(live: &Live) {
    live.call(ANN, Call::Home {}).unwrap();
    assert_eq!(ended(live).error, None);
    live.call(ANN, sine(0.5)).unwrap();
    thread::sleep(Duration::from_millis(200));
    live.call(ANN, Call::Halt {}).unwrap();
    ended(live);
}

const STIFFNESS: &str = "loaded.stiffness";
const WHO: &str = "position_controller";

#[test]
fn the_numbers_of_a_loaded_controller_are_parameters_like_all_others() {
    let (live, project, _) = with_controller(&[("stiffness", 2.0)], true);
    at_rest(&live);
    let loaded = status(&live).controller.unwrap();
    assert!(loaded.name == "tuned" && loaded.kind == "C library" && loaded.calls > 100 && !loaded.failed, "{loaded:?}");
    assert!(loaded.call[0] > 0.0 && loaded.call[0] < 1e-4 && loaded.response.is_none() && loaded.hash.len() == 64);

    let stiffness = item(&live, STIFFNESS).unwrap();
    assert_eq!((stiffness.value, stiffness.minimum, stiffness.maximum), (Some(2.0), Some(0.0), Some(10.0)));
    assert_eq!((&*stiffness.unit, &*stiffness.help, stiffness.default), ("N·m/rad", "Torque per deviation", Some(1.0)));
    assert_eq!(item(&live, WHO).unwrap().choice.as_deref(), Some("loaded"));

    // It is in force at once: friction holds the screw.
    let before = torque(&live);
    let Answer::Entered { differences, .. } = live.call(ANN, set("loaded.bias", "0.05")).unwrap() else { panic!() };
    assert_eq!((differences.len(), differences[0].after.as_deref()), (1, Some("0.05 N m")));
    let after = torque(&live);
    assert!((after - before - 0.05).abs() < 0.02, "{before} {after}");
    assert_eq!((status(&live).changed, status(&live).undo), (1, true));

    // A calibration tool finds them behind all that every bench has, and changes them by their addresses.
    let (layout, plain) = (Layout::with(1000.0, &live.entries()), Layout::new(1000.0));
    let place = |path: &str| layout.parameters.iter().position(|parameter| parameter.cell.path == path).unwrap();
    assert_eq!((place(WHO), layout.parameters.len()), (plain.parameters.len(), plain.parameters.len() + 4));
    let cell = &layout.parameters[place(STIFFNESS)].cell;
    assert_eq!((cell.unit, cell.minimum, cell.maximum), ("N m/rad", 0.0, 10.0));
    let values = layout.values(&live.entries());
    let mut other = values.clone();
    (other[place(STIFFNESS)], other[place(WHO)]) = (3.0, 0.0);
    let changes = layout.changes(&values, &other, |_| true);
    let expected = [(WHO, "preset"), (STIFFNESS, "3.0")].map(|(path, value)| (path.to_owned(), value.to_owned()));
    assert!(values[place(STIFFNESS)] == 2.0 && expected.iter().all(|change| changes.contains(change)), "{changes:?}");
    let description = describe(&layout, Doors::default());
    assert!(
        description.contains("CHARACTERISTIC loaded.stiffness ") && description.contains("GROUP parameters.loaded ")
    );
    assert_ne!(layout.epk, plain.epk);

    // What it refuses, and what is outside of its range, changes nothing.
    let refused = live.call(ANN, set(STIFFNESS, "7")).unwrap_err();
    assert!(matches!(&refused, Error::ForeignRefuses { name, code: -2 } if name == "tuned"), "{refused}");
    let outside = live.call(ANN, set(STIFFNESS, "11")).unwrap_err().to_string();
    assert!(outside.contains("loaded.stiffness = 11") && outside.contains("0 … 10 N m/rad"), "{outside}");
    let unknown = live.call(ANN, set("loaded.stifness", "1")).unwrap_err().to_string();
    assert!(unknown.contains("Did you mean loaded.stiffness?"), "{unknown}");
    let word = live.call(ANN, set(STIFFNESS, "stiff")).unwrap_err().to_string();
    assert!(word.contains("a number"), "{word}");
    let whom = live.call(ANN, set(WHO, "nobody")).unwrap_err().to_string();
    assert!(whom.contains("preset") && whom.contains("loaded"), "{whom}");
    assert_eq!((value(&live, STIFFNESS), value(&live, "loaded.bias")), (2.0, 0.05));
    assert!((torque(&live) - after).abs() < 0.02, "it goes on with what it had");

    live.call(ANN, Call::Undo {}).unwrap();
    assert!((torque(&live) - before).abs() < 0.02);
    live.call(ANN, Call::Redo {}).unwrap();
    assert_eq!(value(&live, "loaded.bias"), 0.05);

    // The controller of the preset knows no bias; meanwhile values wait for the other's begin.
    live.call(ANN, set(WHO, "preset")).unwrap();
    let calls = status(&live).controller.unwrap().calls;
    live.call(ANN, set("loaded.bias", "-0.05")).unwrap();
    torque(&live);
    assert!(status(&live).controller.unwrap().calls <= calls + 1, "nobody asks it");
    live.call(ANN, set(WHO, "loaded")).unwrap();
    assert!((torque(&live) - before + 0.05).abs() < 0.02, "{before} {}", torque(&live));
    // Its samples are those that it was opened for.
    let divider = live.call(ANN, set("bench.control_divider", "3")).unwrap_err();
    assert!(matches!(divider, Error::NotWhileRunning { .. }), "{divider}");
    live.call(ANN, Call::Reset {}).unwrap();
    assert_eq!((value(&live, "loaded.bias"), status(&live).changed), (0.0, 0));

    live.stop().unwrap();
    let file = project.path().join("run.mf4");
    let words = b"stickslip serve (tuned, SHA-256 ";
    assert!(std::fs::read(&file).unwrap().windows(words.len()).any(|bytes| bytes == words), "it tells whose torques");
    let replayed = crate::run::replay(&crate::run::Record::read(&file).unwrap(), &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed}");
}

#[test]
fn a_file_that_has_become_another_is_opened_again() {
    let (live, _project, path) = with_controller(&[], false);
    at_rest(&live);
    live.call(ANN, set(STIFFNESS, "3")).unwrap();
    let first = status(&live).controller.unwrap();
    assert!(item(&live, "loaded.more").is_none());

    // A compiler replaces the file; one that is written over in place would be another's memory.
    std::fs::remove_file(&path).unwrap();
    compile(&path, &["-DMORE"]);
    live.call(ANN, sine(0.2)).unwrap();
    assert!(matches!(live.call(ANN, Call::OpenController {}).unwrap_err(), Error::Busy { what } if what == "sine"));
    live.call(ANN, Call::Halt {}).unwrap();
    ended(&live);
    live.call(ANN, Call::OpenController {}).unwrap();
    let second = status(&live).controller.unwrap();
    assert!(second.hash != first.hash && second.calls < first.calls, "{second:?}");
    assert_eq!((value(&live, STIFFNESS), value(&live, "loaded.more")), (3.0, 0.5));
    live.call(ANN, set("loaded.more", "0.75")).unwrap();
    // A set from before it knows no more of it than its begin.
    live.call(ANN, Call::Undo {}).unwrap();
    live.call(ANN, Call::Undo {}).unwrap();
    assert_eq!((value(&live, STIFFNESS), value(&live, "loaded.more")), (1.0, 0.5));

    // One that is no controller leaves the one that is there.
    std::fs::remove_file(&path).unwrap();
    std::fs::write(&path, "no library").unwrap();
    let broken = live.call(ANN, Call::OpenController {}).unwrap_err();
    assert!(matches!(broken, Error::Foreign { .. }), "{broken}");
    assert_eq!(status(&live).controller.unwrap().hash, second.hash);
    live.call(ANN, set(STIFFNESS, "2")).unwrap();
    live.stop().unwrap();
}

#[test]
fn a_bench_without_one_has_none_of_its_parameters() {
    let (live, _project) = live();
    assert!(item(&live, WHO).is_none() && status(&live).controller.is_none());
    assert!(matches!(live.call(ANN, set(STIFFNESS, "1")).unwrap_err(), Error::UnknownParameter { .. }));
    let none = live.call(ANN, Call::OpenController {}).unwrap_err().to_string();
    assert!(none.contains("--controller FILE"), "{none}");
    live.stop().unwrap();
}
