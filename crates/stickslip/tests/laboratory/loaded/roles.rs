//! External frictions and laws in C on the virtual bench.

use stickslip_core::friction::{Bristles, ElastoPlastic, LuGre};

use super::*;
use stickslip::bench::{Change, Request};
use stickslip::experiment::{FrictionCurve, FrictionPlan, home, measure_friction};
use stickslip::generate::friction_module_of;
use stickslip::load::Loaded;
use stickslip::{LawChoice, Residual, Tracking};

const SLIP: &str = "../../examples/friction/maxwell_slip.c";
const DIFFERENCE: &str = "../../examples/law/difference.c";
/// Duration of the measurement in tests [s]: two speeds of the plan.
const SHORT: f64 = 0.0;

/// On the residual law, which renders at all speeds.
fn residual() -> Preset<f64> {
    let mut preset = preset();
    preset.bench.law = LawChoice::Residual(Residual::default());
    preset
}

fn of(loaded: &Loaded, name: &str) -> f64 {
    loaded.summary().value(name).unwrap_or(f64::NAN)
}

/// Viscous friction until its fault.
fn faulty_friction(folder: &Path, fault: usize) -> PathBuf {
    let numbers = ["-DSTIFFNESS=0.0", "-DDAMPING=-0.01", "-DFRICTION=0.0"];
    compiled(folder, "tests/laboratory/loaded/faults.c", &[&[&*format!("-DFAULT={fault}")], &numbers[..]].concat())
}

#[test]
fn the_friction_of_the_examples_is_rendered_and_its_run_replays_without_it() {
    let folder = tempfile::tempdir().unwrap();
    let library = compiled(folder.path(), SLIP, &[]);
    let run = folder.path().join("run.mf4");
    let external = External::in_own_process(&library, Role::Friction, &here()).unwrap();
    let loaded = load(&residual(), external, 12.0, 3, Some(&run), &Watch::silent()).unwrap();
    println!("{}", loaded.table().lines().join("\n"));
    println!("{}", loaded.remarks().join("\n"));
    assert_eq!(loaded.fault, None);
    assert!(of(&loaded, "rendered.plateaus") >= 4.0, "{}", of(&loaded, "rendered.plateaus"));
    // 3 % of its breakaway torque.
    assert!(of(&loaded, "rendered.largest") < 9e-3, "{}", of(&loaded, "rendered.largest"));
    drop(loaded);
    std::fs::remove_file(library).unwrap();
    let record = Record::read(&run).unwrap();
    let words = b"stickslip load (friction Maxwell slip, SHA-256 ";
    assert!(
        std::fs::read(&run).unwrap().windows(words.len()).any(|bytes| bytes == words),
        "the command names the friction"
    );
    let replayed = replay(&record, &Watch::silent()).unwrap();
    assert!(replayed.identical(), "{replayed}");
}

#[test]
fn a_built_in_friction_as_a_library_is_rendered_as_the_built_in_one() {
    let preset = {
        let mut preset = residual();
        preset.bench.desired.viscous_friction = 0.0;
        preset
    };
    let Bristles { stiffness, damping, fading, elastic_fraction } = preset.bench.desired_bristles;
    let lugre = LuGre { sliding: preset.bench.desired, bristle_stiffness: stiffness, bristle_damping: damping, fading };
    let module = friction_module_of(&ElastoPlastic { lugre, elastic_fraction }, "elasto_plastic", 250e-6).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("elasto_plastic.so");
    std::fs::write(&path, module.library().unwrap()).unwrap();
    let plan = FrictionPlan { slowest: 0.5, speeds: 5.0, ..FrictionPlan::quick() };
    let measured = |external: Option<External>| -> FrictionCurve {
        let mut bench = VirtualBench::new(&preset, 3).unwrap();
        home(&mut bench, &Watch::silent()).unwrap();
        bench.come_to_rest().unwrap();
        match external {
            Some(external) => bench.bring(external).unwrap(),
            None => bench.set_law(stickslip_simulate::rendering_law(&preset.model, &preset.bench).unwrap()).unwrap(),
        }
        measure_friction(&plan, &mut bench, true, &Watch::silent()).unwrap()
    };
    let external = measured(Some(External::trusted(&path, Role::Friction).unwrap()));
    let built_in = measured(None);
    assert!(external.valid().count() == 10 && built_in.valid().count() == 10);
    let largest = external.plateaus.iter().zip(&built_in.plateaus).fold(0.0f64, |most, (a, b)| {
        println!("{:8.3} rad/s: {:.5} {:.5} ± {:.5} N m", a.set_velocity, a.torque, b.torque, b.standard_error);
        most.max((a.torque - b.torque).abs())
    });
    // A tick late, and by the velocity observer instead of the law's: 1.5 % of the breakaway torque.
    assert!(largest < 0.015 * preset.bench.desired.breakaway_torque, "{largest}");
}

#[test]
fn the_law_of_the_examples_renders_as_the_built_in_one() {
    let folder = tempfile::tempdir().unwrap();
    let library = compiled(folder.path(), DIFFERENCE, &[]);
    let external = External::trusted(&library, Role::Law).unwrap();
    let loaded = load(&preset(), external, 12.0, 3, None, &Watch::silent()).unwrap();
    println!("{}", loaded.table().lines().join("\n"));
    println!("{}", loaded.remarks().join("\n"));
    assert_eq!(loaded.fault, None);
    let [external, own] = ["rendered.rms", "own.rms"].map(|name| of(&loaded, name));
    // The same subtraction, a tick later: 1 % of the breakaway torque.
    assert!((external - own).abs() < 3e-3 && of(&loaded, "own.plateaus") >= 4.0, "{external} {own}");
}

