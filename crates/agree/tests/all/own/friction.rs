//! A friction model in one file of Rust becomes C, FMU, A2L and a library on a served bench.

#[path = "../../../../stickslip/examples/own_friction.rs"]
mod own_friction;

use std::process::Command;

use own_friction::HessSoom;
use stickslip::external::{External, ModuleSample, Role};
use stickslip::generate::{Variables, Version, friction_module_of, own_friction};
use stickslip_core::friction::{Bend, Bristle as _, advance};

use super::served::Served;

#[test]
fn it_slides_on_its_curve() {
    let model = HessSoom::<f64>::default();
    for velocity in [-8.0, -0.5, 1.5, 4.0] {
        let (mut deflection, mut torque) = (0.0, 0.0);
        for _ in 0..20_000 {
            (deflection, torque) = advance(&model, Bend { deflection, probe: deflection, velocity, dt: 50e-6 });
        }
        let level = model.sliding(f64::abs(velocity));
        // One second is a thousand times the slowest rise of the bristles.
        assert!((torque - level.copysign(velocity)).abs() < 1e-9, "{torque} at {velocity}, level {level}");
    }
    assert_eq!(model.sliding(1.5), 0.24, "half of the drop");
}

#[test]
fn its_c_code_gives_its_bits_and_it_has_an_fmu_and_a_description() {
    let code = own_friction(&HessSoom::<f64>::default(), "hess_soom", 50e-6).expect("a valid name in C");
    let project_files = code.generated(false);
    let folder = tempfile::tempdir().expect("a temporary folder");
    project_files.write(folder.path()).expect("a writable folder");
    // The self-test compares stored steps bit by bit.
    let main = "#include \"hess_soom_selftest.h\"\nint main(void) { return hess_soom_selftest() != 0; }\n";
    std::fs::write(folder.path().join("main.c"), main).expect("a writable folder");
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Werror", "-o", "selftest", "main.c"]);
    compiler.args(["hess_soom.c", "hess_soom_selftest.c", "-lm"]).current_dir(folder.path());
    assert!(compiler.status().expect("there is a compiler").success());
    let status = Command::new(folder.path().join("selftest")).status().expect("it starts");
    assert!(status.success(), "the self-test reports a difference");
    let described = code.description(&Variables::default()).expect("a description without a linked program");
    assert!(described.parameters == 5 && described.text.contains("parameters.drop_velocity"), "{described:?}");
    assert!(code.fmu(Version::Two).expect("a C compiler").variables > 5);
}

#[test]
fn as_a_library_on_a_served_bench_it_is_in_selector_form_scope_and_description() {
    let project = tempfile::tempdir().expect("a temporary folder");
    let module = friction_module_of(&HessSoom::<f64>::default(), "hess_soom", 1e-3).expect("a valid name in C");
    let served = Served::with(module.library().expect("a C compiler"), Role::Friction, project.path());
    let mut library = External::trusted(&served.library, Role::Friction).expect("a library of five functions");
    library.begin(50e-6, 1.0).expect("it begins");
    let sliding = ModuleSample { estimated_velocity: -1.5, ..ModuleSample::default() };
    let torque = (0..20_000).fold(0.0, |_, _| library.step(&sliding).expect("a torque"));
    assert!((torque + 0.24).abs() < 1e-9, "half of the drop, against the motion: {torque}");

    let selector = served.item("rendered_friction");
    assert_eq!((selector.choice.as_deref(), selector.options.len()), (Some("loaded"), 2));
    let drop = served.item("loaded.drop_velocity");
    assert_eq!((drop.value, drop.minimum, drop.maximum, &*drop.unit), (Some(1.5), Some(1e-6), Some(1e3), "rad/s"));
    assert!(drop.help.starts_with("Speed at half of the drop"), "{}", drop.help);
    assert!(served.signals().contains(&"added_load_torque".to_owned()), "its torque in the scope");
    served.describes(&["breakaway_torque", "drop_velocity", "bristle_stiffness"]);
    served.stop();
}
