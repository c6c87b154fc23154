use super::*;
use crate::DesignError;
use stickslip_base::Preset;
use stickslip_base::parameters::presets;

/// An arm of these shares of the load inertia, its mode at this frequency [Hz] with a damping ratio of 1 %.
fn arm(preset: &Preset<f64>, inertia: f64, rigid: f64, hertz: f64) -> ElasticArm<f64> {
    let (load, omega) = (preset.model.drive.load_inertia, TAU * hertz);
    let inertia = inertia * load;
    ElasticArm {
        inertia,
        stiffness: inertia * omega * omega,
        damping: 0.02 * inertia * omega,
        rigid_inertia: rigid * load,
    }
}

fn preset(name: &str, rate: f64) -> Preset<f64> {
    let mut preset: Preset<f64> = presets::find(name).unwrap().read().unwrap();
    preset.bench.tick_rate = rate;
    preset
}

fn designed(preset: &mut Preset<f64>, arm: ElasticArm<f64>) -> Result<ArmRendering<f64>, Error> {
    preset.bench.arm = Arm::Elastic(arm);
    arm_rendering(&preset.model, &preset.bench).map(|rendered| match rendered {
        RenderedArm::Elastic(rendering) => rendering,
        RenderedArm::Nothing => panic!("there is an arm"),
    })
}

#[test]
fn a_fast_observer_drives_a_slow_mode_and_the_acceleration_a_fast_one() {
    let mut preset = preset("prototype", 4000.0);
    let [slow, fast] = [9.0, 15.0].map(|hertz| arm(&preset, 0.2, 0.1, hertz));
    assert_eq!(designed(&mut preset, slow).unwrap().by_acceleration, 0.0);
    assert_eq!(designed(&mut preset, fast).unwrap().by_acceleration, 1.0);
}

#[test]
fn a_heavy_arm_gets_a_low_pass_and_one_that_is_too_heavy_is_refused() {
    let mut preset = preset("prototype", 4000.0);
    let load = preset.model.drive.load_inertia;
    let mode = arm(&preset, 0.2, 0.1, 10.0);
    let [plain, filtered] =
        [false, true].map(|filtered| arm_limit(&mode, filtered, &preset.model, &preset.bench).unwrap());
    assert!(plain.admitted < filtered.admitted && filtered.admitted < filtered.stability);
    let mut with = |rigid_inertia: f64| designed(&mut preset, ElasticArm { rigid_inertia, ..mode });
    assert_eq!(with(0.99 * plain.admitted).unwrap().low_pass, 1.0);
    assert!(with(1.01 * plain.admitted).unwrap().low_pass < 1.0);
    let refused = with(1.01 * filtered.admitted).unwrap_err();
    assert!(
        matches!(refused.of(), Some(DesignError::ArmTooHeavy { feasible, .. }) if *feasible == filtered.admitted),
        "{refused}"
    );
    assert!(with(2.0 * load).is_err());
}

#[test]
fn an_arm_with_a_law_of_a_virtual_load_is_refused() {
    let mut preset = preset("prototype", 4000.0);
    preset.bench.arm = Arm::Elastic(arm(&preset, 0.2, 0.1, 10.0));
    for (kind, accepted) in [("residual", true), ("admittance", false)] {
        let text = stickslip_base::parameters::write_commented(&preset);
        let changes = [("bench.law.kind".to_owned(), format!("\"{kind}\""))];
        let result = stickslip_base::parameters::set_all::<Preset<f64>>(&text, "a.toml", &changes)
            .and_then(|text| stickslip_base::parameters::read::<Preset<f64>>(&text, "a.toml").map_err(Into::into));
        assert_eq!(result.is_ok(), accepted, "{kind}: {:?}", result.err().map(|error| error.to_string()));
    }
}
