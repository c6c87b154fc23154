//! A loaded controller on a running bench: trusted, so that a busy machine does not make it late.

use crate::LiveError;
use std::process::Command;
use stickslip_bench::BenchError;
use stickslip_design::DesignError;

use super::*;
use crate::xcp::Layout;
use crate::xcp::a2l::{Doors, describe};
use stickslip_bench::external::{ExternalFile, Role};

/// Compiles the controller of the tests.
fn compile(to: &Path, options: &[&str]) {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bench/src/external");
    let mut compiler = Command::new("cc");
    let compiler = compiler.args(["-O1", "-Wall", "-Werror", "-shared", "-fPIC"]).args(options).arg("-I").arg(&sources);
    let compiler = compiler
        .arg("-o")
        .arg(to)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("../stickslip/tests/laboratory/loaded/tuned.c"));
    assert!(compiler.status().expect("there is a compiler").success());
}

/// A bench with it, its project, and its file.
fn with_controller(values: &[(&str, f64)], record: bool) -> (Live, tempfile::TempDir, PathBuf) {
    let project = tempfile::tempdir().unwrap();
    let path = project.path().join("mine.so");
    compile(&path, &[]);
    let values = values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let loaded = Some(ExternalFile { path: path.clone(), trust: true, values, ..ExternalFile::default() });
    let record = record.then(|| project.path().join("run.mf4"));
    let start = Start { thread_settings: ThreadSettings::PLAIN, loaded, record, ..Start::new(slow(), project.path()) };
    (Live::start(start).unwrap(), project, path)
}

fn item(live: &Live, path: &str) -> Option<protocol::Item> {
    let Answer::Items { items } = live.call("looks", Call::Items { values: Default::default() }).unwrap() else {
        panic!("no items")
    };
    items.into_iter().find(|item| item.path == path)
}

fn value(live: &Live, path: &str) -> f64 {
    item(live, path).and_then(|item| item.value).unwrap_or(f64::NAN)
}

