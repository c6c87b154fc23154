//! A controller in one file of Rust is available wherever controllers are: as C, library, FMU and A2L, and in the loop.

#[path = "../../../../stickslip/examples/own_controller.rs"]
mod own_controller;

use own_controller::SlidingMode;
use stickslip::external::{External, ModuleSample, Role};
use stickslip::generate::{Variables, Version, module_of};
use stickslip::load::load;
use stickslip::{Preset, Watch, parameters};
use stickslip_core::block::Block as _;
use stickslip_core::control::ControllerInput;

use super::served::Served;

/// Opens its library.
fn open_library(controller: &SlidingMode<f64>, folder: &std::path::Path) -> External {
    let module = module_of(controller, "sliding_mode", 1e-3).expect("a valid name in C");
    let path = folder.join("sliding_mode.so");
    std::fs::write(&path, module.library().expect("a C compiler")).expect("a writable folder");
    External::trusted(&path, Role::Controller).expect("a library of five functions")
}

#[test]
fn its_library_has_its_table_and_gives_its_bits() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let controller = SlidingMode::<f64> { slope: 30.0, ..SlidingMode::default() };
    let mut library = open_library(&controller, folder.path());
    let described = library.description().clone();
    assert_eq!(described.name, "sliding_mode");
    let [slope, .., limit] = &described.parameters[..] else { panic!("{described:?}") };
    assert_eq!((slope.name.as_str(), slope.unit.as_str(), slope.initial), ("slope", "1/s", 30.0));
    assert_eq!((slope.minimum, slope.maximum), (0.1, 1e3));
    assert!(
        slope.help.starts_with("Slope of the line") && limit.name == "torque_limit" && described.parameters.len() == 6
    );
    library.begin(1e-3, 1.4).expect("it begins");
    let mut state = Default::default();
    for k in 0..2000 {
        let t = 1e-3 * f64::from(k);
        let [position, angle] = [0.3 * (7.0 * t).sin(), 0.29 * (7.0 * t - 0.05).sin()];
        let input = ControllerInput {
            reference_position: position,
            reference_velocity: 2.1 * (7.0 * t).cos(),
            reference_acceleration: -14.7 * (7.0 * t).sin(),
            measured_angle: angle,
            measured_velocity: 2.0 * (7.0 * t - 0.05).cos(),
            ..ControllerInput::default()
        };
        let sample = ModuleSample {
            time: t,
            reference_position: input.reference_position,
            reference_velocity: input.reference_velocity,
            reference_acceleration: input.reference_acceleration,
            measured_angle: input.measured_angle,
            measured_velocity: input.measured_velocity,
            ..ModuleSample::default()
        };
        let own = controller.step(&mut state, input, 1e-3).torque;
        assert_eq!(library.step(&sample).expect("a torque").to_bits(), own.to_bits(), "{k}");
    }
    assert!(state.integral != 0.0);
}

#[test]
fn it_is_in_the_loop_of_a_bench_as_fmu_and_for_calibration_tools() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let preset: Preset<f64> =
        parameters::presets::find("clm-bench").and_then(|source| source.read()).expect("a preset that reads");
    let library = open_library(&SlidingMode::default(), folder.path());
    let loaded = load(&preset, library, 4.0, 1, None, &Watch::silent()).expect("it runs");
    assert_eq!(loaded.fault, None);
    let module = module_of(&SlidingMode::<f64>::default(), "sliding_mode", 1e-3).expect("a valid name in C");
    let described = module.description(&Variables::default()).expect("a description without a linked program");
    assert!(described.parameters == 6 && described.text.contains("parameters.slope"));
    assert_eq!(module.fmu(Version::Three).expect("a C compiler").variables, 6 + 7 + 1 + 1);
    assert!(module.generated(false).files.iter().any(|(name, _)| name == "sliding_mode_selftest.c"));
}

#[test]
fn on_a_served_bench_its_table_is_in_selector_form_scope_and_description() {
    let project = tempfile::tempdir().expect("a temporary folder");
    let module = module_of(&SlidingMode::<f64>::default(), "sliding_mode", 1e-3).expect("a valid name in C");
    let served = Served::with(module.library().expect("a C compiler"), Role::Controller, project.path());
    let selector = served.item("position_controller");
    assert_eq!((selector.choice.as_deref(), selector.options.len()), (Some("loaded"), 2));
    let slope = served.item("loaded.slope");
    assert_eq!((slope.value, slope.minimum, slope.maximum, &*slope.unit), (Some(25.0), Some(0.1), Some(1e3), "1/s"));
    assert!(slope.help.starts_with("Slope of the line"), "{}", slope.help);
    assert!(served.signals().contains(&"added_torque".to_owned()), "its torque in the scope");
    served.describes(&["slope", "amplitude", "layer"]);
    assert_eq!(served.set("loaded.slope", "30"), 1);
    served.stop();
}
