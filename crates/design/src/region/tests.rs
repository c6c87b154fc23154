use super::*;
use stickslip_base::Preset;
use stickslip_base::parameters::presets;
use stickslip_base::preset::ControllerChoice;

fn read(name: &str) -> Preset<f64> {
    presets::find(name).unwrap().read().unwrap()
}

fn region(preset: &Preset<f64>) -> Region {
    Region::of(&preset.model, &preset.bench, Passage::default()).unwrap()
}

fn verdict(change: impl FnOnce(&mut Preset<f64>)) -> Verdict {
    let mut preset = read("clm-bench");
    change(&mut preset);
    region(&preset).judge(&preset.model.own, &preset.bench.desired, 50.0)
}

/// A drive motor that overcomes any friction.
fn strong(preset: &mut Preset<f64>) {
    let ControllerChoice::Cascade(controller) = &mut preset.bench.controller else { panic!("clm-bench has a cascade") };
    controller.torque_limit = 100.0;
    preset.model.scaling.servo_limit = 100.0;
}

/// The only exceeded limit, with its speeds.
fn only(verdict: &Verdict, limit: Limit) -> Shortage {
    let [shortage] = verdict.shortages[..] else { panic!("{verdict}") };
    assert_eq!(shortage.bound.limit, limit, "{verdict}");
    assert!(!verdict.renderable() && verdict.margin == shortage.bound.margin());
    shortage
}

#[test]
fn every_preset_with_a_load_motor_can_render_its_desired_friction() {
    for (name, _) in presets::list() {
        let mut preset = read(name);
        let desired = Stribeck { kinetic_torque: 0.5 * preset.model.own.kinetic_torque, ..preset.model.own };
        if preset.model.load_motor.torque_constant == 0.0 {
            preset.bench.desired = desired;
        }
        let verdict = region(&preset).judge(&preset.model.own, &preset.bench.desired, 50.0);
        if preset.model.load_motor.torque_constant > 0.0 {
            assert!(verdict.renderable(), "{name}: {verdict}");
        } else {
            assert!(only(&verdict, Limit::Current).bound.needed > 0.0 && verdict.margin == 0.0);
            assert!(verdict.to_string().contains("no load motor is mounted"), "{name}: {verdict}");
        }
    }
}

#[test]
fn the_current_limit_bounds_the_torque_and_a_feasible_viscous_friction_is_named() {
    let verdict = verdict(|preset| {
        strong(preset);
        preset.bench.desired.viscous_friction = 0.05;
    });
    let shortage = only(&verdict, Limit::Current);
    // (0.05 − 2e-4)·Ω − 0.06 N m passes 15 A · 0.0934 N m/A; a step of the speeds is 2.3 %.
    assert!((shortage.speeds[0] / (1.461 / 0.0498) - 1.0).abs() < 0.025, "{shortage:?}");
    assert_eq!((shortage.speeds[1], shortage.worst), (50.0, 50.0));
    let Some([feasible]) = verdict.feasible.as_deref() else { panic!("{:?}", verdict.feasible) };
    // (b − 2e-4)·50 − 0.06 = 1.401, rounded down to three digits.
    assert_eq!((feasible.parameter, feasible.value), (3, 0.0294));
    assert!(
        verdict.remedy().unwrap().contains("only one parameter: viscous friction b = 0.0294 N·m·s/rad."),
        "{verdict}"
    );
}

#[test]
fn the_feasible_value_is_accepted_and_one_beyond_it_is_not() {
    let margin = |b: f64| {
        let changed = |preset: &mut Preset<f64>| {
            strong(preset);
            preset.bench.desired.viscous_friction = b;
        };
        verdict(changed).margin
    };
    assert!(margin(0.0294) >= 1.0 && margin(0.0295) < 1.0);
}

#[test]
fn a_breakaway_torque_beyond_the_drive_is_not_renderable_even_where_the_load_motor_could_render_it() {
    // 1.4 N m of the drive less 0.01 N m of its brushes and 1.01e-3 kg m² · 200 rad/s² of acceleration.
    let region = region(&read("clm-bench"));
    assert!((region.drive_capacity(0.0) - (1.4 - 0.01 - 1.01e-3 * 200.0)).abs() < 1e-9, "{region:?}");
    let stiff = |torque: f64| {
        verdict(|preset| {
            preset.bench.desired = Stribeck { breakaway_torque: torque, stribeck_velocity: 20.0, ..preset.model.own };
        })
    };
    assert!(stiff(1.18).renderable());
    let refused = stiff(1.25);
    let shortage = only(&refused, Limit::Drive);
    assert!(shortage.bound.needed < 1.461 && shortage.worst < 1.0, "{shortage:?}");
    assert!(refused.to_string().contains("of the 1.400 N·m of the drive motor"), "{refused}");
}

