//! Direction, position and load: effect of each, and combination with any model.

use core::f64::consts::TAU;

use proptest::prelude::*;

use super::{
    bristles, direction, driven, from_bent, load, midpoint, model, plain, position, settling, steady_deflection,
};
use crate::friction::{
    Bristle, Contact, Direction, ElastoPlastic, Friction, Load, Memory, Model, Position, Ripple, Static,
};

/// Torque [N m] of steady sliding, by steps over a hundred steady deflections.
fn slide(friction: &Friction<f64>, contact: Contact<f64>) -> f64 {
    let (dt, steps) = settling(friction, contact.velocity.abs());
    let (mut memory, mut torque) = (Memory::default(), 0.0);
    for _ in 0..steps {
        torque = midpoint(friction, &mut memory, contact, dt);
    }
    torque
}

/// The same without the viscous part.
fn without_viscous(model: Model<f64>) -> Model<f64> {
    let mut model = model;
    match &mut model {
        Model::Nothing => {}
        Model::Static(model) => model.sliding.viscous_friction = 0.0,
        Model::Dahl(model) => model.viscous_friction = 0.0,
        Model::Lugre(model) => model.sliding.viscous_friction = 0.0,
        Model::ElastoPlastic(model) => model.lugre.sliding.viscous_friction = 0.0,
        Model::MaxwellSlip(model) => model.sliding.viscous_friction = 0.0,
    }
    model
}