/// Waits for a number of cycles, whatever time a busy machine takes. Returns the status after them.
fn after(live: &Live, cycles: u64) -> Status {
    let begun = status(live).cycle;
    loop {
        let now = status(live);
        if now.cycle >= begun + cycles || now.state == "fault" {
            return now;
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// The torque of the drive, a moment later [N m].
fn torque(live: &Live) -> f64 {
    after(live, 50).drive_torque
}

/// Homes the axis; then it is at rest under control.
fn at_rest(live: &Live) {
    live.call(ANN, Call::Home {}).unwrap();
    assert_eq!(ended(live).error, None);
    live.call(ANN, sine(0.5)).unwrap();
    after(live, 200);
    live.call(ANN, Call::Halt {}).unwrap();
    ended(live);
}

const STIFFNESS: &str = "loaded.stiffness";
const SELECTOR: &str = "position_controller";

/// In the layout for calibration tools, its parameters follow those of every bench and can be changed by address.
fn are_in_the_layout(live: &Live) {
    let (layout, plain) = (Layout::with(1000.0, &live.entries()), Layout::new(1000.0));
    let place = |path: &str| layout.parameters.iter().position(|parameter| parameter.cell.path == path).unwrap();
    assert_eq!((place(SELECTOR), layout.parameters.len()), (plain.parameters.len(), plain.parameters.len() + 4));
    let cell = &layout.parameters[place(STIFFNESS)].cell;
    assert_eq!((cell.unit, cell.minimum, cell.maximum), ("N m/rad", 0.0, 10.0));
    let values = layout.values(&live.entries());
    let mut other = values.clone();
    (other[place(STIFFNESS)], other[place(SELECTOR)]) = (3.0, 0.0);
    let changes = layout.changes(&values, &other, |_| true);
    let expected = [(SELECTOR, "preset"), (STIFFNESS, "3.0")].map(|(path, value)| (path.to_owned(), value.to_owned()));
    assert!(values[place(STIFFNESS)] == 2.0 && expected.iter().all(|change| changes.contains(change)), "{changes:?}");
    let description = describe(&layout, Doors::default());
    assert!(
        description.contains("CHARACTERISTIC loaded.stiffness ") && description.contains("GROUP parameters.loaded ")
    );
    assert_ne!(layout.epk, plain.epk);
}

#[test]
fn the_numbers_of_a_loaded_controller_are_parameters_like_all_others() {
    let (live, project, _) = with_controller(&[("stiffness", 2.0)], true);
    at_rest(&live);
    let loaded = status(&live).loaded.unwrap();
    assert!(loaded.name == "tuned" && loaded.kind == "C library" && loaded.calls > 100 && !loaded.failed, "{loaded:?}");
    assert!(loaded.call[0] > 0.0 && loaded.call[0] < 1e-4 && loaded.response.is_none() && loaded.hash.len() == 64);

    let stiffness = item(&live, STIFFNESS).unwrap();
    assert_eq!((stiffness.value, stiffness.minimum, stiffness.maximum), (Some(2.0), Some(0.0), Some(10.0)));
    assert_eq!((&*stiffness.unit, &*stiffness.help, stiffness.default), ("N·m/rad", "Torque per deviation", Some(1.0)));
    assert_eq!(item(&live, SELECTOR).unwrap().choice.as_deref(), Some("loaded"));

    // It is active at once; friction holds the screw.
    let before = torque(&live);
    let Answer::Entered { differences, .. } = live.call(ANN, set("loaded.bias", "0.05")).unwrap() else { panic!() };
    assert_eq!((differences.len(), differences[0].after.as_deref()), (1, Some("0.05 N m")));
    let after = torque(&live);
    assert!((after - before - 0.05).abs() < 0.02, "{before} {after}");
    assert_eq!((status(&live).changed, status(&live).undo), (1, true));

    are_in_the_layout(&live);

    // Rejected values and values outside of the range change nothing.
    let refused = live.call(ANN, set(STIFFNESS, "7")).unwrap_err();
    assert!(
        matches!(&refused.of(), Some(LiveError::ForeignRefuses { name, code: -2 }) if name == "tuned"),
        "{refused}"
    );
    let outside = live.call(ANN, set(STIFFNESS, "11")).unwrap_err().to_string();
    assert!(outside.contains("loaded.stiffness = 11") && outside.contains("0 … 10 N m/rad"), "{outside}");
    let unknown = live.call(ANN, set("loaded.stifness", "1")).unwrap_err().to_string();
    assert!(unknown.contains("Did you mean loaded.stiffness?"), "{unknown}");
    let word = live.call(ANN, set(STIFFNESS, "stiff")).unwrap_err().to_string();
    assert!(word.contains("a number"), "{word}");
    let invalid = live.call(ANN, set(SELECTOR, "none")).unwrap_err().to_string();
    assert!(invalid.contains("preset") && invalid.contains("loaded"), "{invalid}");
    assert_eq!((value(&live, STIFFNESS), value(&live, "loaded.bias")), (2.0, 0.05));
    assert!((torque(&live) - after).abs() < 0.02, "it continues with the previous values");

    live.call(ANN, Call::Undo {}).unwrap();
    assert!((torque(&live) - before).abs() < 0.02);
    live.call(ANN, Call::Redo {}).unwrap();
    assert_eq!(value(&live, "loaded.bias"), 0.05);

    // The controller of the preset has no bias; new values wait for the start of the loaded one.
    live.call(ANN, set(SELECTOR, "preset")).unwrap();
    let calls = status(&live).loaded.unwrap().calls;
    live.call(ANN, set("loaded.bias", "0.1")).unwrap();
    torque(&live);
    assert!(status(&live).loaded.unwrap().calls <= calls + 1, "it is not called");
    live.call(ANN, set(SELECTOR, "loaded")).unwrap();
    let begun = torque(&live);
    live.call(ANN, set("loaded.bias", "0.05")).unwrap();
    let less = torque(&live);
    assert!((begun - less - 0.05).abs() < 0.02, "it began with 0.1: {begun} {less}");
    // Its sample time was fixed when it was opened.
    let divider = live.call(ANN, set("bench.control_divider", "3")).unwrap_err();
    assert!(matches!(divider.of(), Some(BenchError::NotWhileRunning { .. })), "{divider}");
    live.call(ANN, Call::Reset {}).unwrap();
    assert_eq!((value(&live, "loaded.bias"), status(&live).changed), (0.0, 0));

    live.stop().unwrap();
    let file = project.path().join("run.mf4");
    let words = b"stickslip serve (controller tuned, SHA-256 ";
    assert!(
        std::fs::read(&file).unwrap().windows(words.len()).any(|bytes| bytes == words),
        "the record names the external"
    );
    let replayed =
        stickslip_bench::run::replay(&stickslip_bench::run::Record::read(&file).unwrap(), &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed}");
}

#[test]
fn a_changed_file_is_opened_again() {
    let (live, _project, path) = with_controller(&[], false);
    at_rest(&live);
    live.call(ANN, set(STIFFNESS, "3")).unwrap();
    let first = status(&live).loaded.unwrap();
    assert!(item(&live, "loaded.more").is_none());

    // A compiler replaces the file; overwriting it in place would change the memory of the open library.
    std::fs::remove_file(&path).unwrap();
    compile(&path, &["-DMORE"]);
    live.call(ANN, sine(0.2)).unwrap();
    assert!(
        matches!(live.call(ANN, Call::OpenAgain {}).unwrap_err().of(), Some(LiveError::Busy { what, .. }) if what == "sine")
    );
    live.call(ANN, Call::Halt {}).unwrap();
    ended(&live);
    live.call(ANN, Call::OpenAgain {}).unwrap();
    let second = status(&live).loaded.unwrap();
    assert!(second.hash != first.hash && second.calls < first.calls, "{second:?}");
    assert_eq!((value(&live, STIFFNESS), value(&live, "loaded.more")), (3.0, 0.5));
    live.call(ANN, set("loaded.more", "0.75")).unwrap();
    // For a set from before it was opened again, new parameters have their initial values.
    live.call(ANN, Call::Undo {}).unwrap();
    live.call(ANN, Call::Undo {}).unwrap();
    assert_eq!((value(&live, STIFFNESS), value(&live, "loaded.more")), (1.0, 0.5));

    // An invalid file leaves the open one in place.
    std::fs::remove_file(&path).unwrap();
    std::fs::write(&path, "no library").unwrap();
    let broken = live.call(ANN, Call::OpenAgain {}).unwrap_err();
    assert!(matches!(broken.of(), Some(BenchError::External { .. })), "{broken}");
    assert_eq!(status(&live).loaded.unwrap().hash, second.hash);
    live.call(ANN, set(STIFFNESS, "2")).unwrap();
    live.stop().unwrap();
}

#[test]
fn a_bench_without_an_external_has_none_of_its_parameters() {
    let (live, _project) = live();
    assert!(item(&live, SELECTOR).is_none() && status(&live).loaded.is_none());
    assert!(matches!(live.call(ANN, set(STIFFNESS, "1")).unwrap_err(), Error::UnknownParameter { .. }));
    let none = live.call(ANN, Call::OpenAgain {}).unwrap_err().to_string();
    assert!(none.contains("--controller FILE"), "{none}");
    live.stop().unwrap();
}

#[test]
fn a_loaded_friction_is_rendered_in_its_role_and_the_record_replays_without_it() {
    let project = tempfile::tempdir().unwrap();
    let path = project.path().join("slip.so");
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut compiler = Command::new("cc");
    let compiler =
        compiler.args(["-O1", "-shared", "-fPIC", "-I"]).arg(here.join("../bench/src/external")).arg("-o").arg(&path);
    let compiler = compiler.arg(here.join("../../examples/friction/maxwell_slip.c")).arg("-lm");
    assert!(compiler.status().expect("there is a compiler").success());
    let loaded =
        Some(ExternalFile { path: path.clone(), role: Role::Friction, trust: true, ..ExternalFile::default() });
    let file = project.path().join("run.mf4");
    let start = Start {
        thread_settings: ThreadSettings::PLAIN,
        loaded,
        record: Some(file.clone()),
        ..Start::new(slow(), project.path())
    };
    let live = Live::start(start).unwrap();
    at_rest(&live);
    let loaded = status(&live).loaded.unwrap();
    assert_eq!((&*loaded.role, &*loaded.selector, &*loaded.name), ("friction", "rendered_friction", "Maxwell slip"));
    assert_eq!(item(&live, "rendered_friction").unwrap().choice.as_deref(), Some("loaded"));
    assert!(item(&live, SELECTOR).is_none(), "the position is the preset's");

    // Its torque is that of the load motor, only while it renders.
    let turning = |render| Call::Move {
        reference: "sine".into(),
        values: BTreeMap::from([("amplitude".to_owned(), 3.0), ("frequency".to_owned(), 1.0)]),
        render,
    };
    let moved = |call| {
        live.call(ANN, call).unwrap();
        let calls = after(&live, 400).loaded.unwrap().calls;
        live.call(ANN, Call::Halt {}).unwrap();
        ended(&live);
        calls
    };
    let begun = status(&live).loaded.unwrap().calls;
    assert_eq!((begun, moved(turning(false))), (0, 0));
    let rendered = moved(turning(true));
    assert!(rendered > 200, "in every tick: {rendered}");
    live.call(ANN, set("loaded.kinetic_torque", "0.1")).unwrap();
    assert_eq!(value(&live, "loaded.kinetic_torque"), 0.1);

    // A measurement against the desired friction of the parameters is refused until that is rendered.
    let measure = || Call::Measure { what: Quantity::Friction, plan: BTreeMap::new(), render: true };
    let refused = live.call(ANN, measure()).unwrap_err().to_string();
    assert!(refused.contains("--as friction") && refused.contains("rendered_friction = preset"), "{refused}");
    // The preset can always be selected again, even if its friction cannot be rendered at this tick rate.
    live.call(ANN, set("rendered_friction", "preset")).unwrap();
    assert!(matches!(live.call(ANN, turning(true)).unwrap_err().of(), Some(DesignError::NotRenderable(_))));
    live.call(ANN, set("bench.desired.kinetic_torque", "0.175")).unwrap();
    live.call(ANN, set("bench.desired.stribeck_velocity", "2.8")).unwrap();
    let before = status(&live).loaded.unwrap().calls;
    let preset = moved(turning(true));
    assert!(preset <= before + 1, "it is not called: {before} {preset}");
    live.call(ANN, set("rendered_friction", "loaded")).unwrap();
    let follows = live.call(ANN, set("bench.law.kind", "admittance")).unwrap_err();
    assert!(matches!(follows.of(), Some(BenchError::FollowsNoFriction)), "{follows}");
    assert!(moved(turning(true)) > preset + 200);
    live.stop().unwrap();

    let words = b"stickslip serve (friction Maxwell slip, SHA-256 ";
    assert!(
        std::fs::read(&file).unwrap().windows(words.len()).any(|bytes| bytes == words),
        "the record names the external"
    );
    let record = stickslip_bench::run::Record::read(&file).unwrap();
    std::fs::remove_file(&path).unwrap();
    let replayed = stickslip_bench::run::replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed}");
}