#[test]
fn a_load_motor_that_drives_relieves_the_drive_motor_only_above_its_own_friction() {
    let verdict = verdict(|preset| {
        preset.model.own.breakaway_torque = 1.3;
        preset.bench.desired = preset.model.own;
    });
    // The wheel alone is too strong: no difference torque helps at rest.
    assert_eq!((only(&verdict, Limit::Drive).bound.needed, verdict.margin), (0.0, 0.0), "{verdict}");
}

#[test]
fn the_back_emf_limits_a_driving_motor_and_helps_a_braking_one() {
    // 8 V; at 50 rad/s the back-EMF takes 4.67 V of them from a driving motor.
    let weak = |preset: &mut Preset<f64>| preset.model.load_amplifier.supply_voltage = 8.0;
    let mut preset = read("clm-bench");
    weak(&mut preset);
    let Band { torque: [low, high], limits } = region(&preset).at(50.0);
    assert!((low + 0.0934 * (8.0 - 4.67) / 0.61).abs() < 1e-12 && high == 15.0 * 0.0934, "{low} … {high}");
    assert_eq!(limits, [Limit::Voltage, Limit::Current]);

    let own = |preset: &mut Preset<f64>| preset.model.own = Stribeck { viscous_friction: 0.02, ..preset.model.own };
    let driven = verdict(|preset| {
        weak(preset);
        own(preset);
    });
    let shortage = only(&driven, Limit::Voltage);
    assert!(shortage.bound.available < 8.0 - 4.6 && shortage.worst == 50.0, "{driven}");
    assert!(verdict(own).renderable());
}

#[test]
fn an_inductance_that_is_too_large_for_the_slope_is_named() {
    let soft = |preset: &mut Preset<f64>| {
        preset.model.load_motor.inductance = 20e-3;
        preset.model.load_amplifier.supply_voltage = 5.0;
        preset.bench.desired.stribeck_velocity = 0.2;
    };
    let mut preset = read("clm-bench");
    soft(&mut preset);
    let passage = Passage { acceleration: 200.0, tolerance: 1.0 };
    let region = Region::of(&preset.model, &preset.bench, passage).unwrap();
    let verdict = region.judge(&preset.model.own, &preset.bench.desired, 50.0);
    let shortage = only(&verdict, Limit::Slope);
    // (L/K)·|dM/dΩ|·200 rad/s² at the slowest speed, 5 mrad/s; there is next to no torque.
    let slope = 0.9 * libm::exp(-0.005 / 0.2) - 0.04 * libm::exp(-0.005 / 3.0);
    let needed = 20e-3 / 0.0934 * slope * 200.0;
    assert!((shortage.bound.needed / needed - 1.0).abs() < 0.01, "{verdict}: {needed}");
    let still = Region { passage: Passage { acceleration: 0.0, ..passage }, ..region };
    assert!(still.judge(&preset.model.own, &preset.bench.desired, 50.0).renderable());
}

#[test]
fn a_drop_narrower_than_noise_and_delay_gives_the_smallest_stribeck_velocity() {
    let verdict = verdict(|preset| preset.bench.desired.stribeck_velocity = 0.05);
    let shortage = only(&verdict, Limit::Response);
    assert_eq!(shortage.bound.available, 0.1 * 0.3);
    let smallest = verdict.feasible.iter().flatten().find(|feasible| feasible.parameter == 2).unwrap();
    assert!(smallest.value > 0.1 && smallest.value < 1.5, "{verdict}");
    assert!(verdict.to_string().contains("delay (0.7500 ms"), "{verdict}");
}

#[test]
fn speeds_above_the_limit_of_supervision_are_not_rendered() {
    let verdict = verdict(|preset| preset.bench.safety.speed = 40.0);
    let shortage = only(&verdict, Limit::Speed);
    assert!(shortage.speeds[0] > 40.0 && shortage.bound.available == 40.0);
    assert!(verdict.feasible == Some(Vec::new()), "no parameter of the friction is sufficient");
    assert!(verdict.to_string().ends_with("no single parameter is sufficient."), "{verdict}");
}

#[test]
fn without_a_difference_nothing_is_needed() {
    let verdict = verdict(|preset| preset.bench.desired = preset.model.own);
    assert_eq!((verdict.margin, verdict.sign_change_time), (f64::INFINITY, 3.0 * 250e-6));
    let region = region(&read("clm-bench"));
    // 48 V do not hold 48 V·K/R for long: the last of the current is never reached.
    assert_eq!(region.sign_change_time(48.0 * 0.0934 / 0.61), f64::INFINITY);
    let short = region.sign_change_time(1e-6);
    assert!((short / (2.0 * 1e-6 / 0.0934 * 0.42e-3 / 48.0) - 1.0).abs() < 1e-6, "L·2i/U: {short}");
}

#[test]
fn a_bound_that_is_not_finite_permits_no_torque() {
    for (needed, available) in [(f64::NAN, 1.0), (1.0, f64::NAN), (f64::NAN, f64::NAN), (-1.0, -1.0)] {
        assert_eq!(Bound { limit: Limit::Voltage, needed, available }.margin(), 0.0);
    }
}