proptest! {
    #[test]
    fn position_and_load_multiply_the_torque_of_any_model_and_leave_its_deflection(
        model in model(1e-3, 1e7), position in position(), load in load(), deflection in -2.0..2.0f64,
        velocity in -1e2..1e2f64, angle in -10.0..10.0f64, carried in -1.0..1.0f64, arrest in -10.0..10.0f64,
    ) {
        let modified = Friction { position, load, ..plain(model) };
        let Position::Ripple(ripple) = position else { unreachable!("the strategy gives ripples") };
        let expected = (1.0 + load.sensitivity * carried.abs())
            * (1.0 + ripple.amplitude * (ripple.periods * angle + ripple.phase).sin());
        let deflection = deflection * steady_deflection(&model, velocity.abs());
        let dt = 25e-6;
        let (end, torque) = from_bent(&plain(model), deflection, Contact { arrest, ..driven(velocity) }, dt);
        // The arresting torque is scaled like the friction, so that the static model has to hold the same share.
        let contact = Contact { velocity, angle, load: carried, arrest: expected * arrest };
        let (same, multiplied) = from_bent(&modified, deflection, contact, dt);
        prop_assert_eq!(same, end);
        // At 20 periods and 10 rad the sine's argument is rounded by 3e-14; the factor is 0.1 at least.
        prop_assert!((multiplied - expected * torque).abs() <= 1e-11 * (expected * (torque.abs() + arrest.abs())));
    }

    #[test]
    fn direction_sets_the_ratio_of_the_sliding_levels(
        model in model(1e-3, 1e7), asymmetry in -0.95..0.95f64, velocity in 1e-3..1e2f64,
    ) {
        let direction = Direction { asymmetry, ..Direction::default() };
        let friction = Friction { direction, ..plain(without_viscous(model)) };
        let ratio = slide(&friction, driven(velocity)) / slide(&friction, driven(-velocity));
        let expected = -(1.0 + asymmetry) / (1.0 - asymmetry);
        prop_assert!((ratio - expected).abs() <= 1e-9 * expected.abs(), "{ratio}, expected {expected}");
    }

    #[test]
    fn the_torque_of_bristles_is_continuous_at_a_reversal(
        bristles in bristles(1.0, 1e5), direction in direction(), position in position(), deflection in prop_oneof![-2.0..-0.01f64, 0.01..2.0f64], creep in 1e-12..1e-9f64,
    ) {
        let friction = Friction { direction, position, ..plain(bristles) };
        let (stiffness, damping) = friction.stiffest();
        let dt = 1e-6;
        let at_rest = deflection * steady_deflection(&friction.model, 0.0);
        let torque = |velocity| from_bent(&friction, at_rest, driven(velocity), dt).1;
        // At these speeds only the distance and the damping change the torque; sliding bristles relax at up to three
        // times Ω, as |z| ≤ 2·z_s here.
        let bound = 3.0 * (stiffness * dt + damping) * 2.0 * creep;
        let rounding = 1e-14 * (stiffness * at_rest.abs() + friction.direction.offset.abs());
        let jump = (torque(creep) - torque(-creep)).abs();
        prop_assert!(jump <= bound + rounding, "jumps by {jump} N m, bound {bound} N m");
    }

    #[test]
    fn a_ripple_leaves_the_mean_over_a_turn_and_has_its_amplitude(
        model in model(1e-3, 1e7), direction in direction(), position in position(), velocity in 1e-3..1e2f64,
    ) {
        let Position::Ripple(ripple) = position else { unreachable!("the strategy gives ripples") };
        let friction = Friction { direction: Direction { offset: 0.0, ..direction }, position, ..plain(model) };
        let level = Friction { position: Position::Constant, ..friction }.steady_torque(velocity, 0.0, 0.0);
        // At least 40 points per period: sums of whole sines over a turn vanish, except for rounding.
        let angles = 760;
        let mean = (0..angles)
            .map(|i| friction.steady_torque(velocity, TAU * f64::from(i) / f64::from(angles), 0.0) / f64::from(angles))
            .sum::<f64>();
        prop_assert!((mean / level - 1.0).abs() <= 1e-12, "{mean} instead of {level}");
        for (quarter, expected) in [(0.25, 1.0 + ripple.amplitude), (0.75, 1.0 - ripple.amplitude)] {
            let angle = (TAU * quarter - ripple.phase) / ripple.periods;
            let extreme = friction.steady_torque(velocity, angle, 0.0);
            prop_assert!((extreme / level - expected).abs() <= 1e-12, "{} instead of {expected}", extreme / level);
        }
    }

    #[test]
    fn a_thousand_turns_further_the_ripple_is_the_same(
        amplitude in 0.0..0.9f64, periods in 1..1000i32, phase in -7.0..7.0f64, angle in -3.0..3.0f64,
    ) {
        let ripple = Ripple { amplitude, periods: f64::from(periods), phase };
        let friction = Friction { position: Position::Ripple(ripple), ..plain(Model::Static(Static::default())) };
        let torque = |angle| friction.steady_torque(1.0, angle, 0.0);
        // An angle of 6283 rad has a resolution of 2^-41 rad, and so has its distance from whole turns.
        let tolerance = 4.0 * 2_f64.powi(-41) * amplitude * ripple.periods * 0.3;
        for turns in [1000.0, -1000.0] {
            let change = torque(angle + turns * TAU) - torque(angle);
            prop_assert!(change.abs() <= tolerance + 1e-15, "{change} N m, tolerance {tolerance} N m");
        }
    }

    #[test]
    fn friction_rises_with_the_torque_carried_whatever_its_sign(
        model in model(1e-3, 1e7), sensitivity in 0.0..100.0f64, carried in 0.0..10.0f64, velocity in 1e-3..1e2f64,
    ) {
        let friction = Friction { load: Load { sensitivity }, ..plain(model) };
        let free = slide(&friction, driven(velocity));
        for load in [carried, -carried] {
            let loaded = slide(&friction, Contact { load, ..driven(velocity) });
            let expected = (1.0 + sensitivity * carried) * free;
            prop_assert!((loaded - expected).abs() <= 1e-13 * expected, "{loaded}, expected {expected}");
        }
    }
}

#[test]
fn static_friction_jumps_at_a_reversal_where_bristles_do_not() {
    let jump = |model| {
        let deflection = 0.5 * steady_deflection(&model, 0.0);
        let torque = |velocity| from_bent(&plain(model), deflection, driven(velocity), 1e-6).1;
        torque(1e-9) - torque(-1e-9)
    };
    let bristles = ElastoPlastic::<f64>::default();
    assert!((jump(Model::Static(Static::default())) - 0.6).abs() <= 1e-9);
    assert!(jump(Model::ElastoPlastic(bristles)).abs() <= 4e-9 * bristles.damping(0.0));
}