#[test]
fn each_fault_of_a_friction_or_a_law_is_named_with_its_role_and_the_bench_continues() {
    let messages = [
        (0, "library crashed (signal 11"),
        (1, "has not answered for 0.200 s"),
        (2, "torque is not finite"),
        (4, "reported a failure (code 7)"),
    ];
    for role in [Role::Friction, Role::Law] {
        for (fault, message) in messages {
            let folder = tempfile::tempdir().unwrap();
            let library = faulty_friction(folder.path(), fault);
            let patience = Duration::from_millis(200);
            let external = External::in_own_process_within(&library, role, &here(), patience).unwrap();
            // The measurement is stopped; `load` homes the bench again afterwards.
            let loaded = load(&residual(), external, SHORT, 1, None, &Watch::silent()).unwrap();
            let reason = loaded.fault.as_deref().unwrap_or("nothing");
            assert!(reason.contains(message) && reason.contains(&format!("the {role}")), "{role} {fault}: {reason}");
            assert!(loaded.summary().value("rendered.rms").is_none());
            // Afterwards the preset's own law renders.
            assert_eq!(loaded.summary().value("own.rms").is_some(), role == Role::Law);
        }
    }
}

#[test]
fn a_failing_friction_is_braked_softly_and_the_preset_renders_again() {
    let folder = tempfile::tempdir().unwrap();
    let preset = residual();
    let mut bench = VirtualBench::new(&preset, 1).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    bench.come_to_rest().unwrap();
    bench.bring(External::trusted(&faulty_friction(folder.path(), 2), Role::Friction).unwrap()).unwrap();
    let angle = bench.step(Order::default()).unwrap().angle;
    let mut traveller = stickslip::bench::SpeedRamp::new(angle, 200.0, preset.bench.tick_time());
    let mut torques = Vec::new();
    let ended = (0..4000).find_map(|_| {
        let order = Order { setpoint: traveller.toward(10.0), control: true, render: true, ..Order::default() };
        bench.step(order).map(|frame| torques.push(frame.command.added_load_torque)).err()
    });
    let reason = ended.map(|error| error.to_string()).unwrap_or_default();
    assert!(reason.contains("the friction's torque is not finite"), "{reason}");
    // Its sample 300 fails, and the brake stops the screw; its torque is active in each tick before except the first.
    let (first, after) = torques.split_at(300);
    assert!(first[0] == 0.0 && first[1..].iter().all(|torque| *torque != 0.0), "{first:?}");
    assert!(first.iter().any(|torque| *torque > 0.01), "it brakes: {first:?}");
    assert!(after.len() > 10 && after.iter().all(|torque| *torque == 0.0), "{}", after.len());
    assert!(bench.take_back(&preset.bench).unwrap().is_some());
    bench.change(Change::Request(Request::Acknowledge)).unwrap();
    home(&mut bench, &Watch::silent()).unwrap();
    let plan = FrictionPlan { slowest: 5.0, fastest: 20.0, speeds: 2.0, ..FrictionPlan::quick() };
    let curve = measure_friction(&plan, &mut bench, true, &Watch::silent()).unwrap();
    let error = curve.rms_from(&preset.bench.desired, |_| true);
    assert!(error < 0.03 * preset.bench.desired.breakaway_torque, "{error}");
}

#[test]
fn a_law_that_follows_a_desired_friction_is_refused_with_an_external_friction() {
    let folder = tempfile::tempdir().unwrap();
    let library = compiled(folder.path(), SLIP, &[]);
    let mut preset = preset();
    preset.bench.law = LawChoice::Admittance(Tracking::default());
    let opened = || External::trusted(&library, Role::Friction).unwrap();
    let refused = load(&preset, opened(), SHORT, 1, None, &Watch::silent()).err().expect("it is refused").to_string();
    assert!(refused.contains("admittance law") && refused.contains("bench.law.kind"), "{refused}");
    // An external law replaces it, and is not refused.
    let mut bench = VirtualBench::new(&preset, 1).unwrap();
    assert!(bench.bring(opened()).is_err());
    bench.bring(External::trusted(&library, Role::Law).unwrap()).unwrap();
}

#[test]
fn a_library_of_an_earlier_version_reads_its_part_of_the_sample() {
    let folder = tempfile::tempdir().unwrap();
    let library = compiled(folder.path(), "tests/laboratory/loaded/before.c", &[]);
    let sample = ModuleSample {
        time: 0.5,
        measured_angle: 2.0,
        measured_velocity: 3.0,
        estimated_velocity: 1e9,
        measured_load_torque: 1e9,
        commanded_torque: 1e9,
        ..ModuleSample::default()
    };
    for role in Role::ALL {
        for mut external in
            [External::trusted(&library, role).unwrap(), External::in_own_process(&library, role, &here()).unwrap()]
        {
            external.begin(1e-3, 1.0).unwrap();
            assert_eq!(external.step(&sample), Ok(0.5 + 2.0 + 3.0), "{role}");
        }
    }
}
