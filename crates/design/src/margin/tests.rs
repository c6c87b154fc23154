use super::*;
use crate::DesignError;
use stickslip_base::parameters::presets;
use stickslip_base::preset::{LawChoice, Preset, Residual, Tracking};
use stickslip_core::friction::Stribeck;

/// The prototype's bench without its friction wheel under a law at a tick rate [Hz], and the law.
fn prototype(law: LawChoice<f64>, tick_rate: f64) -> (Preset<f64>, Law<f64>) {
    let mut preset: Preset<f64> = presets::find("prototype").unwrap().read().unwrap();
    (preset.bench.tick_rate, preset.bench.control_divider, preset.bench.law) = (tick_rate, 0.0, law);
    let [breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction] = [0.20, 0.12, 1.5, 2e-3];
    let released =
        Stribeck { breakaway_torque, kinetic_torque, stribeck_velocity, viscous_friction, ..preset.model.own };
    preset.model.own = released;
    let law = named(&preset);
    (preset, law)
}

fn named(preset: &Preset<f64>) -> Law<f64> {
    crate::named_law(&preset.model, &preset.bench).unwrap().expect("the law is not auto")
}

fn of(law: LawChoice<f64>, tick_rate: f64) -> Result<Margin, Error> {
    let (preset, law) = prototype(law, tick_rate);
    margin(&law, &preset.model, &preset.bench)
}

#[test]
fn desired_bristles_equal_to_the_own_require_no_torque_and_have_all_margins() {
    let margin = of(LawChoice::Bristle, 4000.0).unwrap();
    assert_eq!((margin.gain_margin, margin.delay_margin), (None, None));
    assert!(margin.predicted_chatter < 1e-3, "{margin}");
    // Bristles stiffer than its own have a limit.
    assert!(margin.stiffness_limit.is_some_and(|limit| (6e3..2e4).contains(&limit)), "{margin}");
}

#[test]
fn a_law_without_bristles_has_no_limit_of_stiffness() {
    for law in [LawChoice::Paper, LawChoice::Karnopp] {
        assert_eq!(of(law, 4000.0).unwrap().stiffness_limit, None, "{law:?}");
    }
}

#[test]
fn an_unstable_law_is_refused_with_the_nearest_stiffness_that_is_not() {
    let (mut preset, _) = prototype(LawChoice::Residual(Residual::default()), 4000.0);
    preset.bench.desired_bristles.stiffness = 2e4;
    let law = named(&preset);
    let refused = margin(&law, &preset.model, &preset.bench).unwrap_err();
    let Some(&DesignError::Chatters { feasible: Some(feasible), stiffness, .. }) = refused.of() else {
        panic!("{refused}")
    };
    assert_eq!(stiffness, Some(2e4));
    assert!(refused.to_string().contains("bench.desired_bristles.stiffness from 20000 N m/rad"), "{refused}");
    // The named stiffness is accepted; a tenth more chatters.
    let rms = |stiffness| {
        let sampled = SampledLoop::new(with_stiffness(&law, stiffness), &preset.model, &preset.bench).unwrap();
        chatter(&sampled, &preset.model, &preset.bench).rms()
    };
    assert!(rms(feasible) <= CHATTER_LIMIT && rms(1.1 * feasible) > CHATTER_LIMIT, "{feasible}");
}

#[test]
fn the_loop_is_stable_up_to_the_stated_gain_and_delay_and_unstable_above() {
    let (mut preset, _) = prototype(LawChoice::Bristle, 10_000.0);
    preset.bench.desired_bristles.stiffness = 1.4e4;
    let law = named(&preset);
    let margin = margin(&law, &preset.model, &preset.bench).unwrap();
    let (gain, delay) = (margin.gain_margin.unwrap(), margin.delay_margin.unwrap());
    let mut sampled = SampledLoop::new(law, &preset.model, &preset.bench).unwrap();
    let mut grows = |gain: f64, late: usize| {
        (sampled.gain, sampled.late) = (gain, late);
        chatter(&sampled, &preset.model, &preset.bench).grows
    };
    assert!(!grows(gain, 0) && grows(1.02 * gain, 0), "{margin}");
    let late = (delay / 25e-6).round() as usize;
    assert!(!grows(1.0, late) && grows(1.0, late + 1), "{margin}");
}

#[test]
fn the_admittance_is_not_limited_by_the_stiffness_that_it_renders_but_by_a_slow_tick() {
    let law = LawChoice::Admittance(Tracking { bandwidth: 150.0, ..Tracking::default() });
    assert_eq!(of(law, 4000.0).unwrap().stiffness_limit, None);
    assert!(matches!(of(law, 1000.0).as_ref().err().and_then(|error| error.of()), Some(DesignError::Chatters { .. })));
}

#[test]
fn the_admittance_has_a_small_gain_margin_since_it_is_softer_than_the_own_bristles() {
    // Overcompensated by a share, own bristles push away with that share of their stiffness, J_L·ω_t² holds.
    let (preset, _) = prototype(LawChoice::Paper, 4000.0);
    let tracking = Tracking::default();
    let holds = preset.model.drive.load_inertia * tracking.bandwidth * tracking.bandwidth;
    let expected = 1.0 + holds / preset.model.own_bristles.stiffness;
    let gain = of(LawChoice::Admittance(tracking), 4000.0).unwrap().gain_margin.unwrap();
    // Within the accuracy of the search and the threshold of growth.
    assert!((gain - expected).abs() < 0.01, "{gain} {expected}");
}
