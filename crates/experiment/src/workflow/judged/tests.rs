use super::*;
use crate::{Block, Dropped, FrictionCurve, FrictionPlan};
use stickslip_base::Preset;
use stickslip_base::parameters::presets;

/// Deviations of one plateau: own friction from its model, command from the law, load motor from its command [N m].
#[derive(Clone, Copy, Default)]
struct Off {
    own: f64,
    law: f64,
    motor: f64,
    sticks: bool,
}

/// A completed measurement with these deviations at each set speed.
fn measured(off: impl Fn(f64) -> Off) -> Rendering {
    let preset: Preset<f64> = presets::find("clm-bench").unwrap().read().unwrap();
    let plan = FrictionPlan::quick();
    let (rendering, _) = Rendering::planned(&plan, &preset.bench.desired, &preset.model, &preset.bench).unwrap();
    let law = rendering.law;
    let plateau = |velocity: f64| {
        let Off { own, law: command, motor, sticks } = off(velocity);
        let sign = velocity.signum();
        let difference_torque = law.torque(velocity) + sign * command;
        let torque = law.desired.torque(velocity) + sign * (own + command + motor);
        Plateau {
            set_velocity: velocity,
            velocity,
            velocity_spread: 0.0,
            torque,
            standard_error: 1e-3,
            deviation: 0.0,
            sway: 0.0,
            dropped: sticks.then_some(Dropped::Sticks { deviation: 0.5 }),
            blocks: vec![Block { velocity, torque, difference_torque, load_torque: difference_torque + sign * motor }],
            noise: Default::default(),
            averaging_time: 0.0,
            own: 0.0,
            harmonics: None,
        }
    };
    let plateaus = plan.speeds().flat_map(|speed| [plateau(speed), plateau(-speed)]).collect();
    Rendering { curve: FrictionCurve { plateaus, ripple: 0.0, duration: 1.0, complete: true }, ..rendering }
}

/// Off between 1 and 8 rad/s.
fn between(off: Off) -> impl Fn(f64) -> Off {
    move |speed| if (1.0..8.0).contains(&speed.abs()) { off } else { Off::default() }
}

fn only_reason(rendering: &Rendering) -> String {
    let (verdict, reasons) = rendering.judged();
    assert_eq!(verdict, Verdict::NotMet, "{reasons:?}");
    let [reason] = &reasons[..] else { panic!("{reasons:?}") };
    reason.clone()
}

#[test]
fn a_friction_within_the_tolerance_is_met() {
    // M_S = 0.3 N m permits 0.03.
    let (verdict, reasons) = measured(between(Off { own: 0.029, ..Off::default() })).judged();
    assert_eq!(verdict, Verdict::Met, "{reasons:?}");
    assert!(reasons[0].ends_with("at most 9.67\u{a0}% of M_S; permitted: 10.00\u{a0}% of M_S."), "{reasons:?}");
}

#[test]
fn a_deviation_has_its_speeds_its_cause_and_a_remedy() {
    let off = Off::default();
    let cases = [
        (Off { own: 0.1, ..off }, "too high", "own friction differs", "Measure the own friction again"),
        (Off { law: -0.1, ..off }, "too low", "estimated velocity is late or noisy", "Increase Ω_Strib"),
        (Off { motor: -0.1, ..off }, "too low", "differs from its command", "current limit"),
        (Off { motor: -0.13, own: 0.05, ..off }, "too low", "differs from its command", "current limit"),
    ];
    for (off, much, cause, remedy) in cases {
        let reason = only_reason(&measured(between(off)));
        assert!(reason.starts_with("from 1.") && reason.contains(" rad/s to "), "{reason}");
        assert!([much, cause, remedy].iter().all(|part| reason.contains(part)), "{reason}");
    }
}

#[test]
fn a_deviation_in_one_direction_is_found_once_with_its_sign() {
    let off = between(Off { own: 0.1, ..Off::default() });
    let reason = only_reason(&measured(|speed| if speed < 0.0 { off(speed) } else { Off::default() }));
    assert!(reason.contains("at -") || reason.contains("at −"), "{reason}");
}

#[test]
fn a_load_that_sticks_is_not_met() {
    let reason = only_reason(&measured(between(Off { sticks: true, ..Off::default() })));
    assert!(reason.contains("sticks or hunts. Reduce M_S"), "{reason}");
}

#[test]
fn an_incomplete_measurement_is_neither_met_nor_not() {
    let mut rendering = measured(|_| Off::default());
    rendering.curve.complete = false;
    rendering.curve.plateaus.truncate(6);
    let (verdict, reasons) = rendering.judged();
    assert_eq!(verdict, Verdict::Incomplete);
    assert!(reasons[0].ends_with("plateaus measured."), "{reasons:?}");
}

#[test]
fn a_text_that_begins_with_a_verdict_is_recognised() {
    for verdict in Verdict::ALL {
        assert_eq!(Verdict::of_text(&format!("{}: because.", verdict.word())), Some(verdict));
    }
    assert_eq!(Verdict::of_text("The friction: measured."), None);
}
